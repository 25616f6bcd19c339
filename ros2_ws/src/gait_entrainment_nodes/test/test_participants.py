# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A participant's clock: its offset from a request and its answer, and when it is reported."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gait_entrainment_nodes.nodes.experiment_run import ExperimentError
from gait_entrainment_nodes.nodes.participants import ClockError, ClockOffset

MS = 1_000_000


@given(
    offset=st.integers(-(10**12), 10**12),
    there=st.integers(0, 10**9),
    back=st.integers(0, 10**9),
    asked=st.integers(0, 2 * 10**18),
)
def test_the_true_offset_lies_within_the_uncertainty(offset, there, back, asked):
    reported = asked + there + offset
    found = ClockOffset.measured(asked, reported, asked + there + back)
    assert abs(found.offset - offset / 1e9) <= found.uncertainty + 1e-6


def test_a_clock_that_is_off_is_an_error_and_one_that_cannot_be_compared_is_asked_again():
    ClockOffset.measured(0, 7 * MS, 4 * MS).check("walker_sim", 0.005)
    with pytest.raises(ClockError, match=r"walker_sim is 300.0 ms ahead of this one; allowed: 5"):
        ClockOffset.measured(0, 302 * MS, 4 * MS).check("walker_sim", 0.005)
    with pytest.raises(ClockError, match=r"300.0 ms behind"):
        ClockOffset.measured(0, -298 * MS, 4 * MS).check("walker_sim", 0.005)
    with pytest.raises(ExperimentError, match="too slowly") as slow:
        ClockOffset.measured(0, 20 * MS, 40 * MS).check("walker_sim", 0.005)
    assert not isinstance(slow.value, ClockError)
