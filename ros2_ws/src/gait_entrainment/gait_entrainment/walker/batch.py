# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Whole walks in one compiled call: the transitions that `Walker` runs, to the same bits."""

from typing import NamedTuple

import numpy as np

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import Floats, Model, Stamps, make_model, start_apex
from gait_entrainment.walker.promise import EVER
from gait_entrainment.walker.segment import SEGMENT, WORK_SIZE, Log, Switch
from gait_entrainment.walker.trajectory import SWITCHED, Torques, proceed, start_walking
from gait_entrainment.walker.transitions import seconds

FOREVER = 2**62


class Pulses(NamedTuple):
    """Square pulses on one ankle, not overlapping: onsets [ns], width [ns], torque [N m]."""

    onsets: Stamps
    width: int
    torque: float


class Walk(NamedTuple):
    """Events [s] of a walk: heel strikes from number 0 on, and the toe-off after each."""

    heel_strikes: Floats
    toe_offs: Floats


def walk(
    parameters: WalkerParameters,
    steps: int,
    pulses: Pulses | None = None,
    initial_speed: float | None = None,
) -> Walk:
    """
    Walk `steps` steps from heel strike 0 of the leg whose ankle the pulses perturb.

    The walk starts as a `Walker` does. If it falls or flies off, its events end there.
    """
    heel_strikes, toe_offs = np.empty(steps), np.empty(steps)
    model = make_model(parameters)
    changes, torques = _torque_changes(pulses)
    strikes, offs = walk_steps(
        model,
        np.zeros(1, SEGMENT),
        changes,
        torques,
        start_apex(model, initial_speed),
        heel_strikes,
        toe_offs,
    )
    return Walk(np.concatenate([[0.0], heel_strikes[:strikes]]), toe_offs[:offs])


def _torque_changes(pulses: Pulses | None) -> tuple[Stamps, Floats]:
    """Changes of both sides as `trajectory` wants them, the left one first and never perturbed."""
    left = np.array([EVER]), np.zeros(1)
    if pulses is None:
        return np.concatenate([left[0], left[0]]), np.zeros(2)
    onsets = np.asarray(pulses.onsets, np.int64)
    if pulses.width <= 0 or np.any(np.diff(onsets) < pulses.width):
        raise ValueError(f"pulses of {pulses.width} ns must be wider than 0 and not overlap")
    changes = np.append(EVER, np.stack([onsets, onsets + pulses.width], axis=1))
    torques = np.append(0.0, np.tile([pulses.torque, 0.0], onsets.size))
    # Of two changes of one stamp the later counts, and one that changes nothing is no switch.
    last = np.append(np.diff(changes) != 0, True)
    changes, torques = changes[last], torques[last]
    real = np.append(True, np.diff(torques) != 0.0)
    return np.append(left[0], changes[real]), np.append(left[1], torques[real])


@compiled
def walk_steps(
    model: Model,
    log: Log,
    changes: Stamps,
    torques: Floats,
    apex: float,
    heel_strikes: Floats,
    toe_offs: Floats,
) -> tuple[int, int]:
    """Fill in the events [s] after heel strike 0, until one array is full; returns how many."""
    segment, robot = log[0], Torques(changes, torques, 1)
    work, cursors = np.empty(WORK_SIZE), np.array([0, 1])
    start_walking(model, segment, 1, apex)
    strikes, offs = 0, 0
    while strikes < heel_strikes.size:
        if proceed(model, work, segment, robot, cursors, FOREVER) != SWITCHED:
            break
        if segment.began == Switch.HEEL_STRIKE:
            heel_strikes[strikes] = seconds(segment.stamp, segment.rest)
            strikes += 1
        elif segment.began == Switch.TOE_OFF:
            toe_offs[offs] = seconds(segment.stamp, segment.rest)
            offs += 1
    return strikes, offs
