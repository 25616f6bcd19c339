# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Pulse trains: what is asked for at an instant, and the impulse in a window, by brute force."""

from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import PulseTrain

MS = 1_000_000


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    first=st.integers(0, 5000 * MS),
    period=st.floats(0.02, 3.0),
    share=st.floats(0.01, 0.99),
    flank=st.floats(0.0, 0.5),
    instant=st.integers(0, 20_000 * MS),
)
def test_torque_at_an_instant_is_that_of_the_pulse_it_falls_into(
    first, period, share, flank, instant
):
    duration = period * share
    train = PulseTrain(Side.LEFT, first, period, 4, -8.0, duration, ramp=flank * duration)
    expected = 0.0
    for n in range(4):
        elapsed = (instant - first - round(n * period * 1e9)) / 1e9
        if 0 <= elapsed < round(duration * 1e9) / 1e9:
            rise = min(elapsed, duration - elapsed)
            expected = -8.0 * (min(rise / train.ramp, 1.0) if train.ramp else 1.0)
    assert abs(train.torque_at(instant) - expected) < 1e-5 * 8 / max(train.ramp, 1e-3)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    period=st.integers(20, 900),
    share=st.floats(0.1, 0.9),
    count=st.integers(1, 6),
    window=st.integers(10, 3000),
)
def test_impulse_in_a_window_is_the_largest_of_all_windows(period, share, count, window):
    width = max(int(period * share), 1)
    train = PulseTrain(Side.LEFT, 0, period / 1e3, count, 2.0, width / 1e3)
    on = np.zeros(count * period + window)
    for n in range(count):
        on[n * period : n * period + width] = 1
    sums = np.concatenate([[0.0], np.cumsum(on)])
    largest = (sums[window:] - sums[:-window]).max()
    assert abs(train.impulse_within(window / 1e3) - 2.0 * largest / 1e3) < 1e-9


@settings(derandomize=True, deadline=None, max_examples=300)
@given(
    first=st.integers(0, 2**62),
    period=st.floats(0.02, 3.0),
    number=st.integers(0, 20_000),
    share=st.floats(0.01, 0.99),
)
def test_each_pulse_begins_and_ends_at_its_nanosecond(first, period, number, share):
    train = PulseTrain(Side.LEFT, first, period, 20_001, 5.0, period * share)
    onset, end = train.onset(number), train.end(number)
    assert abs(onset - first - Fraction(period) * number * 10**9) <= Fraction(51, 100)
    assert (train.latest(onset - 1), train.latest(onset)) == (number - 1, number)
    assert train.onsets_within(onset, onset + 1) == (onset,)
    assert onset not in train.onsets_within(onset - 5, onset)
    assert (train.torque_at(end - 1), train.torque_at(end)) == (5.0, 0.0)
