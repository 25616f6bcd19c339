# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Slope of a phase lag per stride, with an interval that allows for autocorrelation."""

import itertools
import math
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
