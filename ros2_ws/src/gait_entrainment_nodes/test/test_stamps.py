# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Stamps: nanoseconds in and out without loss."""

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_nodes.stamps import header, to_nanoseconds, to_time

# What a ROS stamp can hold: seconds are signed, nanoseconds are not.
instants = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)


@settings(derandomize=True, deadline=None)
@given(instants)
def test_no_nanosecond_is_lost(instant):
    stamp = to_time(instant)
    assert 0 <= stamp.nanosec < 10**9
    assert to_nanoseconds(stamp) == instant
    assert to_nanoseconds(header(instant).stamp) == instant
    assert header(instant).frame_id == ""
