# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The lateness histogram, checked against the sorted values."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_nodes.nodes.lateness import BINS_PER_DECADE, LONGEST, SHORTEST, Lateness

late = st.floats(SHORTEST, LONGEST)


@settings(derandomize=True, deadline=None)
@given(st.lists(late, min_size=1, max_size=200), st.sampled_from([0.5, 0.99, 1.0]))
def test_quantile_is_that_of_the_values_to_the_width_of_a_bin(values, fraction):
    lateness = Lateness()
    for value in values:
        lateness.add(value)
    exact = sorted(values)[math.ceil(fraction * len(values)) - 1]
    assert lateness.count == len(values)
    assert lateness.worst == max(values)
    width = 10 ** (1 / BINS_PER_DECADE)
    assert exact * (1 - 1e-9) <= lateness.quantile(fraction) <= exact * width * (1 + 1e-9)


def test_no_values_and_values_out_of_range():
    lateness = Lateness()
    assert math.isnan(lateness.quantile(0.5))
    lateness.add(-1.0)
    assert lateness.quantile(0.5) == SHORTEST
    lateness.add(1e9)
    assert lateness.worst == LONGEST
