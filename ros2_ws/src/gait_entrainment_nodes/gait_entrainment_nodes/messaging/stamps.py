# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS stamps of integer nanoseconds; gait_entrainment_bags.messages goes the other way."""

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND


def to_time(nanoseconds: int) -> Time:
    """Return integer nanoseconds since 1970 as a ROS stamp."""
    sec, nanosec = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    return Time(sec=sec, nanosec=nanosec)


def header(nanoseconds: int) -> Header:
    """Return a header with a stamp; no frame: what is sent here has no place in space."""
    return Header(stamp=to_time(nanoseconds))
