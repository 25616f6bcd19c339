# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A segment: the walker's motion between two switches, and the time that it takes.

Gait events, changes of the perturbation and the unloading of the trailing foot are switches.
Between them the ankle torque falls off linearly in the ankle angle, so energy gives the speed at
every position in closed form, and time is a quadrature over position. A segment is stored as the
state at its start, with the switch that would end it if the perturbation did not change.

Position is the coordinate that grows as the walker moves forward: the trailing ankle's angle psi
in double stance, -theta in single stance.
"""

import math
from enum import IntEnum
from typing import Any, Final, Protocol

import numpy as np

from gait_entrainment.walker import linkage
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import (
    NODES,
    PANEL_NODES,
    SINGLE_STANCE_NODES,
    TAIL_TOLERANCE,
    TAILS,
    WEIGHTS,
    Floats,
    Model,
)


class Stance(IntEnum):
    """What the walker stands on: both feet, or one."""

    DOUBLE = 0
    SINGLE = 1


class Switch(IntEnum):
    """What ends a segment and begins the next one; the last two end the walk."""

    HEEL_STRIKE = 0
    TOE_OFF = 1
    TORQUE_CHANGE = 2
    UNLOADING = 3
    FALL = 4
    FLY_OFF = 5


class Segment(Protocol):
    """A record of SEGMENT, which the compiled functions change in place."""

    stamp: int  # start, whole nanoseconds since the start of the run
    rest: float  # and the remainder [s], at most half a nanosecond
    after: int  # torque changes later than this stamp are still to come
    began: int  # the switch that began it
    ends: int  # the switch that ends it if the perturbation stays as it is
    stance: int
    leading: int  # side of the leading leg, in single stance the stance leg
    step: int  # number of the step in progress
    position: float
    apex: float  # squared rate at the apex without further torque [1/s^2] (see `model`)
    perturbation: float  # torque of the ankle robot on the trailing ankle [N m]
    torque: float  # effective ankle torque at the start [N m]
    stiffness: float  # and the rate at which it falls off [N m/rad]
    end: float  # position of the end
    duration: float  # time to the end [s]
    shortfall: float  # what is missing at a fall [J] or fly-off [N]


SEGMENT = np.dtype([(name, kind) for name, kind in Segment.__annotations__.items()])
Log = Any  # an array of SEGMENT, the segments of a stretch in order
Motion = tuple[float, float, float]  # value, velocity and acceleration of a coordinate

# Widest panel [rad]: keeps the Taylor series in `panel` accurate to rounding.
PANEL_WIDTH: Final = 1.6

# A panel this narrow [rad, or its square root before a stall] is accepted as it is.
NARROWEST_PANEL: Final = 1e-12

# Up to this width [rad], a panel over which the squared rate changes by less than this fraction is
# smooth: the nearest stall is many widths away. If it does not converge, rounding is the cause.
SMOOTH_PANEL: Final = 1e-3
SMOOTH_CHANGE: Final = 0.1

# Longest time that a segment may take [s]: a tangential stall is approached indefinitely.
LONGEST: Final = 1e6

# Size of the work space in which quadratures store the integrand at the nodes.
WORK_SIZE: Final = max(PANEL_NODES, SINGLE_STANCE_NODES)


@compiled
def effective_torque(segment: Segment, position: float) -> float:
    """Ankle torque [N m] at a position of the segment; zero in single stance."""
    return segment.torque - segment.stiffness * (position - segment.position)


@compiled
def gained_apex(model: Model, segment: Segment, position: float) -> float:
    """`apex` at a position of the segment: its value at the start plus the torque's work."""
    rotation = position - segment.position
    work = linkage.torque_work(rotation, segment.torque, segment.stiffness)
    return segment.apex + model.per_energy * work


@compiled
def leg_sine_at(model: Model, stance: int, position: float) -> float:
    """sin(theta) of the leading leg."""
    if stance == Stance.SINGLE:
        return -math.sin(position)
    return linkage.leg_sine(model, math.cos(position))


@compiled
def leaned(model: Model, sine: float, cosine: float) -> tuple[float, float]:
    """Sine and cosine of an angle from the vertical, given those from the ground's normal."""
    up, along = model.slope_cosine, model.slope_sine
    return sine * up + cosine * along, cosine * up - sine * along


@compiled
def lean_at(model: Model, stance: int, position: float) -> tuple[float, float]:
    """Sine and cosine of the leading leg's angle from the vertical."""
    sine = leg_sine_at(model, stance, position)
    cosine = math.sqrt(1.0 - sine * sine)
    if stance == Stance.SINGLE:
        return sine, cosine
    return leaned(model, sine, cosine)


@compiled
def squared_rate(model: Model, segment: Segment, position: float) -> float:
    """theta_dot^2 at a position of the segment, from energy; negative beyond a stall."""
    fall = linkage.drop(*lean_at(model, segment.stance, position))
    return gained_apex(model, segment, position) + model.per_drop * fall


@compiled
def leading_force(model: Model, segment: Segment, position: float) -> float:
    """Ground reaction F_B [N] of the leading leg, along the leg; negative if it would pull."""
    square = squared_rate(model, segment, position)
    force = linkage.pendulum_force(model, lean_at(model, segment.stance, position)[1], square)
    if segment.stance == Stance.DOUBLE:
        sine = leg_sine_at(model, segment.stance, position)
        arm = linkage.unloading_arm(model, math.sin(position), sine)
        force -= arm * effective_torque(segment, position)
    return force


@compiled
def motion(model: Model, segment: Segment, position: float) -> Motion:
    """
    Motion of a coordinate that is smooth in time.

    In single stance it is the position; in double stance sin(theta), since psi itself speeds up
    twentyfold. theta_ddot is half the derivative of theta_dot^2 with respect to theta.
    """
    if segment.stance == Stance.SINGLE:
        rate = math.sqrt(max(0.0, squared_rate(model, segment, position)))
        return position, rate, 0.5 * model.per_drop * math.sin(position)
    cos_ankle = math.cos(position)
    sine = linkage.leg_sine(model, cos_ankle)
    cosine = math.sqrt(1.0 - sine * sine)
    sin_ankle = math.sqrt(1.0 - cos_ankle * cos_ankle)
    slope = linkage.leg_per_ankle(model, sin_ankle, cosine)
    square = max(0.0, squared_rate(model, segment, position))
    push = model.per_energy * effective_torque(segment, position) / slope
    acceleration = 0.5 * (model.per_drop * leaned(model, sine, cosine)[0] - push)
    return sine, -cosine * math.sqrt(square), cosine * acceleration - sine * square


@compiled
def position_of(model: Model, stance: int, coordinate: float) -> float:
    """Position at which the coordinate of `motion` has this value."""
    if stance == Stance.SINGLE:
        return coordinate
    cosine = linkage.ankle_cosine(model, coordinate)
    return math.acos(max(-1.0, min(1.0, cosine)))


@compiled
def panel(
    model: Model, work: Floats, segment: Segment, start: float, end: float
) -> tuple[float, bool]:
    """
    Time over one panel of double stance by Gauss-Legendre, and whether it has converged.

    The integrand is (d theta / d psi) / theta_dot. Its sines and cosines are computed from those
    at the middle and a short Taylor series, in a loop that can be vectorized.
    """
    nodes = model.rule[NODES]
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    sin_middle, cos_middle = math.sin(middle), math.cos(middle)
    rotation = middle - segment.position
    for i in range(PANEL_NODES):
        x = half * nodes[i]
        s, c = short_sine(x), short_cosine(x)
        sin_ankle = sin_middle * c + cos_middle * s
        cos_ankle = cos_middle * c - sin_middle * s
        sine = linkage.leg_sine(model, cos_ankle)
        cosine = math.sqrt(1.0 - sine * sine)
        gain = linkage.torque_work(rotation + x, segment.torque, segment.stiffness)
        fall = linkage.drop(*leaned(model, sine, cosine))
        square = segment.apex + model.per_energy * gain + model.per_drop * fall
        slope = linkage.leg_per_ankle(model, sin_ankle, cosine)
        work[i] = slope / math.sqrt(square)
    return weighed(model, work, half)


@compiled
def stall_panel(
    model: Model, work: Floats, segment: Segment, start: float, end: float
) -> tuple[float, bool]:
    """
    The same for a segment that ends in a stall, over u = sqrt(stall - psi) from start to end.

    The integrand is smooth in u. The squared rate is its gain from the stall, where it is zero,
    back to psi; computed from the energy, it would lose its last digits.
    """
    middle, half = 0.5 * (start + end), 0.5 * (end - start)
    stall_torque = effective_torque(segment, segment.end)
    stall_sine = leg_sine_at(model, Stance.DOUBLE, segment.end)
    stall_cosine = math.sqrt(1.0 - stall_sine * stall_sine)
    for i in range(PANEL_NODES):
        u = middle + half * model.rule[NODES, i]
        back = u * u
        position = segment.end - back
        sine = leg_sine_at(model, Stance.DOUBLE, position)
        cosine = math.sqrt(1.0 - sine * sine)
        rise = 2.0 * math.sin(segment.end - 0.5 * back) * math.sin(0.5 * back)
        ahead = model.per_drop * model.slope_sine * model.foot_length / model.toe_separation * rise
        rise *= model.foot_length / model.toe_separation * (sine + stall_sine)
        level = model.per_drop * rise / (cosine + stall_cosine)
        gain = linkage.torque_work(-back, stall_torque, segment.stiffness)
        square = model.per_energy * gain + model.slope_cosine * level + ahead
        slope = linkage.leg_per_ankle(model, math.sin(position), cosine)
        work[i] = -2.0 * u * slope / math.sqrt(square)
    return weighed(model, work, half)


@compiled
def weighed(model: Model, work: Floats, half: float) -> tuple[float, bool]:
    """Integral from the integrand at the nodes, and whether its last coefficients are small."""
    rule = model.rule
    total = dot(rule[WEIGHTS], work)
    tail = abs(dot(rule[TAILS], work)) + abs(dot(rule[TAILS + 1], work))
    return half * total, tail < 0.5 * TAIL_TOLERANCE * abs(total)


@compiled
def dot(weights: Floats, values: Floats) -> float:
    """Weighted sum over a panel's nodes, as four sums in parallel."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for i in range(0, PANEL_NODES, 4):
        s0 += weights[i] * values[i]
        s1 += weights[i + 1] * values[i + 1]
        s2 += weights[i + 2] * values[i + 2]
        s3 += weights[i + 3] * values[i + 3]
    return (s0 + s1) + (s2 + s3)


@compiled
def short_sine(x: float) -> float:
    """sin(x) for |x| <= 0.8 to rounding: Taylor to x^17, odd and even terms in parallel."""
    y = x * x
    z = y * y
    p = (1.0 / 6227020800.0 + 1.0 / 355687428096000.0 * z) * z + 1.0 / 362880.0
    p = (p * z + 1.0 / 120.0) * y
    q = (1.0 / -1307674368000.0 * z - 1.0 / 39916800.0) * z - 1.0 / 5040.0
    q = q * z - 1.0 / 6.0
    return x + x * y * (p + q)


@compiled
def short_cosine(x: float) -> float:
    """cos(x) for |x| <= 0.8 to rounding: Taylor to x^18, odd and even terms in parallel."""
    y = x * x
    z = y * y
    p = (1.0 / 20922789888000.0 * z + 1.0 / 479001600.0) * z + 1.0 / 40320.0
    p = (p * z + 1.0 / 24.0) * y
    q = (-1.0 / 6402373705728000.0 * z - 1.0 / 87178291200.0) * z - 1.0 / 3628800.0
    q = (q * z - 1.0 / 720.0) * z - 0.5
    return 1.0 + y * (p + q)


@compiled
def smooth(model: Model, segment: Segment, start: float, end: float) -> bool:
    """Whether the speed hardly changes over a panel, so a narrower one would be no better."""
    if end - start > SMOOTH_PANEL:
        return False
    square = squared_rate(model, segment, start)
    change = abs(squared_rate(model, segment, 0.5 * (start + end)) - square)
    change = max(change, abs(squared_rate(model, segment, end) - square))
    return change < SMOOTH_CHANGE * square


@compiled
def double_stance_time(
    model: Model, work: Floats, segment: Segment, start: float, end: float
) -> float:
    """Time [s] from one position of double stance to a later one, in panels that converge."""
    to_stall = segment.ends == Switch.FALL
    widest = PANEL_WIDTH
    if to_stall:
        start = math.sqrt(max(0.0, segment.end - start))
        end = math.sqrt(max(0.0, segment.end - end))
    total, here, width = 0.0, start, end - start
    while here != end:
        width = max(-widest, min(widest, width))
        there = end if abs(end - here) <= abs(width) else here + width
        if to_stall:
            part, converged = stall_panel(model, work, segment, here, there)
        else:
            part, converged = panel(model, work, segment, here, there)
        if not converged:
            first, last = here, there
            if to_stall:
                first, last = segment.end - here * here, segment.end - there * there
            converged = smooth(model, segment, first, last)
        if converged or abs(width) < NARROWEST_PANEL:
            total += part
            if not total < LONGEST:
                return LONGEST
            here = there
            width = 2.0 * width
        else:
            width = 0.5 * width
    return total
