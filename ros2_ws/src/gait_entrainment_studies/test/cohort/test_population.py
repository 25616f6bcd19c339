# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from step_to_step import step_to_step

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import EndingKind
from gait_entrainment.walker.variation import step_noise
from gait_entrainment_studies.cohort.locked import locked_runs
from gait_entrainment_studies.cohort.population import (
    Population,
    PulseTrains,
    noise_for,
)
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.walked import walk_under_pulses

TABLE_1 = WalkerParameters()
PERIOD = 1.9332295304390836


# Onsets of the reference are whole nanoseconds; unloading has a kink within the quadrature.
@pytest.mark.parametrize(("fraction", "tolerance"), [(0.1, 5e-9), (-0.1, 1e-6)])
def test_without_noise_the_walk_is_that_of_the_papers_walker(fraction, tolerance):
    offsets = np.array([-0.05, -0.07, 0.02, 0.06, -0.1])
    torque = fraction * TABLE_1.peak_torque
    count = offsets.size
    trains = PulseTrains(
        np.full(count, 0.3 * PERIOD), PERIOD + offsets, 100, np.full(count, torque), 0.1
    )
    walk = Population([TABLE_1] * count).walk(np.zeros((80, count)), trains)
    gait = PulsedGait(TABLE_1, torque, 0.1)
    for i, offset in enumerate(offsets):
        reference = walk_under_pulses(gait, PERIOD + offset, 0.3, 40)
        assert walk.heel_strikes[::2, i] == pytest.approx(reference.heel_strikes, abs=tolerance)
        assert walk.toe_offs[1::2, i] == pytest.approx(reference.toe_offs, abs=tolerance)


@pytest.mark.parametrize("slope", [-0.03, 0.0, 0.02])
def test_a_step_on_a_slope_solves_the_equations_of_motion(slope):
    """Lagrange's equation in the angle theta, gravity tilted by the slope; shares no code."""
    p = TABLE_1
    d = 2 * p.leg_length * math.sin(p.leg_angle) - p.foot_length

    def psi(theta):
        reach = p.leg_length**2 + d**2 - 2 * p.leg_length * d * math.sin(theta)
        cosine = (p.leg_length**2 + p.foot_length**2 - reach) / (2 * p.leg_length * p.foot_length)
        return math.acos(cosine)

    def motion(_, state, double):
        theta, rate = state
        acceleration = p.gravity / p.leg_length * math.sin(theta + slope)
        if double:
            h = 1e-6
            slope_psi = (psi(theta + h) - psi(theta - h)) / (2 * h)
            torque = p.ankle_stiffness * (p.max_plantarflexion - psi(theta))
            acceleration += torque * slope_psi / (p.mass * p.leg_length**2)
        return [rate, acceleration]

    def crossing(angle):
        def event(_, state, *_rest):
            return state[0] - angle

        event.terminal = True
        return event

    population = Population([p], slope)
    apex = population.periodic_apex() + 0.3
    square = apex[0] + 2 * p.gravity / p.leg_length * (1 - math.cos(p.leg_angle + slope))
    tight = {"rtol": 1e-11, "atol": 1e-12, "max_step": 0.01}
    double = solve_ivp(
        motion, (0, 3), [p.leg_angle, -math.sqrt(square)],
        args=(True,), events=crossing(p.toe_off_angle), **tight,
    )  # fmt: skip
    single = solve_ivp(
        motion, (0, 3), double.y[:, -1],
        args=(False,), events=crossing(-p.leg_angle), **tight,
    )  # fmt: skip
    walk = population.walk(np.zeros((1, 1)), apex=apex)
    assert walk.toe_offs[0, 0] == pytest.approx(double.t[-1], abs=1e-8)
    assert walk.heel_strikes[1, 0] == pytest.approx(double.t[-1] + single.t[-1], abs=1e-8)


def test_noise_gives_the_chosen_variation_and_the_same_walk_for_the_same_seed():
    population = Population([TABLE_1] * 30)
    wanted = np.full(30, 0.015)
    noise = noise_for(population, wanted, seed=3, hurst=0.75)
    walks = [population.walk(noise * step_noise(8, 600, 30, 0.75)) for _ in range(2)]
    periods = walks[0].stride_periods
    found = periods.std(axis=0) / periods.mean(axis=0)
    assert found.mean() == pytest.approx(0.015, rel=0.03)
    np.testing.assert_array_equal(walks[0].heel_strikes, walks[1].heel_strikes)


def test_long_range_noise_has_the_covariance_of_fractional_gaussian_noise():
    draws = step_noise(0, 2000, 100, 0.75)
    lags = np.array([1, 4, 16])
    expected = 0.5 * ((lags + 1) ** 1.5 - 2 * lags**1.5 + (lags - 1) ** 1.5)
    found = [np.mean(draws[:-lag] * draws[lag:]) for lag in lags]
    assert found == pytest.approx(expected, abs=0.02)
    white = step_noise(0, 2000, 100, 0.5)
    assert abs(np.mean(white[:-1] * white[1:])) < 0.01
    assert np.abs(draws).max() <= 3


def test_falls_and_flights_are_reported_and_end_the_walk():
    weak = replace(TABLE_1, ankle_stiffness=68.0)
    strong = replace(TABLE_1, ankle_stiffness=111.0)
    walk = Population([weak, strong]).walk(0.1 * step_noise(1, 200, 2))
    assert walk.endings == [EndingKind.FALL, EndingKind.FLY_OFF]
    assert np.isnan(walk.heel_strikes[-1]).all()


def test_asymmetry_makes_steps_alternate_and_leaves_the_walk_periodic():
    walk = Population([TABLE_1], asymmetry=0.05).walk(np.zeros((80, 1)))
    steps = np.diff(walk.heel_strikes[:, 0])
    assert steps[-1] == pytest.approx(steps[-3], abs=1e-12)
    assert steps[-2] - steps[-1] > 0.05


def test_locked_runs_count_strides_near_the_lock():
    lags = np.array([0.0, 0.01, 0.2, -0.01, 0.0, 0.0])
    fraction, runs = locked_runs(lags, 0.0, 0.05)
    assert fraction == pytest.approx(5 / 6)
    assert runs == [2, 3]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Population([TABLE_1], 0.6), "slope: 0.6 rad; allowed: within the leg angle"),
        (
            lambda: step_noise(0, 9, 1, 1.0),
            "hurst: 1; allowed: at least 0.5",
        ),
        (
            lambda: Population([TABLE_1], asymmetry=2),
            "asymmetry: 2; allowed: above -1",
        ),
    ],
)
def test_values_out_of_range_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(("slope", "asymmetry"), [(-0.02, 0.0), (0.02, 0.0), (0.0, 0.04)])
def test_a_walk_starts_in_the_periodic_gait_of_its_slope_and_asymmetry(slope, asymmetry):
    periods = Population([TABLE_1], slope, asymmetry).walk(np.zeros((20, 1))).stride_periods
    assert periods == pytest.approx(np.full_like(periods, periods[-1]), abs=1e-8)


def test_the_coefficient_of_variation_on_a_slope_is_the_requested_one():
    # Little variation: a transient from the level gait would outweigh it.
    population = Population([TABLE_1] * 8, 0.02)
    noise = noise_for(population, np.full(8, 0.002), 1)
    periods = population.walk(noise * step_noise(1, 800, 8)).stride_periods[5:]
    assert periods.std(axis=0, ddof=1) / periods.mean(axis=0) == pytest.approx(0.002, rel=0.02)


def test_a_walker_survives_a_pulse_that_would_make_it_fall_if_it_lasted():
    onset = np.array([0.02, 0.16, -0.01, 0.1, -0.134])
    torque = np.array([-100.0, -75.0, -95.0, -160.0, 60.0])
    population = Population([TABLE_1] * 5)
    # The perturbed leg trails in the second step, from heel strike 1 on.
    trains = PulseTrains(PERIOD / 2 + onset, np.full(5, PERIOD), 1, torque, 0.1)
    walk = population.walk(np.zeros((2, 5)), trains)
    reference = step_to_step(TABLE_1, TABLE_1.speed_after_collision, onset, 0.1, torque)
    # The last pulse ends before heel strike, when it would lift the leading leg.
    assert [walk.endings[index] for index in (0, 1, 2, 4)] == [None] * 4
    duration = np.diff(walk.heel_strikes, axis=0)[1]
    assert duration == pytest.approx(reference.duration, abs=1e-5, nan_ok=True)
