# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a phase lag stays put, drifts, wanders or creeps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Drift:
    """
    How a lag moves; with fewer than three successive pulses all NaN, and not creeping.

    The lag of an indifferent walker is a sum over strides, so its spread grows with the number of
    pulses, by drift and by wandering; a locked one's does not. The scatter is alike: it is that of
    second differences, in which the drift cancels. Spread over scatter is von Neumann's ratio
    (1941), a test of a random walk by Sargan and Bhargava (1983), taken one difference higher.
    """

    slope: float  # of a least-squares line [s per stride]
    half_width: float  # of its 95 % interval if the lag is a random walk [s per stride]
    spread: float  # the steady drift that would give the lag's standard deviation [s per pulse]
    scatter: float  # standard deviation of the second differences / sqrt(2) [s]
    creeps: bool  # moves smoothly, in the second half by more than half as much as in the first


def drift_of(strides: Sequence[float], numbers: Sequence[int], lags: Sequence[float]) -> Drift:
    """
    Return the drift of ``lags`` [s] of the pulses ``numbers`` in ``strides``, of equal length.

    The slope of a least-squares line through a random walk of n steps has the variance of a step
    times 6 / (5 n). The scatter is sqrt(pi) / 2 times the mean size of second differences, as for
    normal noise; an outlier changes it less than it would change their squares.
    """
    n = len(lags)
    triples = zip(numbers, numbers[2:], lags, lags[1:], lags[2:], strict=False)
    bends = [abs(a - 2 * b + c) for first, last, a, b, c in triples if last - first == 2]
    if not bends or math.isnan(sum(lags)):
        return Drift(math.nan, math.nan, math.nan, math.nan, creeps=False)
    mean_stride, mean_lag = math.fsum(strides) / n, math.fsum(lags) / n
    x = [stride - mean_stride for stride in strides]
    y = [lag - mean_lag for lag in lags]
    slope = math.fsum(a * b for a, b in zip(x, y, strict=True)) / math.fsum(a * a for a in x)
    # A line of slope 1 over n pulses has the variance n (n + 1) / 12.
    spread = math.sqrt(math.fsum(b * b for b in y) / (n - 1) * 12 / (n * (n + 1)))
    scatter = math.sqrt(math.pi) / 2 * math.fsum(bends) / len(bends)
    middle = lags[n // 2]
    rests = abs(lags[-1] - middle) <= abs(middle - lags[0]) / 2
    half_width = 1.96 * scatter * math.sqrt(6 / (5 * n))
    return Drift(slope, half_width, spread, scatter, creeps=spread > scatter and not rests)
