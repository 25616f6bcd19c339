# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Slope of a phase lag per stride, with its interval; whether the lag stays put."""

import itertools
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.special import stdtrit


@dataclass(frozen=True, slots=True)
class Drift:
    """Least-squares slope of the unwrapped lag over continuous stride count."""

    slope: float  # [s per stride]
    half_width: float  # of its confidence interval [s per stride]
    autocorrelation: float  # lag 1, of the residuals, clipped to [0, largest]
    effective_pulses: float  # n (1 - r) / (1 + r)


UNKNOWN = Drift(math.nan, math.nan, math.nan, math.nan)


def drift_of(
    strides: Sequence[float],
    lags: Sequence[float],
    confidence: float,
    largest_autocorrelation: float,
) -> Drift:
    """
    Return the drift of ``lags`` [s] over ``strides`` (same length, strictly increasing).

    The standard error of ordinary least squares, with n - 2 degrees of freedom in the residual
    variance, is inflated by sqrt((1 + r) / (1 - r)), r the lag-1 autocorrelation of the residuals
    taken in order, and the interval uses Student's t with n (1 - r) / (1 + r) degrees of freedom.
    UNKNOWN with fewer than three points or a lag that is not a number.
    """
    n = len(lags)
    if n < 3 or math.isnan(sum(lags)):
        return UNKNOWN
    mean_stride, mean_lag = math.fsum(strides) / n, math.fsum(lags) / n
    x = [stride - mean_stride for stride in strides]
    y = [lag - mean_lag for lag in lags]
    spread = math.fsum(a * a for a in x)
    slope = math.fsum(a * b for a, b in zip(x, y, strict=True)) / spread
    residuals = [b - slope * a for a, b in zip(x, y, strict=True)]
    squares = math.fsum(e * e for e in residuals)
    products = math.fsum(e * f for e, f in itertools.pairwise(residuals))
    raw = products / squares if squares > 0 else 0.0
    r = min(max(raw, 0.0), largest_autocorrelation)
    effective = n * (1 - r) / (1 + r)
    error = math.sqrt(squares / (n - 2) / spread * (1 + r) / (1 - r))
    quantile = float(stdtrit(effective, 0.5 + confidence / 2))
    return Drift(slope, quantile * error, r, effective)


@dataclass(frozen=True, slots=True)
class Steadiness:
    """
    Whether a lag stays put, or moves on: its spread beside its scatter from pulse to pulse.

    The lag of an indifferent walker is a sum over strides: its spread grows with the number of
    pulses, by drift and by wandering, and the more so the longer the memory of its strides. That
    of a locked walker does not. The scatter is the same for both: of the second differences of
    the lag, in which the drift cancels, and which for an indifferent walker are those of
    successive stride periods. The ratio of spread and scatter is von Neumann's (1941), as a test
    of a random walk that of Sargan and Bhargava (1983), taken one difference higher so that noise
    with a long memory counts as wandering.
    """

    spread: float  # steady drift that would give the lag's standard deviation [s per pulse]
    scatter: float  # standard deviation of the second differences / sqrt(2) [s]
    creeps: (
        bool  # moves smoothly, and has not come to rest: the second half is over half the first
    )


def steadiness_of(numbers: Sequence[int], lags: Sequence[float]) -> Steadiness:
    """
    Return the steadiness of ``lags`` [s] of the pulses with these ``numbers``, same length.

    Scatter is the mean size of the second differences over successive pulses, which an outlier
    moves less than their squares, times sqrt(pi) / 2, as it is for normal noise. NaN, and at rest,
    with fewer than three points or a lag that is not a number.
    """
    n = len(lags)
    triples = zip(numbers, numbers[2:], lags, lags[1:], lags[2:], strict=False)
    bends = [abs(a - 2 * b + c) for first, last, a, b, c in triples if last - first == 2]
    if not bends or math.isnan(sum(lags)):
        return Steadiness(math.nan, math.nan, creeps=False)
    # A line of slope 1 over n pulses has the variance n (n + 1) / 12.
    spread = statistics.stdev(lags) * math.sqrt(12 / (n * (n + 1)))
    scatter = math.sqrt(math.pi) / 2 * math.fsum(bends) / len(bends)
    middle = lags[n // 2]
    rests = abs(lags[-1] - middle) <= abs(middle - lags[0]) / 2
    return Steadiness(spread, scatter, creeps=spread > scatter and not rests)
