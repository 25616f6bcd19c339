# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics, checked against closed forms, other implementations and nominal coverage."""

import math
from itertools import pairwise

import numpy as np
import pytest
from astropy.stats import rayleightest, vonmisesmle
from hypothesis import given
from hypothesis import strategies as st
from scipy import special

from gait_entrainment.gait import PulsePhase
from gait_entrainment_sessions import statistics
from gait_entrainment_sessions.statistics import Border

PHASES = st.lists(st.floats(0.0, 1.0, exclude_max=True), min_size=1, max_size=30)


def pulses_with(lags, skip=()):
    """Return one pulse per stride with these lags, without the pulses to skip."""
    numbered = enumerate(lags, start=1)
    return [PulsePhase(n, 0, n, 0.5, lag, lag, 0) for n, lag in numbered if n not in skip]


def rate_of(holds, trials=400, seed=1):
    """Return the share of independent generators for which a condition holds."""
    return sum(map(holds, np.random.default_rng(seed).spawn(trials))) / trials


def test_slope_solves_the_normal_equations_and_has_students_interval():
    x, y = np.arange(10.0), np.array([1, 3, 2, 5, 4, 7, 6, 9, 8, 8.5])
    design = np.column_stack([np.ones(10), x])
    solved = np.linalg.solve(design.T @ design, design.T @ y)
    residual = y - design @ solved
    error = math.sqrt(residual @ residual / 8 * np.linalg.inv(design.T @ design)[1, 1])
    found = statistics.slope(x, y)
    assert found.value == pytest.approx(solved[1])
    assert found.high - found.value == pytest.approx(2.306004135 * error)  # t of 8 degrees
    assert found.value - found.low == pytest.approx(found.high - found.value)


def test_slope_of_too_little_data_is_nan():
    assert math.isnan(statistics.slope([1, 2], [1, 2]).value)
    assert math.isnan(statistics.slope([3, 3, 3], [1, 2, 3]).value)
    assert statistics.slope([1, 2, 3, 4], [0.1] * 4) == (0, 0, 0)


@given(PHASES, st.floats(0.0, 1.0))
def test_direction_turns_with_the_phases(phases, turn):
    before = statistics.direction(phases)
    after = statistics.direction([(phase + turn) % 1.0 for phase in phases])
    assert after.resultant == pytest.approx(before.resultant, abs=1e-9)
    if before.resultant > 1e-3:
        moved = (after.phase - before.phase - turn + 0.5) % 1.0 - 0.5
        assert moved == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("resultant", [0.2, 0.6, 0.95])
def test_kappa_solves_the_likelihood_equation(resultant):
    half = math.acos(resultant) / (2 * math.pi)  # of two phases this far from their mean
    found = statistics.direction([0.3 - half, 0.3 + half])
    assert found.phase == pytest.approx(0.3)
    assert found.resultant == pytest.approx(resultant)
    bessel = special.i1e(found.kappa) / special.i0e(found.kappa)
    assert bessel == pytest.approx(resultant, abs=1e-6)
    angles = 2 * np.pi * np.array([0.3 - half, 0.3 + half])
    assert found.kappa == pytest.approx(vonmisesmle(angles)[1], rel=0.06)  # an approximation


def test_direction_of_equal_phases_and_of_no_phases():
    found = statistics.direction([0.25] * 7)
    assert (found.phase, found.resultant, found.kappa) == (pytest.approx(0.25), 1.0, math.inf)
    assert math.isnan(statistics.direction([]).phase)
    assert math.isnan(statistics.direction([0.25]).kappa)


def test_an_exponential_approach_is_found_exactly_and_nothing_else_is():
    n = np.arange(40)
    for tau in (2.0, 7.0, 15.0):
        found = statistics.convergence(n, -0.06 + 0.5 * np.exp(-n / tau))
        assert found.value == pytest.approx(tau, rel=1e-6)
    assert math.isnan(statistics.convergence(n, -0.05 * n).value)  # drifts
    assert math.isnan(statistics.convergence(n[:5], np.exp(-n[:5])).value)
    assert math.isnan(statistics.convergence(n, [*np.exp(-n[:39]), math.nan]).value)


def test_interval_of_the_time_constant_has_its_nominal_coverage():
    n = np.arange(50)

    def holds(rng):
        noise = 0.02 * rng.standard_normal(50)
        found = statistics.convergence(n, -0.05 + 0.3 * np.exp(-n / 7) + noise)
        return found.low < 7 < found.high

    assert 0.92 < rate_of(holds) < 0.98

    def claims(rng):
        return not math.isnan(statistics.convergence(n, 0.02 * rng.standard_normal(50)).value)

    assert rate_of(claims) < 0.06


def test_locked_spans_are_those_near_most_lags_even_across_the_wrap():
    lags = [0.3, 0.2, *[-0.05] * 6, 0.4, *[-0.049] * 4]
    found = statistics.locking(pulses_with(lags), 1.0)
    assert found.lag == pytest.approx(-0.0496)
    assert (found.share, found.runs) == (pytest.approx(10 / 13), (6, 4))
    # A missing pulse ends a span.
    assert statistics.locking(pulses_with([0.1] * 9, skip={4}), 1.0).runs == (3, 5)
    around_the_wrap = pulses_with([0.49, -0.49, 0.495, -0.495])
    assert statistics.locking(around_the_wrap, 1.0).share == 1.0


@given(st.integers(20, 200))
def test_pulses_that_run_through_the_stride_are_locked_by_chance_alone(count):
    lags = [(n / count + 0.5) % 1.0 - 0.5 for n in range(count)]
    share = statistics.locking(pulses_with(lags), 1.0).share
    assert share == pytest.approx(0.1, abs=2 / count)


TRIED = [(-1.0, "entrained"), (-2.0, "entrained"), (-3.0, "undecided"), (-4.0, "drifting")]


@pytest.mark.parametrize(
    ("offsets", "sign", "found"),
    [
        (TRIED, -1, Border(-2.0, -4.0, True)),
        (TRIED, 1, Border(0.0, math.inf, True)),
        ([*TRIED, (-1.5, "lost")], -1, Border(-2.0, -4.0, False)),
        ([(2.0, "drifting"), (1.0, "untestable")], 1, Border(0.0, 2.0, True)),
        (TRIED[:2], -1, Border(-2.0, -math.inf, True)),
    ],
)
def test_border_lies_between_two_offsets_that_were_tried(offsets, sign, found):
    assert statistics.border(offsets, sign) == found


def test_share_has_wilsons_interval():
    z, n, p = 1.959963985, 19, 18 / 19
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    found = statistics.share(18, 19)
    assert found == pytest.approx((p, middle - half, middle + half))
    assert math.isnan(statistics.share(0, 0).value)


def test_intervals_of_mean_and_deviation_have_their_nominal_coverage():
    def mean_holds(rng):
        found = statistics.mean(rng.normal(6.7, 3.6, 9))
        return found.low < 6.7 < found.high

    def deviation_holds(rng):
        found = statistics.deviation(rng.normal(6.7, 3.6, 9))
        return found.low < 3.6 < found.high

    assert 0.92 < rate_of(mean_holds) < 0.98
    assert 0.92 < rate_of(deviation_holds) < 0.98
    assert math.isnan(statistics.mean([1.0]).low)
    assert math.isnan(statistics.deviation([1.0]).value)


@pytest.mark.parametrize("count", [5, 10, 12, 40])
def test_rayleigh_agrees_with_another_approximation_and_with_chance(count):
    phases = [0.02 * n for n in range(count)]
    other = rayleightest(2 * np.pi * np.array(phases))
    assert statistics.rayleigh(phases) == pytest.approx(other, abs=0.005)
    # For ten persons close together that library's series is negative, which no probability is.
    close = [0.65 + phase / count for phase in phases]
    assert 0 < statistics.rayleigh(close) < 0.01
    assert (rayleightest(2 * np.pi * np.array(close)) < 0) == (count == 10)
    assert 0.02 < rate_of(lambda rng: statistics.rayleigh(rng.uniform(size=count)) < 0.05) < 0.09
    assert math.isnan(statistics.rayleigh([0.5]))


def test_estimates_are_ordered():
    found = [statistics.share(3, 8), statistics.mean([1, 2, 4]), statistics.deviation([1, 2, 4])]
    assert all(a < b for f in found for a, b in pairwise((f.low, f.value, f.high)))
