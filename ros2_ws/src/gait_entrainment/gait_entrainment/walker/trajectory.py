# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The loop from switch to switch that every use of the walker runs.

A gait event comes before a torque change of the same stamp, and a change acts only on what comes
after its stamp. So everything that happens up to a stamp depends only on the torque before it, and
an event can be published as soon as that torque is promised.
"""

from typing import Final, NamedTuple

import numpy as np

from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model, Stamps
from gait_entrainment.walker.segment import WORK_SIZE, Log, Segment, Stance, Switch
from gait_entrainment.walker.transitions import (
    NANO,
    change_torque,
    clock,
    collide,
    enter_double_stance,
    leave_double_stance,
    unload,
)

# What `proceed` did.
SWITCHED: Final = 0
HELD: Final = 1
ENDED: Final = 2


class Torques(NamedTuple):
    """
    Torque of the ankle robots: from the stamp changes[i] [ns] on it is torques[i] [N m].

    The left robot's changes come first; the right robot's start at index `right`. Each side begins
    with an entry earlier than any time, torque zero, and adjacent torques differ.
    """

    changes: Stamps
    torques: Floats
    right: int


@compiled
def skip_changes(robot: Torques, cursors: Stamps, side: int, after: int) -> bool:
    """Move a side's cursor to its first change later than `after`; return whether it exists."""
    index, end = cursors[side], robot.right if side == 0 else robot.changes.size
    while index < end and robot.changes[index] <= after:
        index += 1
    cursors[side] = index
    return bool(index < end)


@compiled
def proceed(
    model: Model, work: Floats, segment: Segment, robot: Torques, cursors: Stamps, until: int
) -> int:
    """
    Go on to the next switch and overwrite `segment` with the segment that it begins.

    `cursors` point to a change of each side that is not later than the next one, initially [0,
    right]. Returns HELD if the switch is later than `until`, ENDED if the walker falls or flies
    off before. Such an end comes after a torque change of the same stamp, which may avert it.
    """
    end, rest = clock(segment.stamp, segment.rest, segment.duration)
    terminal = segment.ends == Switch.FALL or segment.ends == Switch.FLY_OFF
    due = end + 1 if terminal else end
    trailing = 1 - segment.leading
    if segment.stance == Stance.DOUBLE:
        ahead = skip_changes(robot, cursors, trailing, segment.after)
        index = cursors[trailing]
        if ahead and robot.changes[index] < due:
            stamp = robot.changes[index]
            if stamp >= until:
                return HELD
            elapsed = (stamp - segment.stamp) / NANO - segment.rest
            position = position_at(model, work, segment, elapsed)
            segment.stamp, segment.rest, segment.after = stamp, 0.0, stamp
            change_torque(model, segment, position, robot.torques[index], work)
            return SWITCHED
    if due > until:
        return HELD
    if terminal:
        return ENDED
    segment.stamp, segment.rest = end, rest
    segment.after = max(segment.after, end - 1)
    if segment.ends == Switch.HEEL_STRIKE:
        # The stance leg now trails; its torque is the one in force before this stamp.
        skip_changes(robot, cursors, segment.leading, segment.after)
        collide(model, segment, robot.torques[cursors[segment.leading] - 1], work)
    elif segment.ends == Switch.TOE_OFF:
        leave_double_stance(model, segment, work)
    else:
        unload(model, segment, work)
    return SWITCHED


@compiled
def stiffen(model: Model, step: int, stiffness: Floats) -> None:
    """Write the stiffness of a step's push-off into the model, if stiffnesses are given."""
    if stiffness.size > 0:
        model.ankle_stiffness = stiffness[step % stiffness.size]


@compiled
def advance(
    model: Model, log: Log, count: int, robot: Torques, until: int, stiffness: Floats
) -> tuple[int, int]:
    """
    Append to the `count` segments of `log` all that begin by `until`.

    Each push-off has the `stiffness` (n,) of its step, if n > 0.

    Returns the new count and HELD, ENDED, or SWITCHED if the log is full.
    """
    work, cursors = np.empty(WORK_SIZE), np.array([0, robot.right])
    while count < log.size:
        log[count] = log[count - 1]
        # After single stance comes the push-off of the next step.
        stiffen(model, log[count].step + (log[count].stance == Stance.SINGLE), stiffness)
        outcome = proceed(model, work, log[count], robot, cursors, until)
        if outcome != SWITCHED:
            return count, outcome
        count += 1
    return count, SWITCHED


@compiled
def start_walking(model: Model, segment: Segment, leading: int, apex: float) -> None:
    """Write the first segment: right after heel strike 0 of `leading`."""
    segment.stamp, segment.rest, segment.after = 0, 0.0, -1
    segment.began, segment.leading, segment.step = Switch.HEEL_STRIKE, leading, 1
    segment.apex = apex
    enter_double_stance(model, segment, 0.0, np.empty(WORK_SIZE))
