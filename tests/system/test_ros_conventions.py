# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a ROS engineer expects of any node: parameters, diagnostics, the graph, over real DDS."""

import os
from itertools import pairwise
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from graph import BLOCK, README, graph
from harness import QUICK, probe, session
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter

from gait_entrainment.conventions import Side
from gait_entrainment_bringup.node_list import NODES
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.topics import (
    DIAGNOSTICS,
    HORIZON,
    JOINT_STATES,
    STRIDES,
    TORQUE_PROFILE,
)

BAG = Path(__file__).parents[2] / "bags/paper_example"
# rclpy's own, which may lack a description.
OF_RCLPY = ("use_sim_time", "start_type_description_service")


class Parameters:
    """The parameter services of a node."""

    def __init__(self, listener, node):
        self.probe, self.node = listener, node

    def call(self, kind, service, **fields):
        return self.probe.call(kind, f"{self.node}/{service}", kind.Request(**fields))

    def described(self):
        """Return descriptor and value of each parameter that is ours, by name."""
        names = self.call(ListParameters, "list_parameters").result.names
        names = [n for n in names if n not in OF_RCLPY and not n.startswith("qos_overrides.")]
        descriptors = self.call(DescribeParameters, "describe_parameters", names=names).descriptors
        values = self.call(GetParameters, "get_parameters", names=names).values
        return {d.name: (d, value) for d, value in zip(descriptors, values, strict=True)}

    def put(self, **values):
        """Set parameters, one by one; return why each was refused, or an empty text."""
        messages = [
            Parameter(n.replace("__", "."), value=v).to_parameter_msg() for n, v in values.items()
        ]
        return self.put_messages(messages)

    def put_messages(self, messages):
        results = self.call(SetParameters, "set_parameters", parameters=messages).results
        assert all(result.successful == (not result.reason) for result in results)
        return [result.reason for result in results]


def assert_in_order(parameters):
    """
    Check that all parameters are described and that wrong values are refused with a reason.

    Setting each to its present value, as `ros2 param dump` and `load` do, is never refused.
    """
    described = parameters.described()
    assert described
    names = parameters.call(ListParameters, "list_parameters").result.names
    values = parameters.call(GetParameters, "get_parameters", names=names).values
    dumped = [ParameterMessage(name=n, value=v) for n, v in zip(names, values, strict=True)]
    assert not any(parameters.put_messages(dumped))
    wrong, named = [], []
    for name, (descriptor, value) in described.items():
        assert len(descriptor.description) > 5, name
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        if value.type in (ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_INTEGER):
            assert descriptor.description.endswith("]"), name
            assert len(ranges) == 1, name
        if descriptor.read_only:
            other = ParameterValue(type=value.type, string_value="other")
            other.bool_value, other.string_array_value = not value.bool_value, ["other"]
            other.double_value, other.integer_value = value.double_value + 1, 1
            wrong.append((name, other))
            named.append("read-only")
            continue
        if value.type == ParameterType.PARAMETER_DOUBLE:
            beyond = [2 * ranges[0].to_value + 1.0, ranges[0].from_value - 1.0, float("nan")]
            wrong += [(name, ParameterValue(type=value.type, double_value=v)) for v in beyond]
        elif value.type == ParameterType.PARAMETER_INTEGER:
            beyond = [ranges[0].to_value + 1, ranges[0].from_value - 1]
            wrong += [(name, ParameterValue(type=value.type, integer_value=v)) for v in beyond]
        elif descriptor.additional_constraints not in ("", "any text"):
            wrong.append((name, ParameterValue(type=value.type, string_value="elsewhere")))
        named += [name] * (len(wrong) - len(named))
        wrong.append((name, ParameterValue(type=ParameterType.PARAMETER_BYTE_ARRAY)))
        named.append("type")
    time = values[names.index("use_sim_time")]
    other = ParameterValue(type=time.type, bool_value=not time.bool_value)
    wrong.append(("use_sim_time", other))
    named.append("use_sim_time")
    messages = [ParameterMessage(name=name, value=value) for name, value in wrong]
    for message, word, reason in zip(
        messages, named, parameters.put_messages(messages), strict=True
    ):
        assert word in reason, message
        assert len(reason.splitlines()) == 1
    assert {n: v for n, (_, v) in parameters.described().items()} == {
        n: v for n, (_, v) in described.items()
    }


def states(heard):
    """Return the latest state of each node in the diagnostics received."""
    statuses = [status for array in heard for status in array.status]
    return {s.name: s for s in statuses if s.name.endswith(": state")}


def test_nodes_of_an_experiment_behave_as_ros_users_expect(tmp_path):
    options = (*QUICK, "--baseline=1000000")
    with session(tmp_path, *options, real_time=False) as nodes:
        listener = nodes.probe
        params = {node: Parameters(listener, node) for node in NODES}
        for parameters in params.values():
            assert_in_order(parameters)

        # Before a run, parameters that may change do, and the run uses them.
        assert params["walker_sim"].put(sample_rate=50.0) == [""]
        (reason,) = params["walker_sim"].put(ankle_stiffness=40.0)
        assert "ankle_stiffness" in reason  # within its range, but no walker has it
        assert params["experiment"].put(longest_lookahead=0.25) == [""]
        assert params["gait_analyzer"].put(side="left", verdict__window=10) == ["", ""]
        assert params["perturbator"].put(side="left") == [""]
        (reason,) = params["perturbator"].put(driver="magic")
        assert "ideal" in reason
        heard = listener.listen(DIAGNOSTICS)
        listener.until(lambda: len(states(heard)) == len(NODES), "a state of each node")
        assert set(states(heard)) == {f"{node}: state" for node in NODES}
        for status in states(heard).values():
            assert status.level == DiagnosticStatus.OK
            assert status.message
            assert status.hardware_id == ("ideal" if "perturbator" in status.name else "none")

        strides, horizons = listener.listen(STRIDES), listener.listen(HORIZON)
        profiles, joints = listener.listen(TORQUE_PROFILE), listener.listen(JOINT_STATES)
        handle = nodes.conduct()
        listener.until(lambda: len(strides) > 2, "strides")
        assert {stride.side for stride in strides} == {Side.LEFT}
        assert profiles[0].side == Side.LEFT
        assert max(lead(horizon) for horizon in horizons) <= 0.25
        assert spacing(joints) == pytest.approx(0.02, abs=1e-9)

        # During a run a change is refused, except for parameters that may change.
        for node, values in {
            "walker_sim": {"mass": 6.0},
            "experiment": {"longest_lookahead": 0.3},
            "gait_analyzer": {"verdict__window": 12},
        }.items():
            (reason,) = params[node].put(**values)
            assert "run 1 is in progress" in reason
        (reason,) = params["perturbator"].put(limits__torque=5.0)
        assert "configured" in reason
        assert params["experiment"].put(silence_timeout=2.5) == [""]
        listener.until(
            lambda: "run 1" in states(heard)["experiment: state"].message, "the state of the run"
        )
        handle.cancel_goal_async()
        assert listener.result(handle).result.outcome == RunProtocol.Result.CANCELLED
        listener.until(lambda: params["experiment"].put(longest_lookahead=0.3) == [""], "the end")
        # A goal is YAML text, even if it is a single line, and never names a file on the host.
        for goal, reason in {
            "{baseline: 0}": "baseline: 0; allowed",
            str(BAG / "protocol.yaml"): "must be a mapping",
        }.items():
            kind, request = RunProtocol, RunProtocol.Goal(protocol=goal)
            handle = listener.send_goal(kind, "experiment/run_protocol", request)
            result = listener.result(handle).result
            assert (result.outcome, reason in result.message) == (result.FAILED, True)
        assert graph(listener) == BLOCK.search(README.read_text())[0], (
            "python tests/system/graph.py"
        )


def lead(horizon):
    begin, until = horizon.header.stamp, horizon.until
    return until.sec - begin.sec + 1e-9 * (until.nanosec - begin.nanosec)


def spacing(samples):
    """Return the most frequent interval [s] between samples; gait events add samples."""
    stamps = [s.header.stamp.sec * 10**9 + s.header.stamp.nanosec for s in samples]
    gaps = [b - a for a, b in pairwise(stamps)]
    return max(set(gaps), key=gaps.count) / 1e9


def test_rate_parameter_of_the_player_agrees_with_its_service(tmp_path):
    with claimed_domain() as domain, probe(domain) as listener:
        supervisor = Supervisor(tmp_path, {**os.environ, "ROS_DOMAIN_ID": str(domain)})
        given = ["-p", f"bag:={BAG}", "-p", "start_paused:=true"]
        supervisor.start("bag_player", ["--ros-args", *given])
        try:
            parameters = Parameters(listener, "bag_player")
            assert_in_order(parameters)
            assert parameters.put(rate=4.0) == [""]
            assert listener.call(srv.GetRate, "bag_player/get_rate").rate == 4.0
        finally:
            supervisor.stop(["bag_player"])
