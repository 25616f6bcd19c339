# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Driver for an ankle robot on a serial line to which the host streams torque."""

import os
import select
import time
from dataclasses import dataclass

import serial

from gait_entrainment.robot import DeviceError, Fault, LimitError
from gait_entrainment.settings import setting
from gait_entrainment_drivers.device import Reading, TorqueDevice
from gait_entrainment_drivers.host_timed import HostTimedRobot, LoopOptions
from serial_ankle_robot.frames import (
    DRIVER_FAULT,
    ENABLED,
    OFF,
    TORQUE,
    WATCHDOG_EXPIRED,
    Command,
    Reply,
    take_frame,
)

# A connected robot answers within milliseconds; this is ample even on a busy host [s].
_ANSWER_TIMEOUT = 0.5
_ASK_PERIOD = 0.05
_FAULTS = {
    WATCHDOG_EXPIRED: Fault("robot_watchdog", "The robot's own watchdog has expired."),
    DRIVER_FAULT: Fault("power_stage_failed", "The robot reports a fault of its power stage."),
}
_DISABLED = Fault("robot_disabled", "The robot has switched its torque off by itself.")


@dataclass(frozen=True)
class SerialOptions(LoopOptions):
    """Options of the line, the transmission and the loop."""

    port: str = setting("/dev/ttyACM0", "serial line")
    baud: int = setting(921_600, "bit rate of the line", "bit/s", (9600, 4_000_000))
    motor_torque: float = setting(2.0, "peak torque of the motor", "N m", (0.01, 300.0))
    ratio: float = setting(
        9.0,
        "ankle torque per motor torque; negative if their signs differ",
        "1",
        (-50.0, 50.0),
    )
    neutral: float = setting(
        0.0, "motor angle with the foot at right angles to the shank", "rad", (-32.0, 32.0)
    )

    def __post_init__(self) -> None:
        """Check every field, and that the ratio is not zero."""
        super().__post_init__()
        if self.ratio == 0:
            raise LimitError("driver: ratio: 0; allowed: any other number")


class SerialDevice(TorqueDevice):
    """The robot as the torque loop sees it."""

    def __init__(self, options: SerialOptions) -> None:
        self._options = options
        self.name = f"robot on {options.port}"
        # The same line has other names under /dev/serial/by-id.
        self.address = f"serial line {os.path.realpath(options.port)}"
        self.capabilities = options.capabilities(options.motor_torque * abs(options.ratio))
        self._line: serial.Serial | None = None
        self._received = bytearray()
        self._number = 0  # of the last command

    def open(self) -> None:
        """Connect, and check that the robot answers without an error."""
        options = self._options
        try:
            # `exclusive` keeps other programs, which do not know our lock, off the line. pyserial
            # also reports a write as failed if this process was held up meanwhile, for which the
            # loop has its own limit.
            self._line = serial.Serial(
                options.port,
                options.baud,
                timeout=0,
                write_timeout=2 * options.lateness,
                exclusive=True,
            )
        except (serial.SerialException, ValueError) as error:
            raise DeviceError(
                f"{self.name}: the line cannot be opened: {error}; check the cable, the option "
                "port, and that you may use it (group dialout)"
            ) from None
        self._require(
            self._reach(OFF).status & DRIVER_FAULT == 0, "reports a fault: switch it off"
        )

    def enable(self) -> None:
        """Switch torque on, at zero."""
        reply = self._reach(TORQUE)
        self._require(reply.status & ENABLED, "does not switch its torque on")
        torque = reply.torque * self._options.ratio
        at_zero = abs(torque) <= 0.05 * self.capabilities.peak_torque
        self._require(at_zero, f"shows {torque:g} N m at zero command: is the joint free?")

    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """Send a torque; return the reply to it."""
        ratio = self._options.ratio
        self._send(TORQUE, torque / ratio)
        reply = self._reply(timeout)
        if reply is None:
            return None
        faults = tuple(fault for bit, fault in _FAULTS.items() if reply.status & bit)
        if not faults and not reply.status & ENABLED:
            faults = (_DISABLED,)
        return Reading(
            reply.torque * ratio,
            (reply.angle - self._options.neutral) / ratio,
            reply.velocity / ratio,
            reply.temperature,
            faults,
        )

    def forget(self) -> None:
        """Drop what has arrived; a reply still under way has another number."""
        self._received.clear()
        if self._line is not None:
            self._line.reset_input_buffer()

    def disable(self) -> None:
        """Switch torque off."""
        self._send(OFF)

    def shut(self) -> None:
        """Close the line."""
        if self._line is not None:
            self._line.close()
            self._line = None

    def _reach(self, mode: int) -> Reply:
        """Request a mode at zero torque until a reply shows the status in this mode."""
        give_up = time.monotonic() + _ANSWER_TIMEOUT
        replies = 0
        while time.monotonic() < give_up:
            self._send(mode)
            reply = self._reply(_ASK_PERIOD)
            replies += reply is not None
            if reply is not None and replies > 1:  # the first one shows the status before
                return reply
        raise DeviceError(
            f"{self.name} does not answer at {self._options.baud} bit/s: check its power and baud"
        )

    def _require(self, condition: object, otherwise: str) -> None:
        if not condition:
            raise DeviceError(f"{self.name} {otherwise}")

    def _send(self, mode: int, torque: float = 0.0) -> None:
        assert self._line is not None
        self._number = (self._number + 1) % 256
        peak = self._options.motor_torque
        command = Command(self._number, mode, min(max(torque, -peak), peak))
        self._line.write(command.pack())

    def _reply(self, timeout: float) -> Reply | None:
        """Return the reply to the last command; None if it does not arrive within a time [s]."""
        assert self._line is not None
        give_up = time.monotonic() + timeout
        while (left := give_up - time.monotonic()) > 0:
            select.select([self._line], [], [], left)
            self._received += self._line.read(self._line.in_waiting)
            while (body := take_frame(self._received, Reply)) is not None:
                reply = Reply.unpack(body)
                if reply.number == self._number:
                    return reply
        return None


class SerialAnkleRobot(HostTimedRobot):
    """See the module's docstring."""

    Options = SerialOptions
    Device = SerialDevice
