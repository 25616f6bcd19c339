# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Stamps: nanoseconds in and out without loss."""

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_nodes.messaging.stamps import header, to_time

# What a ROS stamp can hold: seconds are signed, nanoseconds are not.
instants = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)


@settings(derandomize=True, deadline=None)
@given(instants)
def test_no_nanosecond_is_lost(instant):
    stamp = to_time(instant)
    assert 0 <= stamp.nanosec < 10**9
    assert nanoseconds_of(stamp) == instant
    assert nanoseconds_of(header(instant).stamp) == instant
    assert header(instant).frame_id == ""
