# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The CAN drivers frame by frame: transmission, foreign frames, order of commands."""

import math

import can
import pytest

from gait_entrainment.robot import DeviceError
from gait_entrainment_drivers import odrive_can
from gait_entrainment_drivers.ak_mit import (
    ENTER,
    EXIT,
    FAULTS,
    MOTORS,
    AkMotor,
    Command,
    Reply,
    pack_command,
    pack_reply,
    resolution,
)
from gait_entrainment_drivers.ak_mit_can import AkMitCanOptions, AkMotorOnCan
from gait_entrainment_drivers.ak_motor_emulator import EmulatedAkMotor
from gait_entrainment_drivers.monitor import SECOND_MASTER
from gait_entrainment_drivers.odrive import (
    CLEAR_ERRORS,
    CLOSED_LOOP,
    ENCODER,
    HEARTBEAT,
    IDLE,
    PAIR,
    SET_MODE,
    STATE,
    STOP,
    TORQUE_MODE,
    TORQUES,
    Heartbeat,
    frame_id,
    pack_heartbeat,
)
from gait_entrainment_drivers.odrive_can import OdriveAxis, OdriveCanOptions
from gait_entrainment_drivers.odrive_emulator import EmulatedOdrive

AK = MOTORS["AK80-9"]
HOT = 0x2000  # an error of an ODrive
RATIOS = [-9.0, -0.5, 1.0, 3.0]


class Wire:
    """A bus with one motor; a second passes with each frame, which lets torque settle."""

    def __init__(self, motor):
        self.motor = motor
        self.sent = []
        self.strongest = 0.0  # largest torque so far [N m]
        self.waiting = []
        self.lost = set()  # ids of frames lost on the way to the motor
        self.echo = False  # whether the adapter returns sent frames
        self.now = 0.0

    def send(self, message):
        if message.arbitration_id in self.lost:
            return
        data = bytes(message.data)
        self.sent.append(data)
        assert not message.is_extended_id
        self.now += 1.0
        replies = self.motor.obey(
            message.arbitration_id, data, remote=message.is_remote_frame, now=self.now
        )
        self.motor.advance(self.now + 0.5)
        if not message.is_remote_frame:
            self.command = message
            self.waiting += [message] * self.echo
        self.strongest = max(self.strongest, abs(self.motor.torque))
        self.waiting += [
            can.Message(arbitration_id=identifier, data=answer, is_extended_id=False)
            for identifier, answer in replies
        ]

    def recv(self, timeout):  # noqa: ARG002
        return self.waiting.pop(0) if self.waiting else None

    def shutdown(self):
        pass


def ak(ratio=1.0, motor=None):
    robot = AkMotorOnCan(AkMitCanOptions(ratio=ratio))
    robot._bus = Wire(motor or EmulatedAkMotor(AK, 1, 100.0, 0.0, 8))
    return robot, robot._bus


def odrive(ratio=1.0):
    robot = OdriveAxis(OdriveCanOptions(ratio=ratio))
    robot._bus = Wire(EmulatedOdrive(0, 100.0, 0.0))
    return robot, robot._bus


@pytest.mark.parametrize("make", [ak, odrive])
@pytest.mark.parametrize("ratio", RATIOS)
def test_torque_goes_through_the_transmission_and_back(make, ratio):
    robot, wire = make(ratio)
    robot.enable()
    assert robot.capabilities.peak_torque == pytest.approx(18.0 * abs(ratio))
    step = resolution(AK)
    for torque in (4.0, -2.5):
        robot.exchange(torque, 1.0)
        assert wire.motor.torque == pytest.approx(torque / ratio, abs=step)
        reading = robot.exchange(torque, 1.0)
        assert reading.torque == pytest.approx(torque, abs=2 * step * abs(ratio))
    robot.exchange(0.0, 1.0)
    if make is ak:  # zero itself has no code
        assert robot.exchange(0.0, 1.0).torque == 0.0


@pytest.mark.parametrize("ratio", RATIOS)
def test_angle_and_torque_are_those_of_the_ankle(ratio):
    robot, wire = ak(ratio)
    wire.motor = SameAnswer([(0, pack_reply(Reply(1, 1.5, 0.0, 0.0), AK, 8))])
    assert robot.exchange(0.0, 1.0).angle == pytest.approx(1.5 / ratio, abs=1e-3 / abs(ratio))
    robot, wire = odrive(ratio)
    estimates = PAIR.pack(0.25, 0.0)  # a quarter of a turn
    wire.motor = SameAnswer(
        [(frame_id(0, ENCODER), estimates), (frame_id(0, TORQUES), PAIR.pack(7.0, 2.0))]
    )
    reading = robot.exchange(7.0, 1.0)
    assert reading.angle == pytest.approx(math.pi / 2 / ratio)
    assert reading.torque == pytest.approx(2.0 * ratio)  # the estimate, not the target


def test_an_odrive_with_its_heartbeat_switched_off_is_polled_for_it(monkeypatch):
    monkeypatch.setattr(odrive_can, "HEARTBEAT_PERIOD", 0.0)
    robot, wire = odrive()  # this bus carries answers only
    robot.enable()
    assert robot.exchange(1.0, 1.0).faults == ()
    wire.motor.obey(frame_id(0, STOP), b"", remote=False, now=wire.now)
    assert [fault.name for fault in robot.exchange(1.0, 1.0).faults] == ["emergency_stop"]


def faults_of(robot):
    """Return the faults of the second of two readings: by then everything has been polled."""
    return [robot.exchange(0.0, 1.0), robot.exchange(0.0, 1.0)][1].faults


def test_a_missing_odrive_heartbeat_is_a_named_fault(monkeypatch):
    robot, wire = odrive()
    robot.enable()
    assert faults_of(robot) == ()
    wire.lost.add(frame_id(0, HEARTBEAT))
    monkeypatch.setattr(odrive_can, "HEARTBEAT_LOST", 0.0)
    assert faults_of(robot) == (odrive_can.NO_HEARTBEAT,)


def test_the_angle_of_an_odrive_that_stops_reporting_it_becomes_nan(monkeypatch):
    robot, wire = odrive()
    robot.enable()
    assert [robot.exchange(0.0, 1.0), robot.exchange(0.0, 1.0)][1].angle == 0.0
    wire.lost.add(frame_id(0, ENCODER))
    monkeypatch.setattr(odrive_can, "HEARTBEAT_LOST", 0.0)
    assert math.isnan(robot.exchange(0.0, 1.0).angle)


@pytest.mark.parametrize("make", [ak, odrive])
@pytest.mark.parametrize("echo", [False, True])
def test_a_sender_of_identical_commands_is_a_second_master_but_an_echo_is_not(make, echo):
    robot, wire = make()
    robot.enable()
    for tick in range(150):
        wire.echo = echo and tick % 3 > 0  # some get lost
        assert SECOND_MASTER not in robot.exchange(0.0, 1.0).faults
    wire.waiting += [wire.command] * (120 if echo else 1)
    assert SECOND_MASTER in robot.exchange(0.0, 1.0).faults


@pytest.mark.parametrize("error", [HOT, 0])
def test_why_an_odrive_disarmed_is_known_before_its_heartbeat_arrives(error):
    robot, wire = odrive()
    robot.enable()
    assert faults_of(robot) == ()
    wire.lost.add(frame_id(0, HEARTBEAT))
    wire.motor.error = HOT
    wire.motor.advance(wire.now)
    wire.motor.error = error  # it may have cleared by now
    assert [fault.name for fault in faults_of(robot)] == ["motor_too_hot"]


def test_a_disarm_reason_from_before_enabling_is_not_a_fault():
    robot, wire = odrive()
    wire.lost.add(frame_id(0, CLEAR_ERRORS))
    wire.motor._reason = HOT
    robot.enable()
    assert faults_of(robot) == ()


class SameAnswer:
    """A motor that answers each frame in the same way."""

    torque = 0.0

    def __init__(self, frames):
        self.frames = frames

    def obey(self, identifier, data, *, remote, now):  # noqa: ARG002
        return self.frames

    def advance(self, now):
        pass


@pytest.mark.parametrize("make", [ak, odrive])
def test_a_command_left_in_the_motor_is_never_delivered(make):
    robot, wire = make()
    motor = wire.motor
    if make is odrive:
        motor._mode = TORQUE_MODE
    motor.command = 10.0  # left by a killed host
    robot.enable()
    assert motor.enabled
    assert wire.strongest < 0.01
    robot.exchange(10.0, 1.0)
    robot.shut()
    assert not motor.enabled
    assert abs(motor.command) < 0.01  # motors keep it across modes


def test_ak_motors_get_zero_before_each_mode_change():
    robot, wire = ak()
    zero = pack_command(Command(), AK)
    robot.enable()
    robot.disable()
    for change in (ENTER, EXIT):
        assert wire.sent[wire.sent.index(change) - 1] == zero


def test_a_mode_change_that_an_ak_motor_missed_is_repeated(monkeypatch):
    robot, wire = ak()
    send, missed = robot._tell, []

    def lose_the_first(data):
        if data == ENTER and not missed:
            missed.append(data)
        else:
            send(data)

    monkeypatch.setattr(robot, "_tell", lose_the_first)
    robot.enable()
    assert missed
    assert wire.motor.enabled


def test_a_mode_command_that_an_odrive_missed_is_repeated(monkeypatch):
    robot, wire = odrive()
    command, missed = robot._command, []

    def lose_the_first(number, data=b"", *, remote=False):
        if number == SET_MODE and not missed:
            missed.append(data)
        else:
            command(number, data, remote=remote)

    monkeypatch.setattr(robot, "_command", lose_the_first)
    robot.enable()
    assert missed
    robot.exchange(1.0, 1.0)
    assert wire.motor.torque == pytest.approx(1.0)


@pytest.mark.parametrize("make", [ak, odrive])
def test_frames_other_than_the_motors_data_frames_are_ignored(make):
    robot, wire = make()
    wire.motor = SameAnswer([])
    answer = pack_reply(Reply(1, 0.0, 0.0, 9.0), AK, 8)
    identifier = 0
    if make is odrive:
        answer, identifier = PAIR.pack(9.0, 9.0), frame_id(0, TORQUES)
    for kind in ("is_extended_id", "is_remote_frame", "is_error_frame"):
        flags = {"is_extended_id": False, kind: True}
        data = b"" if kind == "is_remote_frame" else answer
        wire.waiting.append(can.Message(arbitration_id=identifier, data=data, **flags))
    for data in (answer[:5], answer[:7], b""):
        wire.waiting.append(
            can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        )
    assert robot.exchange(0.0, 1.0) is None
    assert not wire.waiting


@pytest.mark.parametrize("make", [ak, odrive])
@pytest.mark.parametrize("torque", [-2.0, 2.0])
def test_a_motor_with_torque_at_zero_command_is_refused_with_a_hint(make, torque, monkeypatch):
    monkeypatch.setattr("gait_entrainment_drivers.can_motor.ANSWER_TIMEOUT", 0.05)
    robot, wire = make()
    if make is ak:
        frames = [(0, pack_reply(Reply(1, 0.0, 0.0, torque), AK, 8))]
    else:
        closed = pack_heartbeat(Heartbeat(0, CLOSED_LOOP))
        frames = [(frame_id(0, HEARTBEAT), closed), (frame_id(0, TORQUES), PAIR.pack(0.0, torque))]
    wire.motor = SameAnswer(frames)
    with pytest.raises(DeviceError, match=r"at zero command: is it (AK80-9|calibrated)\?"):
        robot.enable()
    robot.shut()
    assert wire.sent[-1] == (EXIT if make is ak else STATE.pack(IDLE))


def test_constants_match_the_manual():
    assert EXIT.hex() == "fffffffffffffffd"
    assert {
        "AK60-6": AkMotor(45.0, 15.0),
        "AK70-10": AkMotor(50.0, 25.0),
        "AK80-6": AkMotor(76.0, 12.0),
        "AK80-9": AkMotor(50.0, 18.0),
        "AK10-9": AkMotor(50.0, 65.0),
    } == MOTORS
    assert [FAULTS[number].name for number in range(1, 8)] == [
        "motor_too_hot",
        "over_current",
        "over_voltage",
        "under_voltage",
        "encoder_failed",
        "driver_too_hot",
        "motor_locked",
    ]
