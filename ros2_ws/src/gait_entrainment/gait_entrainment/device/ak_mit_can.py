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

"""Driver of a CubeMars AK motor in MIT mode on any bus that python-can knows."""

import contextlib
import time
from dataclasses import dataclass, field
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.device.ak_mit import (
    ENTER,
    EXIT,
    FAULTS,
    MOTORS,
    Command,
    Reply,
    pack_command,
    resolution,
    unpack_reply,
)
from gait_entrainment.device.can_bus import open_bus
from gait_entrainment.device.faults import DeviceError, Fault, LimitError
from gait_entrainment.device.host_loop import HostTimedRobot, Reading
from gait_entrainment.device.robot import Capabilities

# A motor that is there answers within a millisecond; on a busy host this is ample [s].
_ANSWER_TIMEOUT = 0.5
# How often a question is repeated while waiting, since a frame may be lost [s].
_ASK_PERIOD = 0.05


@dataclass(frozen=True)
class AkMitCanOptions:
    """Bus, motor and transmission."""

    interface: str = field(
        default="socketcan", metadata={"meaning": "python-can interface", "unit": ""}
    )
    channel: str = field(default="can0", metadata={"meaning": "channel of the bus", "unit": ""})
    port: int = field(
        default=0,
        metadata={
            "meaning": "UDP port of udp_multicast; 0 is python-can's own",
            "unit": "",
            "range": (0, 65535),
        },
    )
    bitrate: int = field(
        default=1_000_000,
        metadata={"meaning": "of the bus", "unit": "bit/s", "range": (10_000, 1_000_000)},
    )
    motor: str = field(
        default="AK80-9",
        metadata={"meaning": "type, which fixes the ranges", "unit": "", "choices": tuple(MOTORS)},
    )
    motor_id: int = field(
        default=1, metadata={"meaning": "id of the motor", "unit": "", "range": (1, 127)}
    )
    ratio: float = field(
        default=1.0,
        metadata={
            "meaning": "ankle torque per motor torque; negative where the motor turns against it",
            "unit": "1",
            "range": (-20.0, 20.0),
        },
    )
    rate: float = field(
        default=500.0,
        metadata={"meaning": "torque commands per second", "unit": "Hz", "range": (50.0, 1000.0)},
    )
    silence: float = field(
        default=0.05,
        metadata={"meaning": "longest silence of the motor", "unit": "s", "range": (0.005, 1.0)},
    )
    lateness: float = field(
        default=0.05,
        metadata={
            "meaning": "by which the loop may wake up late",
            "unit": "s",
            "range": (0.005, 1.0),
        },
    )

    def __post_init__(self) -> None:
        """Check what has no range of its own."""
        if self.ratio == 0:
            raise LimitError("driver: ak_mit_can: ratio: 0; allowed: any other number")


class AkMitCanRobot(HostTimedRobot):
    """See the module's docstring; docs/drivers.md has wiring and hazards."""

    Options = AkMitCanOptions

    def __init__(self, side: Side, options: AkMitCanOptions, seed: int) -> None:  # noqa: ARG002
        super().__init__(side, options.rate, options.silence, options.lateness)
        self._options = options
        self._motor = MOTORS[options.motor]
        self._zero = pack_command(Command(), self._motor)
        self._resolution = resolution(self._motor) * abs(options.ratio)
        self._bus: Any = None
        self.capabilities = Capabilities(
            peak_torque=self._motor.torque * abs(options.ratio),
            torque_rate=float("inf"),
            own_pulse_timer=False,
            measures_torque=True,
            simulated=False,
            state_rate=options.rate,
        )

    def _open(self) -> None:
        options = self._options
        self._bus = open_bus(options.interface, options.channel, options.bitrate, options.port)
        # Leaving motor mode is harmless whatever the motor is doing, and is answered.
        reply = self._ask(EXIT)
        if reply.error:
            raise DeviceError(
                f"motor {options.motor_id} reports: {_fault(reply.error).meaning} "
                "Remove the cause and switch the motor off and on"
            )

    def _enable(self) -> None:
        # The motor holds its last command, also across modes: zero before and after.
        self._send(self._zero)
        self._ask(ENTER)
        give_up = time.monotonic() + _ANSWER_TIMEOUT
        while abs((reply := self._ask(self._zero)).torque) > 0.05 * self._motor.torque:
            if time.monotonic() > give_up:
                self._disable()
                raise DeviceError(
                    f"motor {self._options.motor_id} shows {reply.torque:g} N m at zero command: "
                    f"is it {self._options.motor}? is the joint free?"
                )
            time.sleep(1 / self._options.rate)

    def _exchange(self, torque: float, patience: float) -> Reading | None:
        command = Command(torque=torque / self._options.ratio)
        self._send(pack_command(command, self._motor))
        reply = self._reply(time.monotonic() + patience)
        if reply is None:
            return None
        measured = reply.torque * self._options.ratio
        if abs(measured) < self._resolution:  # zero has no code of its own
            measured = 0.0
        faults = (_fault(reply.error),) if reply.error else ()
        return Reading(measured, reply.position / self._options.ratio, faults)

    def _disable(self) -> None:
        self._send(self._zero)
        self._send(EXIT)

    def _shut(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            with contextlib.suppress(Exception):
                bus.send(_message(self._options.motor_id, self._zero))
                bus.send(_message(self._options.motor_id, EXIT))
            bus.shutdown()

    def _send(self, data: bytes) -> None:
        self._bus.send(_message(self._options.motor_id, data))

    def _ask(self, data: bytes) -> Reply:
        """Send until the motor answers."""
        options = self._options
        seen: set[int] = set()
        give_up = time.monotonic() + _ANSWER_TIMEOUT
        while time.monotonic() < give_up:
            self._send(data)
            reply = self._reply(time.monotonic() + _ASK_PERIOD, seen)
            if reply is not None:
                return reply
        others = f" (others do: {', '.join(map(str, sorted(seen)))})" if seen else ""
        raise DeviceError(
            f"motor {options.motor_id} does not answer in MIT mode on {options.interface} "
            f"{options.channel}{others}: check its power, wiring, mode and motor_id, and that the "
            f"bus runs at {options.bitrate} bit/s"
        )

    def _reply(self, give_up: float, seen: set[int] | None = None) -> Reply | None:
        """Return the newest reply of the motor, waiting for the first until a time [s]."""
        newest = None
        while True:
            patience = 0.0 if newest is not None else give_up - time.monotonic()
            if patience < 0:
                return newest
            message = self._bus.recv(patience)
            if message is None:
                return newest
            if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
                continue
            reply = unpack_reply(bytes(message.data), self._motor)
            if reply is None:
                continue
            if reply.motor_id == self._options.motor_id:
                newest = reply
            elif seen is not None:
                seen.add(reply.motor_id)


def _fault(error: int) -> Fault:
    return FAULTS.get(error, Fault(f"motor_error_{error}", f"The motor reports error {error}."))


def _message(motor_id: int, data: bytes) -> Any:
    import can

    return can.Message(arbitration_id=motor_id, data=data, is_extended_id=False)
