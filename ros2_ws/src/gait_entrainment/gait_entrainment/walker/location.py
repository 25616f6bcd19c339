# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The walker's position in a segment at a given time: the inverse of the quadrature.

A quintic through value, velocity and acceleration at both ends gives a first guess. One quadrature
gives the time at the guess, and a second-order Taylor step in time covers the rest. Its error goes
with the cube of the time left.
"""

from typing import Final

from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import Floats, Model
from gait_entrainment.walker.segment import (
    Motion,
    Segment,
    Stance,
    double_stance_time,
    motion,
    position_of,
)
from gait_entrainment.walker.single_stance import pendulum_time

# A Taylor step this short [s] is off by less than 1e-17: its cube times a jerk of up to 10 / s^3.
LAST_STEP: Final = 1e-6

# Bisection alone would need 60 halvings; Newton steps in between can only be faster.
MOST_STEPS: Final = 100


@compiled
def travel_time(model: Model, work: Floats, segment: Segment, start: float, end: float) -> float:
    """Time [s] from position `start` to `end` of the segment, negative if `end` is before it."""
    first, last = min(start, end), max(start, end)
    if segment.stance == Stance.SINGLE:
        time = pendulum_time(model.per_drop, segment.apex, first, last)
    else:
        time = double_stance_time(model, work, segment, first, last)
    return -time if end < start else time


@compiled
def quintic(span: float, elapsed: float, start: Motion, end: Motion) -> float:
    """Value after `elapsed` of `span` [s], from value, velocity and acceleration at both ends."""
    s = elapsed / span
    v0, v1 = start[1] * span, end[1] * span
    a0, a1 = start[2] * span * span, end[2] * span * span
    gap = end[0] - start[0] - v0 - 0.5 * a0
    speed, bend = v1 - v0 - a0, a1 - a0
    c3 = 10.0 * gap - 4.0 * speed + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * speed - bend
    c5 = 6.0 * gap - 3.0 * speed + 0.5 * bend
    return start[0] + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))


@compiled
def position_at(model: Model, work: Floats, segment: Segment, elapsed: float) -> float:
    """Position after `elapsed` seconds of the segment, clamped to its ends."""
    low, high = segment.position, segment.end
    if elapsed <= 0.0:
        return low
    if elapsed >= segment.duration:
        return high
    start, end = motion(model, segment, low), motion(model, segment, high)
    guess = quintic(segment.duration, elapsed, start, end)
    position = position_of(model, segment.stance, guess)
    if not low < position < high:
        position = 0.5 * (low + high)
    left = elapsed - travel_time(model, work, segment, low, position)
    for _ in range(MOST_STEPS):
        if left >= 0.0:
            low = position
        else:
            high = position
        value, velocity, acceleration = motion(model, segment, position)
        value += left * (velocity + 0.5 * acceleration * left)
        target = position_of(model, segment.stance, value)
        inside = low <= target <= high
        if abs(left) < LAST_STEP and inside:
            return target
        if not inside or (target - position) * left <= 0.0:
            target = 0.5 * (low + high)
            if target in (low, high):
                return target
        left -= travel_time(model, work, segment, position, target)
        position = target
    return position
