# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Single stance: the inverted pendulum, whose time is an elliptic integral.

With z = sin(theta / 2)^2 the energy reads theta_dot^2 = apex + 4 (g / L) z, and the time between
two angles on the same side of the apex is the integral of

    dz / sqrt(z (1 - z) (apex + 4 (g / L) z)),

which is Carlson's symmetric form R_F (B. C. Carlson, Numerical computation of real or complex
elliptic integrals, 1995; DLMF 19.29.4), accurate to rounding even near a stall, with apex near 0.
"""

import math
from typing import Final

from gait_entrainment.walker.compiled import compiled
from gait_entrainment.walker.model import Model

# Turning points closer to the apex than this, as sin(theta / 2)^2, are treated as one: the closer
# the point is, the longer the walker takes to get there, and it never reaches the apex itself.
NEAREST_TURN: Final = 1e-60


@compiled
def carlson_rf(x: float, y: float, z: float) -> float:
    """Carlson's R_F by duplication, for non-negative arguments of which at most one is zero."""
    mean = (x + y + z) / 3.0
    off_x, off_y = mean - x, mean - y
    # The series below is cut after the seventh order. With a spread of 1/280 of the mean, the
    # error is below 1e-17 of the result. Each duplication divides the spread by 4.
    spread = 280.0 * max(abs(off_x), abs(off_y), abs(mean - z))
    shrink = 1.0
    while spread * shrink > mean:
        root_x, root_y, root_z = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = root_x * root_y + root_x * root_z + root_y * root_z
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        mean = 0.25 * (mean + shift)
        shrink *= 0.25
    a, b = off_x * shrink / mean, off_y * shrink / mean
    c = -a - b
    e2, e3 = a * b - c * c, a * b * c
    series = (
        1.0
        - e2 / 10.0
        + e3 / 14.0
        + e2 * e2 / 24.0
        - 3.0 * e2 * e3 / 44.0
        - 5.0 * e2 * e2 * e2 / 208.0
        + 3.0 * e3 * e3 / 104.0
        + e2 * e2 * e3 / 16.0
    )
    return series / math.sqrt(mean)


@compiled
def time_from_apex(per_drop: float, apex: float, half_sine: float) -> float:
    """Time [s] between the apex and the angle with sin(theta / 2)^2 = half_sine; apex > 0."""
    fast = apex + 2.0 * per_drop * half_sine
    return 2.0 * math.sqrt(half_sine) * carlson_rf(apex * (1.0 - half_sine), fast, apex)


@compiled
def time_on_one_side(
    per_drop: float, apex: float, low: float, high: float, low_square: float
) -> float:
    """
    Time [s] between two angles on one side of the apex, sin(theta / 2)^2 = low < high.

    `low_square` is the squared rate at `low`. At a turning point it is zero; the energy would give
    it with an error, the square root of which would show in the time.
    """
    low_1, high_1 = math.sqrt(low), math.sqrt(high)
    low_2, high_2 = math.sqrt(1.0 - low), math.sqrt(1.0 - high)
    low_3 = math.sqrt(low_square)
    high_3 = math.sqrt(max(0.0, apex + 2.0 * per_drop * high))
    width = high - low
    u12 = (high_1 * high_2 * low_3 + low_1 * low_2 * high_3) / width
    u13 = (high_1 * high_3 * low_2 + low_1 * low_3 * high_2) / width
    u23 = (high_2 * high_3 * low_1 + low_2 * low_3 * high_1) / width
    return 2.0 * carlson_rf(u12 * u12, u13 * u13, u23 * u23)


@compiled
def half_sine(position: float) -> float:
    """sin(theta / 2)^2."""
    sine = math.sin(0.5 * position)
    return sine * sine


@compiled
def pendulum_time(per_drop: float, apex: float, start: float, end: float) -> float:
    """Time [s] from position `start` to `end` (both -theta, start <= end) in single stance."""
    first, last = half_sine(start), half_sine(end)
    if first == last and start * end >= 0.0:
        return 0.0
    if start < 0.0 < end:
        return time_from_apex(per_drop, apex, first) + time_from_apex(per_drop, apex, last)
    low, high = min(first, last), max(first, last)
    return time_on_one_side(per_drop, apex, low, high, max(0.0, apex + 2.0 * per_drop * low))


@compiled
def turning_point(model: Model, apex: float) -> tuple[float, float]:
    """Position where a walker with apex <= 0 comes to rest, and the time from toe-off to there."""
    low = max(-apex / (2.0 * model.per_drop), NEAREST_TURN)
    high = model.toe_off_half_sine
    if low >= high:
        return model.toe_off_position, 0.0
    return -2.0 * math.asin(math.sqrt(low)), time_on_one_side(model.per_drop, apex, low, high, 0.0)
