# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Guards and resets: what ends a segment, and how the next one begins.

    switch           guard                                   reset
    toe-off          psi = mu in double stance               leave_double_stance
    heel strike      theta = -alpha in single stance         collide
    torque change    the stamp of the change                 change_torque
    unloading        k (mu - psi) + T_p = 0 while T_p < 0    unload
    fall             theta_dot = 0                           none: the walk ends
    fly-off          F_B < 0                                 none: the walk ends

Each reset overwrites the last segment with the next one and then looks ahead (`look_ahead_*`) for
the switch that comes first if the perturbation does not change, with its position and time.
"""

import math
from typing import Final

import numpy as np

from gait_entrainment.walker import linkage
from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import Floats, Model
from gait_entrainment.walker.segment import (
    Segment,
    Stance,
    Switch,
    double_stance_time,
    gained_apex,
    leading_force,
    squared_rate,
)
from gait_entrainment.walker.single_stance import pendulum_time, turning_point

NANO: Final = 1e9

# Number of points in the search for a stall or lift-off, needed only if the bounds do not rule
# both out. Rate and force have few bends over a double stance, and minima are refined.
SEARCH_POINTS: Final = 128


# Resets


@compiled
def collide(model: Model, segment: Segment, perturbation: float, work: Floats) -> None:
    """Heel strike: the speed is scaled by cos(2 alpha), the legs swap roles, push-off begins."""
    square = segment.apex + model.strike_gain
    segment.apex = model.restitution * square - model.start_gain
    segment.leading = 1 - segment.leading
    segment.step += 1
    segment.began = Switch.HEEL_STRIKE
    enter_double_stance(model, segment, perturbation, work)


@compiled
def enter_double_stance(model: Model, segment: Segment, perturbation: float, work: Floats) -> None:
    """Begin double stance right after the collision, with `apex` as it is."""
    segment.stance = Stance.DOUBLE
    segment.position = model.double_stance_start
    segment.perturbation = perturbation
    load(model, segment)
    look_ahead_double_stance(model, segment, work)


@compiled
def leave_double_stance(model: Model, segment: Segment, work: Floats) -> None:
    """Toe-off: the ankle torque ends, even if a pulse is still on."""
    segment.apex = gained_apex(model, segment, segment.end)
    segment.stance = Stance.SINGLE
    segment.position = model.toe_off_position
    segment.perturbation, segment.torque, segment.stiffness = 0.0, 0.0, 0.0
    segment.began = Switch.TOE_OFF
    look_ahead_single_stance(model, segment, work)


@compiled
def change_torque(
    model: Model, segment: Segment, position: float, perturbation: float, work: Floats
) -> None:
    """Begin a segment with a new torque from the ankle robot."""
    segment.apex = gained_apex(model, segment, position)
    segment.position = position
    segment.perturbation = perturbation
    segment.began = Switch.TORQUE_CHANGE
    load(model, segment)
    look_ahead_double_stance(model, segment, work)


@compiled
def unload(model: Model, segment: Segment, work: Floats) -> None:
    """The pulse has cancelled the spring: the trailing foot is unloaded, double stance goes on."""
    segment.apex = gained_apex(model, segment, segment.end)
    segment.position = segment.end
    segment.torque, segment.stiffness = 0.0, 0.0
    segment.began = Switch.UNLOADING
    look_ahead_double_stance(model, segment, work)


@compiled
def load(model: Model, segment: Segment) -> None:
    """Effective torque max(0, k (mu - psi) + T_p) at the start, and how it falls off."""
    spring = linkage.spring_torque(model, segment.position)
    segment.torque = max(0.0, spring + segment.perturbation)
    segment.stiffness = model.ankle_stiffness if segment.torque > 0.0 else 0.0


# Guards


@compiled
def look_ahead_single_stance(model: Model, segment: Segment, work: Floats) -> None:
    """Heel strike, unless the walker turns back before the apex or flies off after it."""
    segment.ends, segment.end, segment.shortfall = Switch.HEEL_STRIKE, model.strike_position, 0.0
    if segment.apex <= 0.0 and model.toe_off_position < 0.0:
        segment.ends = Switch.FALL
        segment.end, segment.duration = turning_point(model, segment.apex)
        segment.shortfall = -segment.apex / model.per_energy
        return
    # The mass is lowest and fastest at heel strike, so the force is least there.
    force = model.strike_hold - model.mass * model.leg_length * segment.apex
    if force < 0.0:
        # Where m g cos(theta) = m L (apex + 2 (g / L)(1 - cos(theta))).
        cosine = (model.leg_length * segment.apex / model.gravity + 2.0) / 3.0
        segment.ends = Switch.FLY_OFF
        segment.end = max(segment.position, math.acos(min(1.0, cosine)))
        segment.shortfall = -force
    if segment.ends == Switch.HEEL_STRIKE and segment.apex >= model.whole_single_stance_apex:
        segment.duration = whole_time(model.whole_single_stance, work, segment.apex)
    else:
        start, end = segment.position, segment.end
        segment.duration = pendulum_time(model.per_drop, segment.apex, start, end)


@compiled
def look_ahead_double_stance(model: Model, segment: Segment, work: Floats) -> None:
    """Toe-off or unloading, unless the walker stalls or flies off before."""
    segment.ends, segment.end, segment.shortfall = Switch.TOE_OFF, model.max_plantarflexion, 0.0
    if segment.stiffness > 0.0 and segment.perturbation < 0.0:
        segment.ends = Switch.UNLOADING
        segment.end = segment.position + segment.torque / segment.stiffness
        segment.end = min(segment.end, model.max_plantarflexion)
    if not cleared(model, segment):
        search_stall_and_lift_off(model, segment)
    precomputed = (
        segment.position == model.double_stance_start
        and segment.ends == Switch.TOE_OFF
        and segment.perturbation == 0.0
        and segment.apex >= model.whole_double_stance_apex
    )
    if precomputed:
        segment.duration = whole_time(model.whole_double_stance, work, segment.apex)
    else:
        segment.duration = double_stance_time(model, work, segment, segment.position, segment.end)


@compiled
def whole_time(whole: Floats, work: Floats, apex: float) -> float:
    """Duration [s] of a whole stance: one quadrature with precomputed geometry."""
    gain, weights = whole[0], whole[1]
    for i in range(gain.size):
        work[i] = weights[i] / math.sqrt(apex + gain[i])
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0  # in parallel; the number of nodes is a multiple of 4
    for i in range(0, gain.size, 4):
        s0 += work[i]
        s1 += work[i + 1]
        s2 += work[i + 2]
        s3 += work[i + 3]
    return (s0 + s1) + (s2 + s3)


@compiled
def cleared(model: Model, segment: Segment) -> bool:
    """
    Whether bounds alone rule out a stall and a fly-off in the rest of double stance.

    Compared with the spring alone, a positive pulse only adds speed, and lifts in proportion to
    its torque (the chord between two known pulses is a bound, since a minimum of functions linear
    in the torque is concave). A negative pulse only takes speed, at most its own work.
    """
    pulse = segment.perturbation
    turned = segment.position - model.double_stance_start
    peak = linkage.spring_torque(model, model.double_stance_start)
    by_spring = linkage.torque_work(turned, peak, model.ankle_stiffness)
    apex = segment.apex - model.per_energy * by_spring
    slowest = apex + model.least_gain
    hold = model.least_hold
    if pulse < 0.0:
        slowest += model.per_energy * pulse * (model.max_plantarflexion - segment.position)
    elif pulse <= model.bounded_pulse:
        hold += (model.bounded_hold - model.least_hold) * (pulse / model.bounded_pulse)
    else:
        return False
    lift = model.mass * model.leg_length * apex
    return slowest > 0.0 and hold > lift


@compiled
def margin(model: Model, segment: Segment, position: float, switch: int) -> float:
    """The value that must stay positive: squared rate (fall) or leading leg's force (fly-off)."""
    if switch == Switch.FALL:
        return squared_rate(model, segment, position)
    return leading_force(model, segment, position)


@compiled
def search_stall_and_lift_off(model: Model, segment: Segment) -> None:
    """End the segment where its speed or the leading leg's force would first cross zero."""
    end = segment.end
    for switch in (Switch.FALL, Switch.FLY_OFF):
        position, least = first_crossing(model, segment, end, switch)
        if least < 0.0 and position <= segment.end:
            segment.ends, segment.end = switch, position
            segment.shortfall = -least / model.per_energy if switch == Switch.FALL else -least


@compiled
def first_crossing(model: Model, segment: Segment, end: float, switch: int) -> tuple[float, float]:
    """Position up to `end` where a margin first turns negative, and the margin's least value."""
    start = segment.position
    step = (end - start) / SEARCH_POINTS
    least = margin(model, segment, start, switch)
    before, here = start, start
    value_before, value_here = least, least
    first = start if least < 0.0 else math.inf
    for i in range(1, SEARCH_POINTS + 1):
        there = start + i * step if i < SEARCH_POINTS else end
        value_there = margin(model, segment, there, switch)
        low, low_value = there, value_there
        dip = value_here < value_before and value_here <= value_there
        if dip or i == 1 or i == SEARCH_POINTS:
            low, low_value = minimum(model, segment, before, there, switch)
        if low_value < 0.0 and first == math.inf:
            positive = here if value_here >= 0.0 and here < low else before
            first = root(model, segment, positive, low, switch)
        least = min(least, low_value, value_there)
        before, value_before = here, value_here
        here, value_here = there, value_there
    return first, least


@compiled
def minimum(
    model: Model, segment: Segment, low: float, high: float, switch: int
) -> tuple[float, float]:
    """Position and value of a margin's minimum between two positions: golden section."""
    ratio = 0.5 * (math.sqrt(5.0) - 1.0)
    # At a smooth minimum, an interval below sqrt(epsilon) no longer changes the value.
    while high - low > 1e-9:
        inner, outer = high - ratio * (high - low), low + ratio * (high - low)
        if margin(model, segment, inner, switch) < margin(model, segment, outer, switch):
            high = outer
        else:
            low = inner
    place = 0.5 * (low + high)
    return place, margin(model, segment, place, switch)


@compiled
def root(model: Model, segment: Segment, positive: float, negative: float, switch: int) -> float:
    """Position where a margin crosses zero, to the last bit, between `positive` and `negative`."""
    while True:
        middle = 0.5 * (positive + negative)
        if middle <= positive or middle >= negative:
            return positive
        if margin(model, segment, middle, switch) < 0.0:
            negative = middle
        else:
            positive = middle


# Time


@compiled
def clock(stamp: int, rest: float, elapsed: float) -> tuple[int, float]:
    """
    Time after `elapsed` seconds, as whole nanoseconds and a remainder [s].

    A double that counts seconds would lose 3e-14 s per addition after 150 s; this loses nothing.
    """
    time = rest + elapsed
    nanoseconds = int(np.rint(time * NANO))
    return stamp + nanoseconds, time - nanoseconds / NANO


@compiled
def seconds(stamp: int, rest: float) -> float:
    """Time in seconds since the start of the run."""
    return stamp / NANO + rest
