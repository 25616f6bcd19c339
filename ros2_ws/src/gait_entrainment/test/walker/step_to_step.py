# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The step-to-step function, by the walker's own transitions, at exact times."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model, make_model
from gait_entrainment.walker.segment import SEGMENT, WORK_SIZE, Log, Segment, Stance, Switch
from gait_entrainment.walker.trajectory import start_walking
from gait_entrainment.walker.transitions import (
    change_torque,
    collide,
    enter_double_stance,
    leave_double_stance,
    unload,
)


class Step(NamedTuple):
    """Result of the step-to-step function; NaN if the walker falls or flies off."""

    speed: Floats
    """Speed of the mass right after the next heel strike [m/s]."""
    duration: Floats
    """Time to that heel strike [s]."""


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
    work = np.empty(WORK_SIZE)
    segment = log[0]
    for i in range(rows.shape[1]):
        rate = rows[0, i] / model.leg_length
        start_walking(model, segment, 1, rate * rate - model.start_gain)
        onset, torque = rows[1, i], rows[3, i]
        duration = one_step(model, work, segment, onset, onset + rows[2, i], torque)
        square = segment.apex + model.start_gain
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
    while segment.stance == Stance.DOUBLE:
        edge = onset if onset > elapsed else end
        if elapsed < edge < elapsed + segment.duration:
            position = position_at(model, work, segment, edge - elapsed)
            elapsed = edge
            change_torque(model, segment, position, torque if edge == onset else 0.0, work)
            continue
        elapsed += segment.duration
        if segment.ends == Switch.TOE_OFF:
            leave_double_stance(model, segment, work)
        elif segment.ends == Switch.UNLOADING:
            unload(model, segment, work)
        else:
            return np.nan
    elapsed += segment.duration
    if segment.ends != Switch.HEEL_STRIKE:
        return np.nan
    collide(model, segment, 0.0, work)
    return elapsed
