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

"""One list of nodes, one set of parameters: every name in it is one that the node declares."""

import pytest

from gait_entrainment.protocol import DEFAULT_PROTOCOL
from gait_entrainment_nodes.node_list import NODES, PUBLISHERS, STOP_ORDER, parameters


@pytest.mark.parametrize("real_time", [False, True])
def test_parameters_are_given_to_every_node(real_time):
    given = parameters(
        DEFAULT_PROTOCOL, "/bag", "{}", real_time=real_time, sampling={"sample_rate": 100.0}
    )
    assert set(given) == set(NODES)
    walker = given["walker_sim"]
    assert walker["ankle_stiffness"] == 87.3
    assert walker["sample_rate"] == 100.0
    assert walker["real_time"] is real_time
    # Only in lock-step does the walker wait for the recorder.
    assert walker["acknowledged"] is not real_time
    assert ("longest_lookahead" in given["experiment"]) is real_time
    sides = {given["perturbator"]["side"], given["gait_analyzer"]["side"]}
    assert sides == {"right"} == {walker["first_heel_strike"]}
    assert given["bag_recorder"]["publishers"] == list(PUBLISHERS)
    assert given["bag_recorder"]["required"] is False
    assert "experiment" not in given["experiment"]["participants"]


def test_torque_is_stopped_first_and_the_record_last():
    assert sorted(STOP_ORDER) == sorted(NODES)
    assert STOP_ORDER[0] == "perturbator"
    assert STOP_ORDER[-1] == "bag_recorder"
    assert set(PUBLISHERS) == set(NODES) - {"bag_recorder"}
