# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Driver for an ODrive axis with CANSimple on any bus that python-can supports."""

import contextlib
import itertools
import math
import time
from dataclasses import dataclass
from typing import Any

from gait_entrainment.robot.faults import DeviceError, Fault
from gait_entrainment.settings import setting
from gait_entrainment_drivers import odrive
from gait_entrainment_drivers.can_motor import ANSWER_TIMEOUT, CanMotor, CanMotorOptions
from gait_entrainment_drivers.device import Reading
from gait_entrainment_drivers.host_timed import HostTimedRobot

# If no heartbeat arrives for this long [s], one is requested: an axis can have it switched off.
HEARTBEAT_PERIOD = 0.15
# Without one for this long [s], despite repeated requests, the axis's errors cannot be seen.
HEARTBEAT_LOST = 0.5
# An axis does not report its mode, and a frame may be lost: the mode is sent this many times.
_MODE_FRAMES = 4
NO_HEARTBEAT = Fault(
    "no_heartbeat", "The axis sends no heartbeat, even on request: its errors cannot be seen."
)
# Commands that only a host sends.
_COMMANDS = (odrive.SET_STATE, odrive.SET_MODE, odrive.SET_TORQUE)


@dataclass(frozen=True)
class OdriveCanOptions(CanMotorOptions):
    """Options of the bus, the axis and the transmission."""

    node_id: int = setting(0, "node id of the axis", "", (0, 62))
    motor_torque: float = setting(
        18.0,
        "peak torque of the motor: the axis's current limit times its torque constant",
        "N m",
        (0.01, 200.0),
    )


class OdriveAxis(CanMotor):
    """The axis as the torque loop sees it; see docs/drivers.md for wiring and hazards."""

    PROTOCOL = "by CANSimple"
    CHECK = "node_id"

    def __init__(self, options: OdriveCanOptions) -> None:
        super().__init__(options, f"ODrive {options.node_id}", options.motor_torque)
        self._heartbeat = odrive.Heartbeat(0, odrive.IDLE)
        self._beat_at = 0.0  # when it arrived [s, steady]
        self._errors = 0  # bits that are set, or disarmed the axis since it was enabled
        self._old_reason: int | None = None  # of an earlier disarming
        self._angle = self._velocity = math.nan  # of the motor [rad], [rad/s]
        self._angle_at = 0.0  # when they arrived [s, steady]
        # One of these per tick: both are needed less often than the torque.
        self._questions = itertools.cycle((odrive.ENCODER, odrive.ERRORS))

    def open(self) -> None:
        """Connect, check that the axis answers, and clear its errors."""
        self._open_bus()
        self._reach(odrive.IDLE)
        with contextlib.suppress(DeviceError):  # firmware before 0.6 does not report it
            self.identity = self._ask(
                lambda: self._command(odrive.VERSION, remote=True), self._version
            )

    def enable(self) -> None:
        """Enter closed-loop torque control at zero torque."""
        for _ in range(_MODE_FRAMES):
            self._command(odrive.SET_MODE, odrive.TORQUE_MODE)
        self._reach(odrive.CLOSED_LOOP)
        self._errors, self._old_reason = 0, None
        self._require_zero_torque("is it calibrated?")

    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """Request torque, position, velocity and errors, then send a torque."""
        ratio, peak = self._options.ratio, self._options.motor_torque
        if time.monotonic() - self._beat_at > HEARTBEAT_PERIOD:
            self._command(odrive.HEARTBEAT, remote=True)
        for question in (odrive.TORQUES, next(self._questions)):
            self._command(question, remote=True)
        self._command(odrive.SET_TORQUE, odrive.pack_torque(torque / ratio, peak))
        measured = self._answer(self._torque, time.monotonic() + timeout)
        if measured is None:
            return None
        faults = odrive.faults_of(self._heartbeat.error | self._errors)
        if not faults and self._heartbeat.state != odrive.CLOSED_LOOP:
            faults = (odrive.DISARMED,)
        now = time.monotonic()
        if now - self._beat_at > HEARTBEAT_LOST:
            faults = (*faults, NO_HEARTBEAT)
        if now - self._angle_at > HEARTBEAT_LOST:
            self._angle = self._velocity = math.nan
        return Reading(
            measured * ratio,
            self._angle / ratio,
            self._velocity / ratio,
            faults=(*faults, *self._masters),
        )

    def disable(self) -> None:
        """Command zero torque and leave closed-loop control."""
        self._command(odrive.SET_TORQUE, odrive.pack_torque(0.0, 0.0))
        self._command(odrive.SET_STATE, odrive.STATE.pack(odrive.IDLE))

    def _reach(self, state: int) -> None:
        """
        Bring the axis to a state without errors, at zero torque.

        Its errors are cleared: this is recovery's explicit step, and a watchdog that expired while
        no host was connected is expected. Errors that return are kept.
        """

        def request() -> None:
            # The torque command also feeds the watchdog.
            self._command(odrive.SET_TORQUE, odrive.pack_torque(0.0, 0.0))
            self._command(odrive.CLEAR_ERRORS, bytes(1))
            self._command(odrive.SET_STATE, odrive.STATE.pack(state))
            self._command(odrive.HEARTBEAT, remote=True)

        give_up = time.monotonic() + ANSWER_TIMEOUT
        while (heartbeat := self._ask(request, self._beat)) != odrive.Heartbeat(0, state):
            if time.monotonic() > give_up:
                faults = " ".join(fault.meaning for fault in odrive.faults_of(heartbeat.error))
                raise DeviceError(
                    f"{self.name} stays in state {heartbeat.state} instead of {state}. {faults} "
                    "Remove the cause, check that it is calibrated, and power-cycle it"
                )

    def _command(self, command: int, data: bytes = b"", *, remote: bool = False) -> None:
        self._send(odrive.frame_id(self._options.node_id, command), data, remote=remote)

    def _beat(self, message: Any) -> odrive.Heartbeat | None:
        """Note a frame's content; return the heartbeat if it is one."""
        node, command = divmod(message.arbitration_id, 32)
        data = bytes(message.data)
        if node != self._options.node_id:
            self._others.add(node)
        elif command in _COMMANDS:
            self._note_command(message)
        elif command == odrive.HEARTBEAT and (heartbeat := odrive.unpack_heartbeat(data)):
            self._heartbeat, self._beat_at = heartbeat, time.monotonic()
            return heartbeat
        elif command == odrive.ERRORS and (errors := odrive.unpack(odrive.BITS, data)):
            active, reason = errors
            self._old_reason = reason if self._old_reason is None else self._old_reason
            self._errors = active | (reason if reason != self._old_reason else 0)
        elif command == odrive.ENCODER and (pair := odrive.unpack(odrive.PAIR, data)):
            self._angle, self._velocity = (2 * math.pi * value for value in pair)
            self._angle_at = time.monotonic()
        return None

    def _version(self, message: Any) -> str | None:
        """Describe the versions if a frame contains them."""
        versions = odrive.unpack(odrive.VERSIONS, bytes(message.data))
        wanted = odrive.frame_id(self._options.node_id, odrive.VERSION)
        if versions is None or message.arbitration_id != wanted:
            self._beat(message)
            return None
        _, *hardware, major, minor, revision, unreleased = versions
        return (
            f"ODrive {'.'.join(map(str, hardware))}, firmware {major}.{minor}.{revision}"
            f"{' (not released)' if unreleased else ''}"
        )

    def _torque(self, message: Any) -> float | None:
        """Note a frame's content; return the motor torque [N m] if it contains it."""
        if message.arbitration_id != odrive.frame_id(self._options.node_id, odrive.TORQUES):
            self._beat(message)
            return None
        torques = odrive.unpack(odrive.PAIR, bytes(message.data))
        return None if torques is None else torques[1]


class OdriveCanRobot(HostTimedRobot):
    """See the module's docstring, and docs/drivers.md for wiring and hazards."""

    Options = OdriveCanOptions
    Device = OdriveAxis
