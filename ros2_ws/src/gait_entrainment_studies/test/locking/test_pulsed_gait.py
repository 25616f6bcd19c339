# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from walked_stride import walk_a_stride

from gait_entrainment.parameters import ParameterError, WalkerParameters
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait

TABLE_1 = WalkerParameters()


def gaits_of(gait):
    """Return six gaits on each branch, away from the corners."""
    inner = np.linspace(0.08, 0.92, 6)
    struck, off = gait.heel_strike, gait.toe_off
    return {
        "early": gait.gaits(Place.EARLY, struck + inner * (gait.first_end - struck)),
        "inside": gait.gaits(Place.INSIDE, struck + inner * (gait.last_start - struck)),
        "late": gait.gaits(Place.LATE, gait.last_start + inner * (off - gait.last_start)),
    }


@pytest.mark.parametrize("torque", [13.3, -13.3, 40.0])
@pytest.mark.parametrize("branch", ["early", "inside", "late"])
def test_the_walker_repeats_every_gait_of_a_branch(torque, branch):
    gait = PulsedGait(TABLE_1, torque, 0.1)
    gaits = gaits_of(gait)[branch]
    for i in range(6):
        one = gaits.at(i)
        speed = gait.speed(one.apex)
        duration, after = walk_a_stride(TABLE_1, speed, one.onset, torque, 0.1)
        # The walker takes onsets in whole nanoseconds.
        assert duration == pytest.approx(one.period, abs=3e-9)
        assert after == pytest.approx(speed, abs=3e-9)


@pytest.mark.parametrize("torque", [13.3, -13.3, 40.0])
@pytest.mark.parametrize("branch", ["early", "inside", "late"])
def test_jacobian_is_the_derivative_of_the_walkers_stride(torque, branch):
    gait = PulsedGait(TABLE_1, torque, 0.1)
    one = gaits_of(gait)[branch].at(2)
    strike_gain = 2 * TABLE_1.gravity / TABLE_1.leg_length * (1 - np.cos(TABLE_1.leg_angle))
    onset = round(one.onset * 1e9) / 1e9

    def section_map(apex, onset):
        duration, speed = walk_a_stride(TABLE_1, gait.speed(apex), onset, torque, 0.1)
        rate = speed / TABLE_1.leg_length
        return np.array([rate**2 - strike_gain, onset - duration])

    def derivative(function, step):
        # Sixth order; its onsets are whole nanoseconds.
        weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
        return sum(
            w * (function(i * step) - function(-i * step)) / step for i, w in weights.items()
        )

    by_apex = derivative(lambda step: section_map(one.apex + step, onset), 5e-4)
    by_onset = derivative(lambda step: section_map(one.apex, onset + step), 1e-3)
    assert np.column_stack([by_apex, by_onset]) == pytest.approx(one.jacobian, abs=2e-8)


def test_gaits_are_found_if_double_stance_needs_more_nodes():
    # A stance foot a third of the leg: an integrand that 24 nodes do not resolve.
    walker = WalkerParameters(
        leg_length=0.695,
        foot_length=0.2235,
        leg_angle=0.455,
        max_plantarflexion=2.006,
        ankle_stiffness=100.0,
    )
    gait = PulsedGait(walker, 0.1 * walker.peak_torque, 0.1)
    for branch, gaits in gaits_of(gait).items():
        assert gaits.feasible.all(), branch
        for i in range(6):
            one = gaits.at(i)
            duration, _ = walk_a_stride(walker, gait.speed(one.apex), one.onset, gait.torque, 0.1)
            assert duration == pytest.approx(one.period, abs=3e-9)


def test_slope_is_the_derivative_of_the_period_along_each_branch():
    gait = PulsedGait(TABLE_1, 13.3, 0.1)
    start = np.linspace(gait.heel_strike, gait.last_start, 2001)
    gaits = gait.gaits(Place.INSIDE, start)
    assert np.gradient(gaits.period, gaits.onset)[1:-1] == pytest.approx(
        gaits.slope[1:-1], abs=1e-6
    )


@settings(max_examples=25, derandomize=True, deadline=None)
@given(
    leg_angle=st.floats(0.35, 0.62),
    push=st.floats(0.05, 0.95),
    fraction=st.floats(-0.2, 0.3),
    width=st.floats(0.03, 0.5),
    place=st.floats(0.02, 0.98),
    branch=st.sampled_from(["early", "inside", "late"]),
)
def test_gaits_of_any_walker_are_walked(leg_angle, push, fraction, width, place, branch):
    try:
        bounds = existence(leg_angle)
        parameters = WalkerParameters(
            leg_angle=leg_angle,
            ankle_stiffness=bounds[0] + push * (bounds[1] - bounds[0]),
        )
    except ParameterError:
        assume(False)
    torque = fraction * parameters.peak_torque
    try:
        gait = PulsedGait(parameters, torque, width)
    except ValueError:
        assume(False)
    struck, off, start, end = gait.heel_strike, gait.toe_off, gait.last_start, gait.first_end
    if branch == "early":
        gaits = gait.gaits(Place.EARLY, np.array([struck + place * (end - struck)]))
    elif branch == "inside":
        gaits = gait.gaits(Place.INSIDE, np.array([struck + place * (start - struck)]))
    else:
        gaits = gait.gaits(Place.LATE, np.array([start + place * (off - start)]))
    assume(bool(gaits.feasible[0]))
    one = gaits.at(0)
    walked = walk_a_stride(parameters, gait.speed(one.apex), one.onset, torque, width)
    assert walked is not None
    sensitivity = 1 + np.abs(one.jacobian).max()
    assert walked[0] == pytest.approx(one.period, abs=3e-9 * sensitivity)


def existence(leg_angle):
    """Return the stiffness range with a gait, from the error for an absurd stiffness."""
    try:
        WalkerParameters(leg_angle=leg_angle, ankle_stiffness=1e6)
    except ParameterError as error:
        words = str(error).split("allowed: ")
        if len(words) == 2 and "N m/rad" in words[1]:
            return [float(word) for word in words[1].split(" N")[0].split(" to ")]
        raise
    raise AssertionError("a stiffness of 1e6 was accepted")


def test_a_pulse_longer_than_a_step_is_refused():
    with pytest.raises(ValueError, match=r"width: 1 s; .* a step, 0\.9666 s"):
        PulsedGait(TABLE_1, 13.3, 1.0)
