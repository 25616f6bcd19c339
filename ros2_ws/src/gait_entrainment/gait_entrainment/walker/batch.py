# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Many strides at once: whole walks in one compiled call, and the step-to-step function.

Both run the very transitions that `Walker` runs, without its log; a walk gives the same bits.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model, make_model, start_apex
from gait_entrainment.walker.promise import EVER
from gait_entrainment.walker.segment import (
    DOUBLE_STANCE,
    HEEL_STRIKE,
    SEGMENT,
    TOE_OFF,
    UNLOADING,
    WORK_SHAPE,
    Log,
    Segment,
)
from gait_entrainment.walker.trajectory import (
    SWITCHED,
    Stamps,
    first_cursors,
    proceed,
    start_walking,
)
from gait_entrainment.walker.transitions import (
    change_torque,
    collide,
    enter_double_stance,
    leave_double_stance,
    seconds,
    unload,
)

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

    The walk starts as a `Walker` does. Where it falls or flies off, its events end there.
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
    segment = log[0]
    work, cursors = np.empty(WORK_SHAPE), first_cursors(1)
    start_walking(model, segment, 1, apex)
    strikes, offs = 0, 0
    while strikes < heel_strikes.size:
        outcome = proceed(model, work, segment, changes, torques, 1, cursors, FOREVER)
        if outcome != SWITCHED:
            break
        if segment.began == HEEL_STRIKE:
            heel_strikes[strikes] = seconds(segment.stamp, segment.rest)
            strikes += 1
        elif segment.began == TOE_OFF:
            toe_offs[offs] = seconds(segment.stamp, segment.rest)
            offs += 1
    return strikes, offs


class Step(NamedTuple):
    """What the step-to-step function gives; NaN where the walker falls or flies off."""

    speed: Floats
    """Speed of the mass right after the next heel strike [m/s]."""
    duration: Floats
    """Time to it [s]."""


def step_to_step(
    parameters: WalkerParameters,
    speed: ArrayLike,
    onset: ArrayLike = 0.0,
    width: ArrayLike = 0.0,
    torque: ArrayLike = 0.0,
) -> Step:
    """
    Return the Poincare map from heel strike to heel strike, smooth in all its arguments.

    The mass has `speed` [m/s] right after a heel strike; the ankle that then trails gets a pulse
    of `torque` [N m] and `width` [s] at `onset` [s] after the strike, before it if negative. The
    arguments are broadcast. Times are not rounded to nanoseconds.
    """
    arrays = np.broadcast_arrays(speed, onset, width, torque)
    rows = np.ascontiguousarray([np.ravel(a) for a in arrays], np.float64)
    result = np.empty((2, rows.shape[1]))
    map_steps(make_model(parameters), np.zeros(1, SEGMENT), rows, result)
    shape = arrays[0].shape
    return Step(result[0].reshape(shape), result[1].reshape(shape))


@compiled
def map_steps(model: Model, log: Log, rows: Floats, result: Floats) -> None:
    """Map each column (speed, onset, width, torque) of `rows` to one (speed, duration)."""
    work = np.empty(WORK_SHAPE)
    segment = log[0]
    for i in range(rows.shape[1]):
        rate = rows[0, i] / model.leg_length
        start_walking(model, segment, 1, rate * rate - model.strike_gain)
        onset, torque = rows[1, i], rows[3, i]
        duration = one_step(model, work, segment, onset, onset + rows[2, i], torque)
        square = segment.apex + model.strike_gain
        result[0, i] = model.leg_length * np.sqrt(square) if duration > 0.0 else np.nan
        result[1, i] = duration


@compiled
def one_step(
    model: Model, work: Floats, segment: Segment, onset: float, end: float, torque: float
) -> float:
    """Walk to the next heel strike with a pulse from `onset` to `end` [s]; NaN on a fall."""
    elapsed = 0.0
    if onset <= 0.0 < end:
        enter_double_stance(model, segment, torque, work)
    while segment.phase == DOUBLE_STANCE:
        edge = onset if onset > elapsed else end
        if elapsed < edge < elapsed + segment.duration:
            position = position_at(model, work, segment, edge - elapsed)
            elapsed = edge
            change_torque(model, segment, position, torque if edge == onset else 0.0, work)
            continue
        elapsed += segment.duration
        if segment.ends == TOE_OFF:
            leave_double_stance(model, segment, work)
        elif segment.ends == UNLOADING:
            unload(model, segment, work)
        else:
            return np.nan
    elapsed += segment.duration
    if segment.ends != HEEL_STRIKE:
        return np.nan
    collide(model, segment, 0.0, work)
    return elapsed
