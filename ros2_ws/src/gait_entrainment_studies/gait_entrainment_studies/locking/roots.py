# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Roots of functions of the ankle angle [rad] that take arrays."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]

# Ankle angles are solved to this [rad]: at 0.1 rad/s and faster, below 1e-11 s. Newton steps also
# end there; their convergence is quadratic, so the next one would be rounding.
ANGLE_TOLERANCE = 1e-12
_MOST_STEPS = 100
# If the next Newton step would still be longer than this [rad], there is no root.
_NO_ROOT = 1e-10

# Points of the scan for the first root. The function grows up to where the walker falls, and each
# further scan closes in on that angle.
_SCAN_POINTS = 33
_MOST_SCANS = 8


def newton(
    function: Callable[[Floats], tuple[Floats, Floats]], guess: Floats, least: Floats, most: float
) -> Floats:
    """
    Return the roots of a growing function, element by element, between `least` and `most`.

    The function gives value and derivative. NaN if there is no root.
    """
    angle, low, high = guess, least, np.full_like(guess, most)
    for _ in range(_MOST_STEPS):
        with np.errstate(invalid="ignore", divide="ignore"):
            value, slope = function(angle)
            following = np.clip(angle - value / slope, least, most)
            # NaN means that the walker has fallen: the root is before that.
            short = value < 0
            low, high = np.where(short, angle, low), np.where(short, high, angle)
            within = (low <= following) & (following <= high) & (slope > 0)
        following = np.where(within, following, 0.5 * (low + high))
        step = np.abs(following - angle)
        angle = following
        if not (step > ANGLE_TOLERANCE).any():
            break
    found: Floats = np.where(np.abs(value) <= np.abs(slope) * _NO_ROOT, angle, np.nan)
    return found


def first_root(function: Callable[[Floats], Floats], start: float, end: float) -> float:
    """Return the root nearest to `start`, where the function is negative; without one, `end`."""
    angles = np.linspace(start, end, _SCAN_POINTS)
    for _ in range(_MOST_SCANS):
        with np.errstate(invalid="ignore"):
            values = function(angles)
        beyond = np.flatnonzero(~(values < 0))
        if beyond.size == 0:
            return end
        bracket = angles[beyond[0] - 1], angles[beyond[0]]
        if values[beyond[0]] >= 0:
            return solve(function, *bracket)
        # The walker has fallen there, and the time grows without bound on the way to it.
        angles = np.linspace(*bracket, _SCAN_POINTS)
    return end


def solve(function: Callable[[Floats], Floats], low: float, high: float) -> float:
    """Return the root between two angles; the better of the two if rounding hides it."""

    def value(angle: float) -> float:
        return float(function(np.array([angle]))[0])

    ends = value(low), value(high)
    if ends[0] * ends[1] >= 0:
        return low if abs(ends[0]) <= abs(ends[1]) else high
    return float(brentq(value, low, high, xtol=ANGLE_TOLERANCE))
