# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Posture, torques and ground reaction forces at any instants of a trajectory.

Each sample follows from the start of its segment alone, never from the sample before, so the same
instant gives the same bits however the instants are asked for.

The massless swing leg has no dynamics. For display its hip and ankle follow a cubic in the
progress of single stance, u = (theta_toe_off - theta) / (theta_toe_off + alpha), that leaves the
posture of toe-off with its rates and arrives at the posture of the next heel strike, hip and ankle
at alpha, with rate zero.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.linkage import (
    leg_per_ankle,
    trailing_force,
    trailing_leg_angle,
    trailing_leg_per_ankle,
    trailing_reach,
)
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model
from gait_entrainment.walker.segment import (
    DOUBLE_STANCE,
    WORK_SHAPE,
    Log,
    Segment,
    effective_torque,
    leading_force,
    leg_sine_at,
    squared_rate,
)
from gait_entrainment.walker.trajectory import Stamps
from gait_entrainment.walker.transitions import NANO

# Rows of the table that `fill_samples` writes; each pair is left, right.
HIP: Final = 0
ANKLE: Final = 2
HIP_RATE: Final = 4
ANKLE_RATE: Final = 6
INTRINSIC: Final = 8
DELIVERED: Final = 10
EFFECTIVE: Final = 12
FORCE: Final = 14
FORCE_X: Final = 16
FORCE_Z: Final = 18
PHASE: Final = 20
LEADING: Final = 21
UNLOADED: Final = 22
ROWS: Final = 23


@dataclass(frozen=True)
class Samples:
    """
    The walker at n instants. SI units; joints in the order l_hip r_hip l_ankle r_ankle.

    Hip: angle of the leg from the vertical, foot ahead of the mass positive. Ankle: psi - pi/2,
    plantarflexion positive. Pairs are [left, right]; world x forward, z up.
    """

    position: Floats
    """(n, 4) joint angles [rad]."""
    velocity: Floats
    """(n, 4) joint velocities [rad/s]."""
    effort: Floats
    """(n, 4) joint torques [N m]: hips zero, ankles the effective plantarflexion torque."""
    intrinsic_torque: Floats
    """(n, 2) torque of the ankle spring [N m]: k (mu - psi) while that leg trails, else 0."""
    delivered_torque: Floats
    """(n, 2) torque that the ankle robot delivers [N m], whether it acts or not."""
    effective_torque: Floats
    """(n, 2) part of it that acts [N m]: ankle effort less intrinsic torque."""
    ground_reaction: Floats
    """(n, 2, 2) ground reaction on each leg, [left, right] x [x, z] [N]."""
    force: Floats
    """(n, 2) its magnitude: F_A of the trailing, F_B of the leading or stance leg [N]."""
    double_stance: NDArray[np.bool_]
    """(n,) whether both feet are on the ground."""
    leading: NDArray[np.int64]
    """(n,) side of the leading leg, in single stance the stance leg."""
    unloaded: NDArray[np.bool_]
    """(n,) whether a negative pulse keeps the trailing foot unloaded in double stance."""


def samples_from_table(table: Floats) -> Samples:
    """Name the rows of a table that `fill_samples` wrote."""

    def columns(row: int, width: int = 2) -> Floats:
        return np.ascontiguousarray(table[row : row + width].T)

    effort = np.zeros((table.shape[1], 4))
    effort[:, 2:] = columns(INTRINSIC) + columns(EFFECTIVE)
    return Samples(
        position=columns(HIP, 4),
        velocity=columns(HIP_RATE, 4),
        effort=effort,
        intrinsic_torque=columns(INTRINSIC),
        delivered_torque=columns(DELIVERED),
        effective_torque=columns(EFFECTIVE),
        ground_reaction=np.stack([columns(FORCE_X), columns(FORCE_Z)], axis=-1),
        force=columns(FORCE),
        double_stance=table[PHASE] == DOUBLE_STANCE,
        leading=table[LEADING].astype(np.int64),
        unloaded=table[UNLOADED] != 0.0,
    )


@compiled
def fill_samples(
    model: Model,
    log: Log,
    times: Stamps,
    changes: Stamps,
    torques: Floats,
    right: int,
    table: Floats,
) -> None:
    """Fill the columns of `table` (ROWS, n), zero before, with the walker at `times` [ns]."""
    work = np.empty(WORK_SHAPE)
    after = log["after"]
    rows = np.searchsorted(after, times)
    for i, change in enumerate(np.searchsorted(changes[:right], times)):
        table[DELIVERED, i] = torques[change - 1]
    for i, change in enumerate(np.searchsorted(changes[right:], times)):
        table[DELIVERED + 1, i] = torques[right + change - 1]
    for i in range(times.size):
        segment = log[rows[i] - 1]
        elapsed = (times[i] - segment.stamp) / NANO - segment.rest
        position = position_at(model, work, segment, elapsed)
        table[PHASE, i] = segment.phase
        table[LEADING, i] = segment.leading
        if segment.phase == DOUBLE_STANCE:
            fill_double_stance(model, segment, position, table[:, i])
        else:
            fill_single_stance(model, segment, position, table[:, i])


@compiled
def fill_leading_leg(
    model: Model, segment: Segment, position: float, sine: float, rate: float, row: Floats
) -> None:
    """Leading leg, its foot flat: hip and ankle turn together; the force is along the leg."""
    leading = segment.leading
    lean = math.asin(sine)
    force = leading_force(model, segment, position)
    row[HIP + leading], row[ANKLE + leading] = lean, lean
    row[HIP_RATE + leading], row[ANKLE_RATE + leading] = rate, rate
    row[FORCE + leading] = force
    row[FORCE_X + leading] = -force * sine
    row[FORCE_Z + leading] = force * math.sqrt(1.0 - sine * sine)


@compiled
def fill_double_stance(model: Model, segment: Segment, position: float, row: Floats) -> None:
    """Both legs on the ground, the linkage closed."""
    trailing = 1 - segment.leading
    sine = leg_sine_at(model, segment.phase, position)
    cosine = math.sqrt(1.0 - sine * sine)
    sin_ankle = math.sin(position)
    slope = leg_per_ankle(sin_ankle, cosine, model.foot_length, model.separation)
    reach = trailing_reach(math.cos(position), model.leg_length, model.foot_length)
    rate = math.sqrt(max(0.0, squared_rate(model, segment, position)))
    velocity = rate / slope
    fill_leading_leg(model, segment, position, sine, -rate, row)

    row[HIP + trailing] = trailing_leg_angle(
        position, sine, model.leg_length, model.foot_length, model.separation
    )
    row[HIP_RATE + trailing] = velocity * trailing_leg_per_ankle(
        position, sine, slope, reach, model.leg_length, model.foot_length, model.separation
    )
    row[ANKLE + trailing] = position - 0.5 * math.pi
    row[ANKLE_RATE + trailing] = velocity

    torque = max(0.0, effective_torque(segment, position))
    intrinsic = model.stiffness * (model.max_plantarflexion - position)
    row[INTRINSIC + trailing] = intrinsic
    if segment.stiffness > 0.0:
        row[EFFECTIVE + trailing] = segment.perturbation
    else:
        row[EFFECTIVE + trailing] = -intrinsic
        row[UNLOADED] = 1.0
    force = trailing_force(torque, sin_ankle, reach, model.leg_length, model.foot_length)
    row[FORCE + trailing] = force
    row[FORCE_X + trailing] = force * (model.separation - model.leg_length * sine) / reach
    row[FORCE_Z + trailing] = force * model.leg_length * cosine / reach


@compiled
def fill_single_stance(model: Model, segment: Segment, position: float, row: Floats) -> None:
    """Stance leg as an inverted pendulum, swing leg on its path for display."""
    swing = 1 - segment.leading
    rate = math.sqrt(max(0.0, squared_rate(model, segment, position)))
    fill_leading_leg(model, segment, position, math.sin(-position), -rate, row)

    span = model.strike_position - model.toe_off_position
    progress = (position - model.toe_off_position) / span
    pace = rate / span
    angle, slope = swing_path(
        progress, model.swing_hip, model.swing_hip_slope, model.strike_position
    )
    row[HIP + swing], row[HIP_RATE + swing] = angle, slope * pace
    angle, slope = swing_path(
        progress,
        model.max_plantarflexion - 0.5 * math.pi,
        model.swing_ankle_slope,
        model.strike_position,
    )
    row[ANKLE + swing], row[ANKLE_RATE + swing] = angle, slope * pace


@compiled
def swing_path(u: float, start: float, slope: float, end: float) -> tuple[float, float]:
    """Value and derivative at u of the cubic from (start, slope) at 0 to (end, 0) at 1."""
    rise = end - start
    c2 = 3.0 * rise - 2.0 * slope
    c3 = slope - 2.0 * rise
    value = start + u * (slope + u * (c2 + u * c3))
    return value, slope + u * (2.0 * c2 + 3.0 * u * c3)
