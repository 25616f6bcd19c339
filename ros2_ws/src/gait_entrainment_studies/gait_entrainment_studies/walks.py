# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Whole walks in one compiled call: the transitions that `Walker` runs, without its log.

A walk equals that of a `Walker`, bit for bit. In addition, its push-offs may differ in stiffness.
"""

from typing import NamedTuple

import numpy as np

from gait_entrainment.walker import EndingKind
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import Floats, Model, Stamps, start_apex
from gait_entrainment.walker.promise import EVER
from gait_entrainment.walker.segment import SEGMENT, WORK_SIZE, Log, Stance, Switch
from gait_entrainment.walker.trajectory import SWITCHED, Torques, proceed, start_walking
from gait_entrainment.walker.transitions import seconds

FOREVER = 2**62


class Pulses(NamedTuple):
    """Square pulses on one ankle, not overlapping: onsets [ns], width [ns], torque [N m]."""

    onsets: Stamps
    width: int
    torque: float


NO_PULSES = Pulses(np.empty(0, np.int64), 1, 0.0)


class Walk(NamedTuple):
    """Events [s] of a walk: heel strikes from number 0 on, and the toe-off after each."""

    heel_strikes: Floats
    toe_offs: Floats
    ending: EndingKind | None
    """How it ended before its last step, if it did."""


def walk(
    model: Model,
    steps: int,
    pulses: Pulses = NO_PULSES,
    initial_apex: float | None = None,
    stiffness: Floats | None = None,
) -> Walk:
    """
    Walk `steps` steps from heel strike 0 of the leg whose ankle the pulses perturb.

    The walk starts as a `Walker` does, unless `initial_apex` (see `model`) is given. `stiffness`
    (steps,) is that of each push-off [N m/rad]; it is written into the model, which must be made
    for that (see `cohort.population`). Raises ValueError for overlapping pulses.
    """
    heel_strikes, toe_offs = np.empty(steps), np.empty(steps)
    log = np.zeros(1, SEGMENT)
    strikes, offs = walk_steps(
        model,
        log,
        *_torque_changes(pulses),
        start_apex(model, None) if initial_apex is None else initial_apex,
        np.empty(0) if stiffness is None else stiffness,
        heel_strikes,
        toe_offs,
    )
    ending = None
    if strikes < steps:
        ending = EndingKind.FALL if log[0]["ends"] == Switch.FALL else EndingKind.FLY_OFF
    return Walk(np.append(0.0, heel_strikes[:strikes]), toe_offs[:offs], ending)


def _torque_changes(pulses: Pulses) -> tuple[Stamps, Floats]:
    """Return the changes of both sides for `trajectory`; the first, left one is not perturbed."""
    onsets = np.asarray(pulses.onsets, np.int64)
    if pulses.width <= 0 or np.any(np.diff(onsets) < pulses.width):
        raise ValueError(f"pulses of {pulses.width} ns must be wider than 0 and not overlap")
    changes = np.append(EVER, np.stack([onsets, onsets + pulses.width], axis=1))
    torques = np.append(0.0, np.tile([pulses.torque, 0.0], onsets.size))
    # Of two changes with one stamp the later counts; one that changes nothing is not a switch.
    last = np.append(np.diff(changes) != 0, True)
    changes, torques = changes[last], torques[last]
    real = np.append(True, np.diff(torques) != 0.0)
    return np.append(EVER, changes[real]), np.append(0.0, torques[real])


@compiled
def walk_steps(
    model: Model,
    log: Log,
    changes: Stamps,
    torques: Floats,
    apex: float,
    stiffness: Floats,
    heel_strikes: Floats,
    toe_offs: Floats,
) -> tuple[int, int]:
    """Fill in the events [s] after heel strike 0 until `heel_strikes` is full; return how many."""
    segment, robot = log[0], Torques(changes, torques, 1)
    work, cursors = np.empty(WORK_SIZE), np.array([0, 1])
    strikes, offs = 0, 0
    if stiffness.size > 0:
        model.ankle_stiffness = stiffness[0]
    start_walking(model, segment, 1, apex)
    while strikes < heel_strikes.size:
        if segment.stance == Stance.SINGLE and strikes + 1 < stiffness.size:
            model.ankle_stiffness = stiffness[strikes + 1]  # of the next push-off
        if proceed(model, work, segment, robot, cursors, FOREVER) != SWITCHED:
            break
        if segment.began == Switch.HEEL_STRIKE:
            heel_strikes[strikes] = seconds(segment.stamp, segment.rest)
            strikes += 1
        elif segment.began == Switch.TOE_OFF:
            toe_offs[offs] = seconds(segment.stamp, segment.rest)
            offs += 1
    return strikes, offs
