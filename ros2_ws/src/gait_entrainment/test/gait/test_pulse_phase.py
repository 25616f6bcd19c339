# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Nearest toe-off and phase lag: hand-computed cases and a search over all toe-offs."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Stride
from gait_entrainment.gait.pulse_phase import (
    LagFollower,
    depends_on_next_toe_off,
    nearest_toe_off,
)


def stride(number: int, start: int, end: int, toe_off: int | None) -> Stride:
    return Stride(number, Side.RIGHT, start, end, toe_off, (math.nan, math.nan))


BEFORE = stride(1, 0, 200, 130)
OWN = stride(2, 200, 400, 330)
AFTER = stride(3, 400, 600, 430)


def test_toe_off_of_the_same_stride() -> None:
    assert nearest_toe_off(300, OWN, BEFORE, AFTER) == (330, 2)
    assert nearest_toe_off(330, OWN, BEFORE, AFTER) == (330, 2)
    assert nearest_toe_off(365, OWN, BEFORE, None) == (330, 2)  # as near to the heel strike


def test_toe_off_of_the_previous_stride_wins_a_tie() -> None:
    assert nearest_toe_off(229, OWN, BEFORE, AFTER) == (130, 1)
    assert nearest_toe_off(230, OWN, BEFORE, AFTER) == (130, 1)  # 100 from both
    assert nearest_toe_off(231, OWN, BEFORE, AFTER) == (330, 2)


def test_toe_off_of_the_next_stride_loses_a_tie() -> None:
    assert nearest_toe_off(380, OWN, BEFORE, AFTER) == (330, 2)  # 50 from both
    assert nearest_toe_off(381, OWN, BEFORE, AFTER) == (430, 3)


def test_only_an_onset_nearer_to_the_heel_strike_than_to_toe_off_looks_ahead() -> None:
    assert not depends_on_next_toe_off(365, OWN)
    assert depends_on_next_toe_off(366, OWN)
    assert not depends_on_next_toe_off(399, stride(2, 200, 400, None))


def test_missing_toe_off_that_might_be_nearest_leaves_the_lag_unknown() -> None:
    assert nearest_toe_off(300, stride(2, 200, 400, None), BEFORE, AFTER) is None
    for missing in (None, stride(1, 0, 200, None)):
        assert nearest_toe_off(264, OWN, missing, AFTER) is None
        assert nearest_toe_off(265, OWN, missing, AFTER) == (330, 2)  # 65 < the 65+ before 200
    for missing in (None, stride(3, 400, 600, None)):
        assert nearest_toe_off(366, OWN, BEFORE, missing) is None


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.lists(st.tuples(st.integers(2, 50), st.floats(0.01, 0.99)), min_size=3, max_size=3))
def test_agrees_with_a_search_over_all_toe_offs(shapes: list[tuple[int, float]]) -> None:
    strides, start = [], 0
    for number, (length, fraction) in enumerate(shapes, start=1):
        toe_off = start + min(max(round(fraction * length), 1), length - 1)
        strides.append(stride(number, start, start + length, toe_off))
        start += length
    before, own, after = strides
    for onset in range(own.start, own.end):
        nearest = min((abs(onset - s.toe_off), s.toe_off, s.number) for s in strides if s.toe_off)
        assert nearest_toe_off(onset, own, before, after) == nearest[1:]


def test_lag_is_followed_across_a_wrap() -> None:
    follower = LagFollower()
    second = 1_000_000_000
    # Strides of 2 s with toe-off at 1.2 s, pulses every 1.5 s: half a second earlier each time.
    walk = [stride(k, (2 * k - 2) * second, 2 * k * second, 2 * k * second - second * 4 // 5)
            for k in range(1, 8)]  # fmt: skip
    placed = []
    for n in range(6):
        onset = 3 * second + n * second * 3 // 2
        k = onset // (2 * second)
        placed.append(follower.place(n + 1, onset, walk[k], walk[k - 1], walk[k + 1], 2.0))
    assert [p.stride for p in placed] == [2, 3, 4, 4, 5, 6]
    assert [p.phase for p in placed] == [0.5, 0.25, 0.0, 0.75, 0.5, 0.25]
    assert [p.phase_lag for p in placed] == [-0.2, -0.7, 0.8, 0.3, -0.2, -0.7]
    for n, pulse in enumerate(placed):
        assert math.isclose(pulse.unwrapped_lag, -0.2 - 0.5 * n, abs_tol=1e-12)


def test_unknown_unperturbed_period_spoils_only_wrapped_lags() -> None:
    follower = LagFollower()
    first = follower.place(1, 300, OWN, BEFORE, AFTER, math.nan)
    second = follower.place(2, 420, AFTER, OWN, None, math.nan)
    wrapped = follower.place(3, 425, AFTER, OWN, None, math.nan)
    assert first.unwrapped_lag == first.phase_lag == -30e-9
    assert second.unwrapped_lag == second.phase_lag == -10e-9
    assert math.isnan(wrapped.unwrapped_lag)
    assert wrapped.phase_lag == -5e-9


def test_missing_toe_off_leaves_phase_and_stride_known() -> None:
    pulse = LagFollower().place(4, 250, stride(2, 200, 400, None), BEFORE, AFTER, 2.0)
    assert (pulse.number, pulse.stride, pulse.phase, pulse.toe_off) == (4, 2, 0.25, None)
    assert math.isnan(pulse.phase_lag)
    assert math.isnan(pulse.unwrapped_lag)
