# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The pendulum's closed form, and the quadratures that stand in for it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf, quad, sqrt
from mpmath import sin as mp_sin
from scipy.special import elliprf

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker.model import make_model
from gait_entrainment.walker.segment import SEGMENT, WORK_SIZE, short_cosine, short_sine
from gait_entrainment.walker.single_stance import carlson_rf, pendulum_time, turning_point
from gait_entrainment.walker.transitions import look_ahead_single_stance, whole_time

SETTINGS = settings(derandomize=True, deadline=None, max_examples=100)
PER_DROP = 2 * 9.81
MODEL = make_model(WalkerParameters())


@SETTINGS
@given(x=st.floats(0, 10), y=st.floats(1e-9, 10), z=st.floats(1e-9, 10))
def test_carlson_rf_is_scipys(x, y, z):
    assert carlson_rf(x, y, z) == pytest.approx(elliprf(x, y, z), rel=3e-15)


@SETTINGS
@given(
    apex=st.floats(-8, 1) | st.floats(0.001, 8),
    first=st.floats(-0.6, 0.6),
    last=st.floats(-0.6, 0.6),
)
def test_pendulum_time_is_the_integral(apex, first, last):
    start, end = sorted((first, last))
    rates = [apex + PER_DROP * (1 - math.cos(x)) for x in np.linspace(start, end, 101)]
    if end - start < 1e-3 or min(rates) < 1e-3:
        return
    mp.dps = 25
    a = mpf(apex)
    ways = [start, 0, end] if start < 0 < end else [start, end]
    exact = quad(lambda x: 1 / sqrt(a + 2 * PER_DROP * mp_sin(x / 2) ** 2), ways)
    assert pendulum_time(PER_DROP, apex, start, end) == pytest.approx(float(exact), rel=1e-12)


def test_pendulum_time_over_no_distance_is_zero():
    assert pendulum_time(PER_DROP, 1.0, 0.3, 0.3) == 0.0


@pytest.mark.parametrize("apex", [-0.2, -1e-3, -1e-9, -1e-30])
def test_time_to_the_turning_point(apex):
    """Against the same integral in w with sin(theta / 2) = s cosh(w), where s is the turn's."""
    position, time = turning_point(MODEL, apex)
    s = math.sqrt(-apex / (2 * PER_DROP))
    assert position == pytest.approx(-2 * math.asin(s), rel=1e-12)
    mp.dps = 30
    turn = mpf(s)
    ratio = sqrt(mpf(float(MODEL["toe_off_half_sine"]))) / turn
    end = mp.acosh(ratio)
    exact = quad(lambda w: 1 / sqrt(1 - (turn * mp.cosh(w)) ** 2), [0, end / 2, end]) / sqrt(
        mpf(PER_DROP) / 2
    )
    assert time == pytest.approx(float(exact), rel=1e-9)


def test_whole_single_stance_is_the_pendulums_time_from_its_least_apex_on():
    work = np.empty(WORK_SIZE)
    start, end = float(MODEL["toe_off_position"]), float(MODEL["strike_position"])
    least = float(MODEL["whole_single_stance_apex"])
    # The period-one gait, at 0.77 / s^2, must be on the quick side.
    assert 0 < least < 0.6
    for apex in least * np.geomspace(1, 100, 40):
        quick = whole_time(MODEL["whole_single_stance"], work, apex)
        assert quick == pytest.approx(pendulum_time(PER_DROP, apex, start, end), rel=1e-15)


def test_slow_single_stance_takes_the_closed_form():
    work, segment = np.empty(WORK_SIZE), np.zeros(1, SEGMENT)[0]
    apex = 0.01
    segment["stance"], segment["position"], segment["apex"] = 1, MODEL["toe_off_position"], apex
    look_ahead_single_stance(MODEL, segment, work)
    start, end = float(MODEL["toe_off_position"]), float(MODEL["strike_position"])
    expected = pendulum_time(PER_DROP, apex, start, end)
    assert segment["duration"] == pytest.approx(expected, rel=1e-15)


@SETTINGS
@given(x=st.floats(-0.8, 0.8))
def test_short_series_are_sine_and_cosine(x):
    assert short_sine(x) == pytest.approx(math.sin(x), rel=3e-16, abs=1e-300)
    assert short_cosine(x) == pytest.approx(math.cos(x), rel=3e-16)
