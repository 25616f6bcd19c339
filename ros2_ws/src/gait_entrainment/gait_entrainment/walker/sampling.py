# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Posture, torques and ground reaction forces at any times of a trajectory.

Each sample is computed from the start of its segment, never from the previous sample, so the same
time gives the same bits whichever other times are sampled.

The massless swing leg has no dynamics. For display its hip and ankle follow a cubic in the
progress of single stance, u = (theta_toe_off - theta) / (theta_toe_off + alpha). It starts with
the posture and rates of toe-off and ends with the posture of the next heel strike, hip and ankle
at alpha, at zero rate.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.walker import linkage
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.location import position_at
from gait_entrainment.walker.model import Floats, Model, Stamps
from gait_entrainment.walker.segment import (
    WORK_SIZE,
    Log,
    Segment,
    Stance,
    effective_torque,
    leading_force,
    leg_sine_at,
    squared_rate,
)
from gait_entrainment.walker.trajectory import Torques, stiffen
from gait_entrainment.walker.transitions import NANO

# Indices in an array of joints: hip or ankle, plus the side.
HIP: Final = 0
ANKLE: Final = 2


@dataclass(frozen=True)
class Samples:
    """
    The walker at n times, in SI units; joints in the order l_hip, r_hip, l_ankle, r_ankle.

    Hip: angle of the leg from the vertical, positive with the foot ahead of the mass. Ankle:
    psi - pi/2, plantarflexion positive. Pairs are [left, right]; world x forward, z up.
    """

    position: Floats  # (n, 4) joint angles [rad]
    velocity: Floats  # (n, 4) joint velocities [rad/s]
    effort: Floats  # (n, 4) joint torques [N m]: hips zero, ankles intrinsic plus effective
    intrinsic_torque: Floats  # (n, 2) of the ankle spring [N m]: k (mu - psi) if trailing, else 0
    delivered_torque: Floats  # (n, 2) by the ankle robot [N m], whether it acts or not
    effective_torque: Floats  # (n, 2) the part of it that acts [N m]
    ground_reaction: Floats  # (n, 2, 2) on each leg, [left, right] x [x, z] [N]
    force: Floats  # (n, 2) its magnitude: F_A of the trailing leg, F_B of the other [N]
    double_stance: NDArray[np.bool_]  # (n,) whether both feet are on the ground
    leading: NDArray[np.int64]  # (n,) side of the leading leg, in single stance the stance leg
    unloaded: NDArray[np.bool_]  # (n,) whether a negative pulse keeps the trailing foot unloaded


# One sample: the fields of Samples that the compiled functions fill in.
SAMPLE = np.dtype(
    [
        ("position", np.float64, (4,)),
        ("velocity", np.float64, (4,)),
        ("intrinsic_torque", np.float64, (2,)),
        ("delivered_torque", np.float64, (2,)),
        ("effective_torque", np.float64, (2,)),
        ("ground_reaction", np.float64, (2, 2)),
        ("force", np.float64, (2,)),
        ("double_stance", np.bool_),
        ("leading", np.int64),
        ("unloaded", np.bool_),
    ]
)


def samples_from(table: Any) -> Samples:
    """Return samples from a filled array of SAMPLE."""
    columns = {name: np.ascontiguousarray(table[name]) for name in SAMPLE.names or ()}
    effort = np.zeros((table.size, 4))
    effort[:, ANKLE:] = columns["intrinsic_torque"] + columns["effective_torque"]
    return Samples(effort=effort, **columns)


@compiled
def fill_samples(
    model: Model, log: Log, times: Stamps, robot: Torques, stiffness: Floats, table: Any
) -> None:
    """Fill `table` (n,) of SAMPLE, initially zero, with the walker's state at `times` [ns]."""
    work = np.empty(WORK_SIZE)
    rows = np.searchsorted(log["after"], times)
    right = robot.right
    left_changes = np.searchsorted(robot.changes[:right], times)
    right_changes = np.searchsorted(robot.changes[right:], times)
    for i in range(times.size):
        row = table[i]
        row.delivered_torque[0] = robot.torques[left_changes[i] - 1]
        row.delivered_torque[1] = robot.torques[right + right_changes[i] - 1]
        segment = log[rows[i] - 1]
        elapsed = (times[i] - segment.stamp) / NANO - segment.rest
        position = position_at(model, work, segment, elapsed)
        row.double_stance = segment.stance == Stance.DOUBLE
        row.leading = segment.leading
        if segment.stance == Stance.DOUBLE:
            stiffen(model, segment.step, stiffness)
            fill_double_stance(model, segment, position, row)
        else:
            fill_single_stance(model, segment, position, row)


@compiled
def fill_leading_leg(
    model: Model, segment: Segment, position: float, sine: float, rate: float, row: Any
) -> None:
    """Leading leg, foot flat: hip and ankle turn together, and the force is along the leg."""
    leading = segment.leading
    lean = math.asin(sine)
    force = leading_force(model, segment, position)
    row.position[HIP + leading], row.position[ANKLE + leading] = lean, lean
    row.velocity[HIP + leading], row.velocity[ANKLE + leading] = rate, rate
    row.force[leading] = force
    row.ground_reaction[leading, 0] = -force * sine
    row.ground_reaction[leading, 1] = force * math.sqrt(1.0 - sine * sine)


@compiled
def fill_double_stance(model: Model, segment: Segment, position: float, row: Any) -> None:
    """Both legs on the ground, the linkage closed."""
    trailing = 1 - segment.leading
    sine = leg_sine_at(model, segment.stance, position)
    cosine = math.sqrt(1.0 - sine * sine)
    sin_ankle = math.sin(position)
    slope = linkage.leg_per_ankle(model, sin_ankle, cosine)
    reach = linkage.trailing_reach(model, math.cos(position))
    rate = math.sqrt(max(0.0, squared_rate(model, segment, position)))
    velocity = rate / slope
    fill_leading_leg(model, segment, position, sine, -rate, row)

    hip_per_ankle = linkage.trailing_leg_per_ankle(model, position, sine, slope, reach)
    row.position[HIP + trailing] = linkage.trailing_leg_angle(model, position, sine)
    row.velocity[HIP + trailing] = velocity * hip_per_ankle
    row.position[ANKLE + trailing] = position - 0.5 * math.pi
    row.velocity[ANKLE + trailing] = velocity

    torque = max(0.0, effective_torque(segment, position))
    intrinsic = linkage.spring_torque(model, position)
    row.intrinsic_torque[trailing] = intrinsic
    row.unloaded = segment.stiffness == 0.0
    row.effective_torque[trailing] = -intrinsic if row.unloaded else segment.perturbation
    force = linkage.trailing_force(model, torque, sin_ankle, reach)
    row.force[trailing] = force
    ahead = model.toe_separation - model.leg_length * sine
    row.ground_reaction[trailing, 0] = force * ahead / reach
    row.ground_reaction[trailing, 1] = force * model.leg_length * cosine / reach


@compiled
def fill_single_stance(model: Model, segment: Segment, position: float, row: Any) -> None:
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
    row.position[HIP + swing], row.velocity[HIP + swing] = angle, slope * pace
    angle, slope = swing_path(
        progress,
        model.max_plantarflexion - 0.5 * math.pi,
        model.swing_ankle_slope,
        model.strike_position,
    )
    row.position[ANKLE + swing], row.velocity[ANKLE + swing] = angle, slope * pace


@compiled
def swing_path(u: float, start: float, slope: float, end: float) -> tuple[float, float]:
    """Value and derivative at u of the cubic from (start, slope) at 0 to (end, 0) at 1."""
    rise = end - start
    c2 = 3.0 * rise - 2.0 * slope
    c3 = slope - 2.0 * rise
    value = start + u * (slope + u * (c2 + u * c3))
    return value, slope + u * (2.0 * c2 + 3.0 * u * c3)
