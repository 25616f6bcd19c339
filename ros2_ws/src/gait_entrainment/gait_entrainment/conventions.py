# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Shared vocabulary: sides, kinds of gait events, and nanosecond stamps."""

import enum
from typing import Any

NANOSECONDS_PER_SECOND = 1_000_000_000


class Side(enum.IntEnum):
    """A leg, or the joint, foot and torque that belong to it."""

    LEFT = 0
    RIGHT = 1

    @property
    def other(self) -> "Side":
        """The opposite leg."""
        return Side(1 - self)


class EventKind(enum.IntEnum):
    """What happened at a gait event."""

    HEEL_STRIKE = 0
    TOE_OFF = 1


def nanoseconds(seconds: float) -> int:
    """
    Quantize seconds since the start of the run to the integer nanoseconds of a stamp.

    A double resolves far less than a nanosecond if it counts from the start of a run, but only
    0.2 microseconds if it counts from 1970. The core therefore quantizes before the node adds the
    start stamp.
    """
    return round(seconds * NANOSECONDS_PER_SECOND)


def nanoseconds_of(stamp: Any) -> int:
    """Return a ROS time or duration, decoded by any reader, as integer nanoseconds."""
    return int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
