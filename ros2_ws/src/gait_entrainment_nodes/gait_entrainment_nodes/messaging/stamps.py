# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS stamps of integer nanoseconds; gait_entrainment_bags.messages converts the other way."""

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND

# Heel strike 0 of a lock-step run [ns since 1970]: 2000-01-01, clearly not a recording time.
LOCK_STEP_START = 946_684_800 * NANOSECONDS_PER_SECOND
# Real time: from the start request to the start of the run [ns]; the first promise arrives in it.
START_DELAY = 200_000_000
# Real time: how often the walker reports progress and promises are requested [ns].
PROGRESS_PERIOD = 20_000_000


def to_time(nanoseconds: int) -> Time:
    """Return integer nanoseconds since 1970 as a ROS stamp."""
    sec, nanosec = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    return Time(sec=sec, nanosec=nanosec)


def header(nanoseconds: int) -> Header:
    """Return a header with a stamp but no frame: these messages have no place in space."""
    return Header(stamp=to_time(nanoseconds))
