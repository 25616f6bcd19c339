# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Driver of an ODrive axis by CANSimple on any bus that python-can knows."""

import math
import time
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.robot.faults import DeviceError
from gait_entrainment.settings import setting
from gait_entrainment_drivers.can_motor import ANSWER_TIMEOUT, CanMotorOptions, CanMotorRobot
from gait_entrainment_drivers.host_loop import Reading
from gait_entrainment_drivers.odrive import (
    CLEAR_ERRORS,
    CLOSED_LOOP,
    DISARMED,
    ENCODER,
    HEARTBEAT,
    IDLE,
    SET_MODE,
    SET_STATE,
    SET_TORQUE,
    TORQUE_MODE,
    TORQUES,
    Heartbeat,
    faults_of,
    frame_id,
    pack_state,
    pack_torque,
    unpack_heartbeat,
    unpack_pair,
)


@dataclass(frozen=True)
class OdriveCanOptions(CanMotorOptions):
    """Bus, axis and transmission."""

    node_id: int = setting(0, "node id of the axis", "", (0, 62))
    motor_torque: float = setting(
        18.0,
        "peak torque of the motor: the axis's current limit times torque constant",
        "N m",
        (0.01, 200.0),
    )


# An axis that does not send its heartbeat this often [s] is asked for it: it can be switched off.
HEARTBEAT_PERIOD = 0.15


class OdriveCanRobot(CanMotorRobot):
    """See the module's docstring; docs/drivers.md has wiring and hazards."""

    Options = OdriveCanOptions
    PROTOCOL = "by CANSimple"
    CHECK = "node_id"

    def __init__(self, side: Side, options: OdriveCanOptions, seed: int) -> None:  # noqa: ARG002
        super().__init__(side, options, f"ODrive {options.node_id}", options.motor_torque)
        self._heartbeat = Heartbeat(0, IDLE)
        self._beat_at = 0.0  # when it came [s, steady]
        self._angle = math.nan  # of the motor [rad]

    def _open(self) -> None:
        self._open_bus()
        self._reach(IDLE)

    def _enable(self) -> None:
        self._command(SET_MODE, TORQUE_MODE)
        self._reach(CLOSED_LOOP)
        self._require_zero_torque("is it calibrated?")

    def _exchange(self, torque: float, patience: float) -> Reading | None:
        options = self._options
        self._command(SET_TORQUE, pack_torque(torque / options.ratio, options.motor_torque))
        overdue = time.monotonic() - self._beat_at > HEARTBEAT_PERIOD
        for question in (HEARTBEAT, ENCODER, TORQUES) if overdue else (ENCODER, TORQUES):
            self._command(question, remote=True)
        measured = self._answer(self._torque, time.monotonic() + patience)
        if measured is None:
            return None
        faults = faults_of(self._heartbeat.error)
        if not faults and self._heartbeat.state != CLOSED_LOOP:
            faults = (DISARMED,)
        return Reading(measured * options.ratio, self._angle / options.ratio, faults)

    def _disable(self) -> None:
        self._command(SET_TORQUE, pack_torque(0.0, 0.0))
        self._command(SET_STATE, pack_state(IDLE))

    def _reach(self, state: int) -> None:
        """
        Bring the axis to a state without errors, at zero torque.

        Its errors are cleared: to get here is the explicit step that recovery takes, and a
        watchdog that expired while nobody was connected is no news. What comes back stays.
        """
        give_up = time.monotonic() + ANSWER_TIMEOUT
        while True:
            heartbeat = self._ask(lambda: self._request(state), self._beat)
            if heartbeat == Heartbeat(0, state):
                return
            if time.monotonic() > give_up:
                faults = " ".join(fault.meaning for fault in faults_of(heartbeat.error))
                raise DeviceError(
                    f"{self._name} stays in state {heartbeat.state} instead of {state}. {faults} "
                    "Remove the cause, see that it is calibrated, and switch it off and on"
                )

    def _request(self, state: int) -> None:
        self._command(SET_TORQUE, pack_torque(0.0, 0.0))  # feeds the watchdog too
        self._command(CLEAR_ERRORS, bytes(1))
        self._command(SET_STATE, pack_state(state))
        self._command(HEARTBEAT, remote=True)

    def _command(self, command: int, data: bytes = b"", *, remote: bool = False) -> None:
        self._send(frame_id(self._options.node_id, command), data, remote=remote)

    def _beat(self, message: Any) -> Heartbeat | None:
        """Note what a frame tells; return the heartbeat where it is one."""
        node, command = divmod(message.arbitration_id, 32)
        data = bytes(message.data)
        if node != self._options.node_id:
            self._others.add(node)
        elif command == HEARTBEAT and (heartbeat := unpack_heartbeat(data)) is not None:
            self._heartbeat, self._beat_at = heartbeat, time.monotonic()
            return heartbeat
        elif command == ENCODER and (estimates := unpack_pair(data)) is not None:
            self._angle = 2 * math.pi * estimates[0]
        return None

    def _torque(self, message: Any) -> float | None:
        """Note what a frame tells; return the torque of the motor [N m] where it is in it."""
        if message.arbitration_id != frame_id(self._options.node_id, TORQUES):
            self._beat(message)
            return None
        torques = unpack_pair(bytes(message.data))
        return None if torques is None else torques[1]
