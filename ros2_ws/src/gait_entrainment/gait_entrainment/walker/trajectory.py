# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
From switch to switch: the loop that every use of the walker runs.

The perturbation is a list of changes for each side: from the stamp `changes[i]` on the torque is
`torques[i]`. Both sides share the arrays, the left one first, the right one from index `right` on;
each begins with an entry before all time, torque zero, and neighbours differ. A gait event comes
before a torque change of the same stamp, and a change acts only on what comes after its stamp. So
all that happens up to a stamp depends on the torque before it alone, and an event can be told as
soon as that is promised.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model
from gait_entrainment.walker.segment import (
    DOUBLE_STANCE,
    FALL,
    FLY_OFF,
    HEEL_STRIKE,
    TOE_OFF,
    WORK_SHAPE,
    Log,
    Segment,
)
from gait_entrainment.walker.transitions import (
    NANO,
    change_torque,
    clock,
    collide,
    enter_double_stance,
    leave_double_stance,
    unload,
)

Stamps = NDArray[np.int64]

# What `proceed` did.
SWITCHED: Final = 0
HELD: Final = 1
ENDED: Final = 2


@compiled
def first_cursors(right: int) -> Stamps:
    """Index of each side's first change."""
    cursors = np.zeros(2, np.int64)
    cursors[1] = right
    return cursors


@compiled
def skip_changes(changes: Stamps, right: int, cursors: Stamps, side: int, after: int) -> bool:
    """Move a side's cursor to its first change later than `after`; whether there is one."""
    index, end = cursors[side], right if side == 0 else changes.size
    while index < end and changes[index] <= after:
        index += 1
    cursors[side] = index
    return bool(index < end)


@compiled
def proceed(
    model: Model,
    work: Floats,
    segment: Segment,
    changes: Stamps,
    torques: Floats,
    right: int,
    cursors: Stamps,
    until: int,
) -> int:
    """
    Go on to the next switch, writing the segment it begins over `segment`.

    HELD if it comes after `until`, ENDED if the walker falls or flies off before. Such an end
    comes after a torque change of its own stamp, which may avert it.
    """
    end, rest = clock(segment.stamp, segment.rest, segment.duration)
    terminal = segment.ends == FALL or segment.ends == FLY_OFF
    due = end + 1 if terminal else end
    trailing = 1 - segment.leading
    if segment.stance == DOUBLE_STANCE:
        ahead = skip_changes(changes, right, cursors, trailing, segment.after)
        index = cursors[trailing]
        if ahead and changes[index] < due:
            stamp = changes[index]
            if stamp >= until:
                return HELD
            elapsed = (stamp - segment.stamp) / NANO - segment.rest
            position = position_at(model, work, segment, elapsed)
            segment.stamp, segment.rest, segment.after = stamp, 0.0, stamp
            change_torque(model, segment, position, torques[index], work)
            return SWITCHED
    if due > until:
        return HELD
    if terminal:
        return ENDED
    segment.stamp, segment.rest = end, rest
    segment.after = max(segment.after, end - 1)
    if segment.ends == HEEL_STRIKE:
        # The stance leg now trails: its torque is what held before this stamp.
        skip_changes(changes, right, cursors, segment.leading, segment.after)
        collide(model, segment, torques[cursors[segment.leading] - 1], work)
    elif segment.ends == TOE_OFF:
        leave_double_stance(model, segment, work)
    else:
        unload(model, segment, work)
    return SWITCHED


@compiled
def advance(
    model: Model,
    log: Log,
    count: int,
    changes: Stamps,
    torques: Floats,
    right: int,
    until: int,
) -> tuple[int, int]:
    """
    Append to the `count` segments of `log` all that begin by `until`.

    Returns the new count and HELD, ENDED, or SWITCHED where the log is full.
    """
    work = np.empty(WORK_SHAPE)
    cursors = first_cursors(right)
    while count < log.size:
        log[count] = log[count - 1]
        outcome = proceed(model, work, log[count], changes, torques, right, cursors, until)
        if outcome != SWITCHED:
            return count, outcome
        count += 1
    return count, SWITCHED


@compiled
def start_walking(model: Model, segment: Segment, leading: int, apex: float) -> None:
    """Write the first segment: right after heel strike 0 of `leading`."""
    work = np.empty(WORK_SHAPE)
    segment.stamp, segment.rest, segment.after = 0, 0.0, -1
    segment.began, segment.leading, segment.step = HEEL_STRIKE, leading, 1
    segment.apex = apex
    enter_double_stance(model, segment, 0.0, work)
