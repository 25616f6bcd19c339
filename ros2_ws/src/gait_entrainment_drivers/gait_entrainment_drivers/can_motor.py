# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What drivers of a motor on a CAN bus share: options, the bus, asking until it answers."""

import contextlib
import math
import os
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.settings import setting
from gait_entrainment_drivers.can_bus import open_bus, send
from gait_entrainment_drivers.device import TorqueDevice
from gait_entrainment_drivers.host_timed import LoopOptions
from gait_entrainment_drivers.monitor import NEAR_ZERO_SHARE, SECOND_MASTER, torque_scale

_T = TypeVar("_T")

# A motor that is there answers within a millisecond; on a busy host this is ample [s].
ANSWER_TIMEOUT = 0.5
# How often a question is repeated while waiting, since a frame may be lost [s].
_ASK_PERIOD = 0.05
# What came while the loop was held up is read away for so long at most [s].
_DRAIN_TIME = 0.02
# Commands remembered to tell an echo of one's own from somebody else's: 0.2 s of them.
_REMEMBERED = 100


@dataclass(frozen=True)
class CanMotorOptions(LoopOptions):
    """Bus, transmission and loop."""

    interface: str = setting("socketcan", "python-can interface")
    channel: str = setting("can0", "channel of the bus")
    port: int = setting(0, "UDP port of udp_multicast; 0 is python-can's own", "", (0, 65535))
    bitrate: int = setting(1_000_000, "of the bus", "bit/s", (10_000, 1_000_000))
    ratio: float = setting(
        1.0, "ankle torque per motor torque; negative if it turns against it", "1", (-20.0, 20.0)
    )

    def __post_init__(self) -> None:
        """Check every field, and what has no range of its own."""
        super().__post_init__()
        if self.ratio == 0:
            raise LimitError("driver: ratio: 0; allowed: any other number")


class CanMotor(TorqueDevice):
    """
    A motor whose torque is streamed to it in frames with 11-bit ids.

    A subclass names its protocol, opens the bus first of all in ``open``, and implements
    ``enable``, ``exchange`` and ``disable``; ``disable`` must bring zero torque.

    ``name`` is the motor's, in messages; ``motor_torque`` its peak [N m] before the transmission.
    """

    PROTOCOL: ClassVar[str]  # as in "motor 1 does not answer PROTOCOL on can0"
    CHECK: ClassVar[str]  # what a person should check, besides power, wiring and bit rate

    def __init__(self, options: Any, name: str, motor_torque: float) -> None:
        self.name, self._options = name, options
        # A serial line has several names: /dev/serial/by-id has links to it.
        channel = options.channel
        channel = os.path.realpath(channel) if channel.startswith("/") else channel
        port = f" port {options.port}" if options.port else ""
        self.address = f"{name} on {options.interface} {channel}{port}"
        self._bus: Any = None
        self._others: set[int] = set()  # ids of other motors that were heard
        self._sent: deque[tuple[int, bytes]] = deque(maxlen=_REMEMBERED)
        self._second_master = False  # somebody else has sent a command to this motor
        self.capabilities = options.capabilities(motor_torque * abs(options.ratio))

    def _open_bus(self) -> None:
        options = self._options
        self._others.clear()
        self._sent.clear()
        self._second_master = False
        self._bus = open_bus(options.interface, options.channel, options.bitrate, options.port)

    def shut(self) -> None:
        """Close the bus, having asked for zero torque."""
        if self._bus is not None:
            with contextlib.suppress(Exception):
                self.disable()
            self._bus.shutdown()
            self._bus = None

    def forget(self) -> None:
        """Drop the frames that have come; not for ever, since they may come faster than that."""
        give_up = time.monotonic() + _DRAIN_TIME
        while time.monotonic() < give_up and self._bus.recv(0.0) is not None:
            pass

    def _send(self, identifier: int, data: bytes = b"", *, remote: bool = False) -> None:
        if not remote:
            self._sent.append((identifier, data))
        send(self._bus, identifier, data, remote=remote)

    def _note_command(self, message: Any) -> None:
        """Note a command to this motor that was seen on the bus; some adapters echo one's own."""
        sent = message.arbitration_id, bytes(message.data)
        # An echo comes soon, and in order. Where none comes, what was sent fills the memory.
        if sent in self._sent and len(self._sent) < _REMEMBERED:
            while self._sent.popleft() != sent:
                pass
        else:
            self._second_master = True

    @property
    def _masters(self) -> tuple[Fault, ...]:
        """The fault of a second master, if there is one."""
        return (SECOND_MASTER,) if self._second_master else ()

    def _answer(self, understand: Callable[[Any], _T | None], give_up: float) -> _T | None:
        """
        Return the newest answer among the frames, waiting for the first until a time [s].

        After that time no frame is read: they may come faster than they are read.
        """
        newest = None
        while (left := give_up - time.monotonic()) >= 0:
            message = self._bus.recv(left if newest is None else 0.0)
            if message is None:
                break
            if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
                continue
            answer = understand(message)
            newest = newest if answer is None else answer
        return newest

    def _ask(self, ask: Callable[[], None], understand: Callable[[Any], _T | None]) -> _T:
        """Ask until there is an answer."""
        give_up = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < give_up:
            ask()
            answer = self._answer(understand, time.monotonic() + _ASK_PERIOD)
            if answer is not None:
                return answer
        options = self._options
        others = f" (others do: {', '.join(map(str, sorted(self._others)))})"
        raise DeviceError(
            f"{self.name} does not answer {self.PROTOCOL} on {options.interface} "
            f"{options.channel}{others if self._others else ''}: check its power, wiring, "
            f"{self.CHECK}, and that the bus runs at {options.bitrate} bit/s"
        )

    def _require_zero_torque(self, doubt: str) -> None:
        """Raise DeviceError if the motor, enabled, keeps showing torque at zero command."""
        give_up = time.monotonic() + ANSWER_TIMEOUT
        while True:
            reading = self.exchange(0.0, _ASK_PERIOD)
            torque = math.nan if reading is None else reading.torque
            if abs(torque) <= NEAR_ZERO_SHARE * torque_scale(self.capabilities):
                return
            if time.monotonic() > give_up:
                raise DeviceError(
                    f"{self.name} shows {torque:g} N m at zero command: {doubt} is the joint free?"
                )
            time.sleep(1 / self._options.rate)
