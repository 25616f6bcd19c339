# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Driver for a CubeMars AK motor in MIT mode on any bus that python-can supports."""

import time
from dataclasses import dataclass
from typing import Any

from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.settings import setting
from gait_entrainment_drivers import ak_mit
from gait_entrainment_drivers.can_motor import CanMotor, CanMotorOptions
from gait_entrainment_drivers.device import Reading
from gait_entrainment_drivers.host_timed import HostTimedRobot


@dataclass(frozen=True)
class AkMitCanOptions(CanMotorOptions):
    """Options of the bus, the motor and the transmission."""

    motor: str = setting("AK80-9", "type, which sets the ranges", choices=tuple(ak_mit.MOTORS))
    motor_id: int = setting(1, "motor id", "", (1, 127))
    host_id: int = setting(0, "id that the motor replies to", "", (0, 2047))

    def __post_init__(self) -> None:
        """Check every field, and that commands and replies have different ids."""
        super().__post_init__()
        if self.host_id == self.motor_id:
            raise LimitError(f"driver: host_id: {self.host_id}; allowed: any id but motor_id")


class AkMotorOnCan(CanMotor):
    """The motor as the torque loop sees it; see docs/drivers.md for wiring and hazards."""

    PROTOCOL = "in MIT mode"
    CHECK = "mode and motor_id"

    def __init__(self, options: AkMitCanOptions) -> None:
        self._motor = ak_mit.MOTORS[options.motor]
        super().__init__(options, f"motor {options.motor_id}", self._motor.torque)
        self._resolution = ak_mit.resolution(self._motor) * abs(options.ratio)

    def open(self) -> None:
        """Connect, and check that the motor answers without an error."""
        self._open_bus()
        # Leaving motor mode is harmless in any state, and the motor answers it.
        reply = self._ask(lambda: self._tell(ak_mit.EXIT), self._reply)
        if reply.error:
            raise DeviceError(
                f"{self.name} reports: {_fault(reply.error).meaning} "
                "Remove the cause and power-cycle the motor"
            )

    def enable(self) -> None:
        """Enter motor mode at zero torque."""
        # The motor keeps its last command across modes: send zero before and after. A reply does
        # not say what it answers: drop the first, which could pass for one to a lost frame.
        self._ask(lambda: self._command(0.0), self._reply)
        self.forget()
        self._ask(lambda: self._tell(ak_mit.ENTER), self._reply)
        self._require_zero_torque(f"is it {self._options.motor}?")

    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """Send a torque; return the newest reply."""
        ratio = self._options.ratio
        self._command(torque / ratio)
        reply = self._answer(self._reply, time.monotonic() + timeout)
        if reply is None:
            return None
        measured = reply.torque * ratio
        if abs(measured) < self._resolution:  # zero has no exact code
            measured = 0.0
        faults = (_fault(reply.error),) if reply.error else ()
        return Reading(
            measured,
            reply.position / ratio,
            reply.velocity / ratio,
            reply.temperature,
            (*faults, *self._masters),
        )

    def disable(self) -> None:
        """Command zero torque and leave motor mode."""
        self._command(0.0)
        self._tell(ak_mit.EXIT)

    def _command(self, torque: float) -> None:
        self._tell(ak_mit.pack_command(ak_mit.Command(torque=torque), self._motor))

    def _tell(self, data: bytes) -> None:
        self._send(self._options.motor_id, data)

    def _reply(self, message: Any) -> ak_mit.Reply | None:
        """Decode this motor's reply to the host; return None for any other frame."""
        if message.arbitration_id == self._options.motor_id:
            self._note_command(message)
        if message.arbitration_id != self._options.host_id:
            return None
        reply = ak_mit.unpack_reply(bytes(message.data), self._motor)
        if reply is None or reply.motor_id == self._options.motor_id:
            return reply
        self._others.add(reply.motor_id)
        return None


class AkMitCanRobot(HostTimedRobot):
    """See the module's docstring, and docs/drivers.md for wiring and hazards."""

    Options = AkMitCanOptions
    Device = AkMotorOnCan


def _fault(error: int) -> Fault:
    unknown = Fault(f"motor_error_{error}", f"The motor reports error {error}.")
    return ak_mit.FAULTS.get(error, unknown)
