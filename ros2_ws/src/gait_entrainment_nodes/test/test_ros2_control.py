# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How the driver for ros2_control robots reads a joint's states, without a robot."""

import math
import time
from types import SimpleNamespace

import pytest
from sensor_msgs.msg import JointState

from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.ros2_control import EffortJoint, Ros2ControlOptions


def reading(publishers=1, subscribers=1, **state):
    joint = EffortJoint(Ros2ControlOptions())
    joint._node = SimpleNamespace(count_publishers=lambda _: publishers)
    joint._commands = SimpleNamespace(
        topic_name="commands", get_subscription_count=lambda: subscribers
    )
    values = {"name": ["knee", "ankle"], "position": [0.9, 0.1], "effort": [9.0, 1.0]} | state
    joint._on_state(JointState(header=header(time.time_ns()), **values))
    return joint._state and joint._reading(joint._state)


def test_the_joint_is_found_at_any_place_in_a_state():
    assert (reading().torque, reading().angle) == (1.0, 0.1)
    turned = reading(name=["ankle", "knee"])
    assert (turned.torque, turned.angle) == (9.0, 0.9)


@pytest.mark.parametrize("names", [[], ["knee"], ["ankle", "ankle"]])
def test_a_state_that_does_not_have_the_joint_exactly_once_is_ignored(names):
    assert reading(name=names) is None


@pytest.mark.parametrize("effort", [[], [9.0], [9.0, math.nan]])
def test_a_missing_effort_is_nan(effort):
    assert math.isnan(reading(effort=effort).torque)


@pytest.mark.parametrize(
    ("publishers", "subscribers", "faults"),
    [(1, 1, []), (2, 1, ["second_master"]), (1, 0, ["controller_gone"])],
)
def test_a_second_commander_and_a_missing_controller_are_faults(publishers, subscribers, faults):
    found = reading(publishers, subscribers).faults
    assert [fault.name for fault in found] == faults
