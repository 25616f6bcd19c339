# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Slope and interval of the drift against scipy.stats, by hand, and by coverage."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from monte_carlo import coverage
from synthetic_gait import Noise, autoregressive, white

from gait_entrainment.gait import drift_of
from gait_entrainment.gait.drift import steadiness_of


def test_hand_computed_example() -> None:
    # Residuals 1, 1, -2, 0, -2, 1, 1 about the line 3 x: they sum to zero, also times x.
    x = [float(k) for k in range(-3, 4)]
    residuals = [1.0, 1.0, -2.0, 0.0, -2.0, 1.0, 1.0]
    y = [3 * a + e for a, e in zip(x, residuals, strict=True)]
    drift = drift_of(x, y, 0.95, 0.9)
    assert math.isclose(drift.slope, 3.0)
    # sum e^2 = 12, sum e_i e_(i+1) = 1 - 2 + 0 + 0 - 2 + 1 = -2: r is clipped to 0.
    assert drift.autocorrelation == 0.0
    assert drift.effective_pulses == 7.0
    # variance 12 / 5, spread of x 28, t(0.975, 7) = 2.364624 from tables
    assert math.isclose(drift.half_width, 2.364624 * math.sqrt(12 / 5 / 28), rel_tol=1e-6)


def test_autocorrelation_widens_the_interval() -> None:
    # Residuals 1, 1, -1, -2, -1, 1, 1: sum e^2 = 10, sum e_i e_(i+1) = 1-1+2+2-1+1 = 4, r = 0.4.
    x = [float(k) for k in range(-3, 4)]
    y = [1.0, 1.0, -1.0, -2.0, -1.0, 1.0, 1.0]
    drift = drift_of(x, y, 0.95, 0.9)
    assert math.isclose(drift.autocorrelation, 0.4)
    assert math.isclose(drift.effective_pulses, 7 * 0.6 / 1.4)
    # n_eff = 3: t(0.975, 3) = 3.182446 from tables
    expected = 3.182446 * math.sqrt(10 / 5 / 28 * 1.4 / 0.6)
    assert math.isclose(drift.half_width, expected, rel_tol=1e-6)


def test_autocorrelation_is_clipped_to_the_largest() -> None:
    x = [float(k) for k in range(40)]
    y = [math.sin(k / 7) for k in range(40)]
    drift = drift_of(x, y, 0.95, 0.6)
    assert drift.autocorrelation == 0.6
    assert math.isclose(drift.effective_pulses, 10.0)


@settings(derandomize=True, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=40), st.floats(-0.1, 0.1))
def test_agrees_with_ordinary_least_squares(noise: list[float], slope: float) -> None:
    x = np.arange(len(noise)) * 1.02 + 16.3
    y = slope * x + np.array(noise)
    reference = scipy.stats.linregress(x, y)
    drift = drift_of(list(x), list(y), 0.9, 0.0)
    assume(np.ptp(y) > 0)  # linregress has no standard error for a constant
    quantile = scipy.stats.t.ppf(0.95, len(noise))
    assert math.isclose(drift.slope, reference.slope, abs_tol=1e-9)
    assert math.isclose(drift.half_width, quantile * reference.stderr, abs_tol=1e-7)


def test_exact_line_has_no_interval() -> None:
    drift = drift_of([1.0, 2.0, 3.0, 4.0], [0.5, 0.5, 0.5, 0.5], 0.95, 0.9)
    assert (drift.slope, drift.half_width, drift.autocorrelation) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("x", "y"), [([], []), ([1.0, 2.0], [0.0, 1.0]), ([1.0, 2.0, 3.0], [0.0, math.nan, 1.0])]
)
def test_too_little_to_tell(x: list[float], y: list[float]) -> None:
    assert math.isnan(drift_of(x, y, 0.95, 0.9).slope)


# Twenty points are few to estimate r from: it comes out low, and so does the coverage.
@pytest.mark.parametrize(
    ("noise", "low", "high"), [(white, 0.94, 0.99), (autoregressive, 0.84, 0.92)]
)
def test_coverage_of_the_interval(noise: Noise, low: float, high: float) -> None:
    assert low < coverage(noise, 2000) < high


@pytest.mark.parametrize("n", [3, 20, 41])
def test_spread_of_a_steady_drift_is_the_drift(n: int) -> None:
    steadiness = steadiness_of(range(n), [0.3 - 0.02 * k for k in range(n)])
    assert math.isclose(steadiness.spread, 0.02)
    assert steadiness.scatter < 1e-12
    assert steadiness.creeps


def test_scatter_is_that_of_the_strides_whatever_the_drift() -> None:
    rng = np.random.default_rng(1)
    strides = 1.1 + 0.03 * rng.standard_normal(4000)
    for period in (1.0, 1.1):
        lags = np.cumsum(period - strides).tolist()
        assert math.isclose(steadiness_of(range(4000), lags).scatter, 0.03, rel_tol=0.03)


def test_scatter_does_not_look_across_a_missing_pulse() -> None:
    lags = [0.0, 0.1, 0.0, 0.1, 5.0, 5.1, 5.0, 5.1]
    whole = steadiness_of([1, 2, 3, 4, 9, 10, 11, 12], lags)
    assert math.isclose(whole.scatter, math.sqrt(math.pi) / 2 * 0.2)


def test_what_comes_to_rest_does_not_creep() -> None:
    assert not steadiness_of(range(20), [0.5**k for k in range(20)]).creeps
    assert steadiness_of(range(20), [1.1**k for k in range(20)]).creeps
    assert not steadiness_of(range(20), [0.0] * 20).creeps


def test_steadiness_of_too_few_or_unknown_lags_is_not_a_number() -> None:
    for lags in ([0.1, 0.2], [0.1, math.nan, 0.3]):
        steadiness = steadiness_of(range(len(lags)), lags)
        assert math.isnan(steadiness.spread)
        assert math.isnan(steadiness.scatter)
