# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The driver of ros2_control robots with an emulated effort controller in another process."""

import json
import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest
from sensor_msgs.msg import JointState

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, LimitError, PulseTrain, find_driver
from gait_entrainment_commands import main
from gait_entrainment_drivers.conformance.bench import DriverBench, Tolerances, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS
from gait_entrainment_drivers.proof import proof_of
from gait_entrainment_nodes import ros2_control
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import claimed_domain

EMULATED = Path(__file__).with_name("emulated_controller.py")
MANAGED = pytest.mark.skipif(
    find_spec("controller_manager_msgs") is None,
    reason="controller_manager has its own service types: install controller_manager_msgs",
)
# A shared machine wakes processes up late; the limits have their own tests.
PATIENT = Tolerances(
    onset=0.25, zero_within=1.0, watchdog=1.6, call=0.1, slowest_call=2.0, impulse=0.6
)


@contextmanager
def controller(*options, **driver):
    """Run an emulated controller in its own domain; yield the driver's text."""
    with claimed_domain() as domain:
        process = subprocess.Popen(
            [sys.executable, str(EMULATED), str(domain), *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout.readline() == "ready\n"
            chosen = {"domain": domain, "rate": 200, "silence": 0.3, "lateness": 0.5, **driver}
            yield "ros2_control:" + ",".join(f"{k}={v}" for k, v in chosen.items())
        finally:
            process.kill()
            process.wait(10)
            process.stdout.close()


def robot_on(text):
    return find_driver(text).make(Side.RIGHT)


def pushed(robot, torque):
    """Push; return the states until the torque is reached."""
    robot.configure()
    robot.activate()
    robot.arm()
    robot.begin(time.time_ns())
    onset = time.time_ns() + 50_000_000
    robot.schedule(PulseTrain.periodic(Side.RIGHT, onset, 1.0, 1, torque, 0.4))
    states, give_up = [], time.monotonic() + 10
    while not states or abs(states[-1].measured - torque) > 0.05 * abs(torque):
        assert time.monotonic() < give_up, robot.faults
        robot.heard()
        states += robot.read()
        time.sleep(0.005)
    return states


# Checks of what this driver itself does; guard and loop are checked with the other drivers.
OF_THE_DRIVER = {
    "lifecycle",
    "pulses",
    "cancelling",
    "stopping_in_mid_pulse",
    "deactivating",
    "reconnecting",
    "silent_host",
    "states",
}


def test_a_controller_that_times_out_keeps_every_promise():
    with controller("--timeout=0.4") as text:
        bench = DriverBench(find_driver(text), PATIENT)
        chosen = [check for check in CHECKS if check.__name__ in OF_THE_DRIVER]
        assert len(chosen) == len(OF_THE_DRIVER)
        results = [run_check(check, bench) for check in chosen]
    assert [result for result in results if not result.kept] == []


def test_a_controller_that_holds_its_last_command_is_caught(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with controller() as text:
        assert main(["driver", "prove", text, "--arm", "--json"]) == 1
    (check,) = json.loads(capsys.readouterr().out)["checks"]
    assert re.match(
        "holds its last command when the host is silent: 8 N m were measured after 2.. ms",
        check["broken"],
    )
    assert proof_of(text) is None


def test_torque_and_angle_are_those_of_the_ankle():
    with controller(ratio=-2.0) as text, robot_on(text) as robot:
        state = pushed(robot, 6.0)[-1]
        assert state.measured == pytest.approx(6.0, rel=0.06)
        assert state.angle == pytest.approx(-0.05)
        assert not robot.faults


def test_a_robot_in_the_domain_of_the_run_needs_its_own_names(monkeypatch):
    with controller("--namespace=exo", "--joint-states=exo_states", "--timeout=0.6") as text:
        domain = re.search(r"domain=(\d+)", text)[1]
        monkeypatch.setenv("ROS_DOMAIN_ID", domain)
        with pytest.raises(DeviceError, match=r"is that of the run .*allowed: another d"):
            robot_on(text).configure()
        with robot_on(f"{text},namespace=/exo,joint_states=exo_states") as robot:
            pushed(robot, 6.0)


def test_states_of_other_joints_do_not_take_the_place_of_this_one():
    with controller("--rate=1") as text:
        options = find_driver(text).options
        device = ros2_control.EffortJoint(options)
        device.open()
        with Client("broadcasters", domain=options.domain) as client:
            publisher = client.node.create_publisher(JointState, options.joint_states, 10)
            assert client.wait(publisher.get_subscription_count, 10)
            for _ in range(20):
                for name in (options.joint, "hip"):
                    message = JointState(name=[name], effort=[0.0])
                    message.header.stamp = client.node.get_clock().now().to_msg()
                    publisher.publish(message)
                assert device.exchange(0.0, 0.2) is not None
        device.shut()


@pytest.mark.parametrize(
    ("options", "driver", "words"),
    [
        (
            [],
            {"joint": "hip"},
            "joint hip .*: it is not in joint_states: start its joint state b",
        ),
        (["--no-effort"], {}, "joint ankle reports no effort: its hardware must export one"),
        (["--deaf"], {}, "no node hears /effort_controller/commands: load and configure"),
        (["--behind=2"], {}, r"joint_states are 2\S* s old on arrival: synchronize"),
    ],
)
def test_what_is_missing_is_reported_in_one_line(options, driver, words, monkeypatch):
    monkeypatch.setattr(ros2_control, "_DISCOVERY_TIMEOUT", 2.0)
    with controller(*options, **driver) as text:
        device = ros2_control.EffortJoint(find_driver(text).options)
        with pytest.raises(DeviceError, match=words) as error:
            device.open()
        device.shut()
    assert "\n" not in str(error.value)


@MANAGED
@pytest.mark.parametrize("state", ["inactive", "active"])
def test_controller_manager_activates_and_deactivates_the_controller(state, tmp_path):
    trace = tmp_path / "trace"
    options = (f"--manager=effort_controller={state}", f"--trace={trace}")
    with controller("--timeout=0.6", *options) as text, robot_on(text) as robot:
        pushed(robot, 6.0)
        robot.deactivate()
        robot.activate()
        assert not robot.faults
    first = [] if state == "active" else ["active"]
    assert trace.read_text().split() == [*first, "inactive", "active", "inactive"]


@MANAGED
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--manager=effort_controller=unconfigured"],
            "did not make effort_controller active; it is unconfigured: Controller with name",
        ),
        (
            ["--manager=other_controller=active"],
            "controller_manager has no effort_controller: load it; has: other_controller",
        ),
        (
            ["--manager=effort_controller=inactive", "--silent"],
            "controller_manager does not answer: check that it is running",
        ),
    ],
)
def test_what_controller_manager_refuses_is_reported_in_one_line(options, words):
    with controller("--timeout=0.6", *options) as text, robot_on(text) as robot:
        robot.configure()
        with pytest.raises(DeviceError, match=words) as error:
            robot.activate()
    assert "\n" not in str(error.value)


def test_a_second_master_is_a_named_fault():
    with controller("--timeout=0.6") as text, robot_on(text) as robot:
        pushed(robot, 6.0)
        domain = re.search(r"domain=(\d+)", text)[1]
        other = subprocess.Popen(
            [sys.executable, "-c", _OTHER], env={**os.environ, "ROS_DOMAIN_ID": domain}
        )
        try:
            give_up = time.monotonic() + 20
            while not robot.faults:
                assert time.monotonic() < give_up
                robot.heard()
                robot.promise(time.time_ns())
                robot.read()
                time.sleep(0.01)
        finally:
            other.kill()
            other.wait()
        assert [fault.name for fault in robot.faults] == ["second_master"]
        robot.close()


_OTHER = """
import rclpy
from std_msgs.msg import Float64MultiArray
rclpy.init()
node = rclpy.create_node("other")
node.create_publisher(Float64MultiArray, "/effort_controller/commands", 1)
rclpy.spin(node)
"""


def test_only_one_of_our_drivers_may_command_a_controller():
    with controller("--timeout=0.6") as text, robot_on(text) as first:
        pushed(first, 6.0)
        with pytest.raises(DeviceError, match=r"effort_controller in ROS domain \d+ is in use by"):
            robot_on(f"{text},joint=knee").configure()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("ratio=0", "ratio: 0; allowed: any other number"),
        ("joint_index=1", r"joint_index: 1; allowed: below joint_count \(1\)"),
    ],
)
def test_a_wrong_option_is_reported(options, words):
    with pytest.raises(LimitError, match=words):
        find_driver(f"ros2_control:{options}")
