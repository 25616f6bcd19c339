# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The ODrive driver against its emulator in another process, hazards included."""

import contextlib

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, find_driver
from gait_entrainment_drivers.conformance.bench import DriverBench, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS
from gait_entrainment_drivers.odrive import (
    CLEAR_ERRORS,
    CLOSED_LOOP,
    HEARTBEAT,
    IDLE,
    SET_MODE,
    SET_STATE,
    SET_TORQUE,
    STATE,
    STOP,
    STOP_REQUESTED,
    TORQUE_MODE,
    WATCHDOG_EXPIRED,
    Heartbeat,
    frame_id,
    pack_torque,
    unpack_heartbeat,
)
from gait_entrainment_drivers.odrive_emulator import EmulatedOdrive

from .emulator_process import emulator, read_trace, until
from .test_ak_mit_can import enabled, follow, pulses
from .test_conformance import TOLERANT

NODE = 3


@contextlib.contextmanager
def axis(*options, trace=None):
    """Run an emulated axis; yield the text that selects the driver for it."""
    arguments = ("--node-id", str(NODE), *options)
    with emulator(
        *arguments, trace=trace, program="odrive_emulator", driver="odrive_can"
    ) as driver:
        yield f"{driver},node_id={NODE}"


def robot_on(driver):
    return find_driver(driver).make(Side.RIGHT)


@pytest.mark.parametrize("name", ["pulses", "stopping_in_mid_pulse", "reconnecting"])
def test_the_driver_keeps_its_promises(name):
    check = next(check for check in CHECKS if check.__name__ == name)
    with axis("--timeout", "0.9", "--loss", "0.01") as driver:
        result = run_check(check, DriverBench(find_driver(driver), TOLERANT))
    assert result.kept, result.broken


def test_an_error_disarms_and_is_a_fault_that_only_an_explicit_step_clears():
    with axis("--error", "0x2000", "--error-after", "0.1") as driver, robot_on(driver) as robot:
        enabled(robot)
        pulses(robot, duration=0.4)
        _, states = follow(robot, 5.0)
        # It stops following up to 0.1 s before its heartbeat arrives, so it was asked why.
        assert [fault.name for fault in robot.faults] == ["motor_too_hot"]
        assert max(state.measured for state in states) > 7
        robot.close()
        # The cause is still there.
        with pytest.raises(DeviceError, match=r"stays in state 1.*over-temperature of the motor"):
            enabled(robot)


def test_the_axis_reports_its_firmware():
    with axis() as driver, robot_on(driver) as robot:
        assert robot.identity == ""
        robot.configure()
        assert robot.identity == "ODrive 5.2.0, firmware 0.6.11"


def test_a_missing_axis_is_reported_with_those_that_are_present():
    with (
        axis() as driver,
        pytest.raises(DeviceError, match=r"ODrive 4 does not answer by CANSimple.*others do: 3"),
    ):
        robot_on(driver.replace(f"node_id={NODE}", "node_id=4")).configure()


def test_a_silent_axis_is_a_fault(tmp_path):
    trace = tmp_path / "trace"
    with (
        axis("--silent-after", "0.05", trace=trace) as driver,
        robot_on(driver) as robot,
    ):
        enabled(robot)
        pulses(robot, duration=0.5)
        follow(robot, 5.0)
        assert [fault.name for fault in robot.faults] == ["device_silent"]
        until(lambda: abs(read_trace(trace)[-1][2]) < 0.05)  # it still receives commands


class Axis(EmulatedOdrive):
    """An axis without a bus."""

    def __init__(self, timeout):
        super().__init__(NODE, bandwidth=1e3, timeout=timeout)

    def send(self, command, data, now):
        assert self.obey(frame_id(NODE, command), data, remote=False, now=now) == []

    def heartbeat(self, now):
        ((identifier, data),) = self.obey(frame_id(NODE, HEARTBEAT), b"", remote=True, now=now)
        assert identifier == frame_id(NODE, HEARTBEAT)
        return unpack_heartbeat(data)

    def push(self, now):
        self.send(SET_MODE, TORQUE_MODE, now)
        self.send(SET_TORQUE, pack_torque(10.0, 18.0), now)
        self.send(SET_STATE, STATE.pack(CLOSED_LOOP), now)


def test_the_emulated_axis_holds_its_command_unless_its_watchdog_is_on():
    held, guarded = Axis(timeout=0.0), Axis(timeout=0.1)
    for motor in (held, guarded):
        motor.push(1.0)
        motor.advance(1.09)
        assert motor.torque == pytest.approx(10.0)
        motor.heartbeat(1.05)  # a request does not feed the watchdog
        motor.advance(100.0)
        motor.advance(100.1)
    assert held.torque == pytest.approx(10.0)
    assert guarded.torque == pytest.approx(0.0)
    assert guarded.heartbeat(101.0) == Heartbeat(WATCHDOG_EXPIRED, IDLE)
    guarded.send(SET_STATE, STATE.pack(CLOSED_LOOP), 101.0)
    assert guarded.heartbeat(101.0).state == IDLE  # refused until errors are cleared
    guarded.send(CLEAR_ERRORS, bytes(1), 101.0)
    guarded.push(101.0)
    assert guarded.heartbeat(101.0) == Heartbeat(0, CLOSED_LOOP)


def test_the_emulated_axis_obeys_a_stop_unless_it_is_for_another_node():
    motor = Axis(timeout=0.0)
    motor.push(0.0)
    assert motor.obey(frame_id(NODE + 1, STOP), b"", remote=False, now=0.1) == []
    assert motor.heartbeat(0.1).state == CLOSED_LOOP
    motor.send(STOP, b"", 0.2)
    assert motor.heartbeat(0.3) == Heartbeat(STOP_REQUESTED, IDLE)
