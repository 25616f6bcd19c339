# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Slope, spread, scatter and creeping of a lag, against scipy.stats and by hand."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from monte_carlo import coverage

from gait_entrainment.gait import Drift, drift_of


def drift(lags: list[float]) -> Drift:
    """Return the drift of successive pulses, one a stride."""
    return drift_of(list(range(len(lags))), list(range(len(lags))), lags)


@settings(derandomize=True, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=40), st.floats(-0.1, 0.1))
def test_slope_is_that_of_ordinary_least_squares(noise: list[float], slope: float) -> None:
    x = np.arange(len(noise)) * 1.02 + 16.3
    y = slope * x + np.array(noise)
    found = drift_of(list(x), list(range(len(x))), list(y))
    assert math.isclose(found.slope, scipy.stats.linregress(x, y).slope, abs_tol=1e-9)


def test_interval_contains_the_drift_of_an_indifferent_walker() -> None:
    assert 0.93 < coverage(np.random.default_rng(1), 4000) < 0.97


@pytest.mark.parametrize("n", [3, 20, 41])
def test_spread_of_a_steady_drift_is_the_drift(n: int) -> None:
    found = drift([0.3 - 0.02 * k for k in range(n)])
    assert math.isclose(found.spread, 0.02)
    assert found.scatter < 1e-12
    assert found.creeps


def test_scatter_is_that_of_the_strides_whatever_the_drift() -> None:
    rng = np.random.default_rng(1)
    strides = 1.1 + 0.03 * rng.standard_normal(4000)
    for period in (1.0, 1.1):
        lags = np.cumsum(period - strides).tolist()
        assert math.isclose(drift(lags).scatter, 0.03, rel_tol=0.03)


def test_scatter_does_not_look_across_a_missing_pulse() -> None:
    lags = [0.0, 0.1, 0.0, 0.1, 5.0, 5.1, 5.0, 5.1]
    found = drift_of(list(range(8)), [1, 2, 3, 4, 9, 10, 11, 12], lags)
    assert math.isclose(found.scatter, math.sqrt(math.pi) / 2 * 0.2)


def test_a_lag_that_comes_to_rest_does_not_creep() -> None:
    assert not drift([0.5**k for k in range(20)]).creeps
    assert drift([1.1**k for k in range(20)]).creeps
    assert not drift([0.0] * 20).creeps


def test_drift_of_too_few_or_unknown_lags_is_not_a_number() -> None:
    for lags in ([0.1, 0.2], [0.1, math.nan, 0.3]):
        found = drift(lags)
        assert math.isnan(found.slope)
        assert math.isnan(found.spread)
        assert not found.creeps
