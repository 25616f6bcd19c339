# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Code shared by drivers for motors on a CAN bus: options, the bus, repeated requests."""

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

# A connected motor answers within a millisecond; this is ample even on a busy host [s].
ANSWER_TIMEOUT = 0.5
# A request is repeated with this period, because a frame may be lost [s].
_ASK_PERIOD = 0.05
# Longest time to discard frames that arrived while the loop was held up [s].
_DRAIN_TIME = 0.02
# Own commands remembered, to tell their echoes from another master's commands: 0.2 s.
_REMEMBERED = 100


@dataclass(frozen=True)
class CanMotorOptions(LoopOptions):
    """Options of the bus, the transmission and the loop."""

    interface: str = setting("socketcan", "python-can interface")
    channel: str = setting("can0", "bus channel")
    port: int = setting(0, "UDP port of udp_multicast; 0 is python-can's default", "", (0, 65535))
    bitrate: int = setting(1_000_000, "bit rate of the bus", "bit/s", (10_000, 1_000_000))
    ratio: float = setting(
        1.0, "ankle torque per motor torque; negative if their signs differ", "1", (-20.0, 20.0)
    )

    def __post_init__(self) -> None:
        """Check every field, and that the ratio is not zero."""
        super().__post_init__()
        if self.ratio == 0:
            raise LimitError("driver: ratio: 0; allowed: any other number")


class CanMotor(TorqueDevice):
    """
    A motor that receives its torque commands in frames with 11-bit ids.

    A subclass names its protocol, opens the bus at the start of ``open``, and implements
    ``enable``, ``exchange`` and ``disable``; ``disable`` must bring the torque to zero.

    Messages use ``name``; ``motor_torque`` is the peak torque [N m] before the transmission.
    """

    PROTOCOL: ClassVar[str]  # as in "motor 1 does not answer PROTOCOL on can0"
    CHECK: ClassVar[str]  # what the user should check, besides power, wiring and bit rate

    def __init__(self, options: Any, name: str, motor_torque: float) -> None:
        self.name, self._options = name, options
        # A serial line may have several names: /dev/serial/by-id has links to it.
        channel = options.channel
        channel = os.path.realpath(channel) if channel.startswith("/") else channel
        port = f" port {options.port}" if options.port else ""
        self.address = f"{name} on {options.interface} {channel}{port}"
        self._bus: Any = None
        self._others: set[int] = set()  # ids of other motors on the bus
        self._sent: deque[tuple[int, bytes]] = deque(maxlen=_REMEMBERED)
        self._second_master = False  # another master has sent a command to this motor
        self.capabilities = options.capabilities(motor_torque * abs(options.ratio))

    def _open_bus(self) -> None:
        options = self._options
        self._others.clear()
        self._sent.clear()
        self._second_master = False
        self._bus = open_bus(options.interface, options.channel, options.bitrate, options.port)

    def shut(self) -> None:
        """Command zero torque, and close the bus."""
        if self._bus is not None:
            with contextlib.suppress(Exception):
                self.disable()
            self._bus.shutdown()
            self._bus = None

    def forget(self) -> None:
        """Drop received frames, for a limited time: they may arrive faster than they are read."""
        give_up = time.monotonic() + _DRAIN_TIME
        while time.monotonic() < give_up and self._bus.recv(0.0) is not None:
            pass

    def _send(self, identifier: int, data: bytes = b"", *, remote: bool = False) -> None:
        if not remote:
            self._sent.append((identifier, data))
        send(self._bus, identifier, data, remote=remote)

    def _note_command(self, message: Any) -> None:
        """Note a command to this motor seen on the bus; some adapters echo the host's own."""
        sent = message.arbitration_id, bytes(message.data)
        # Echoes arrive soon and in order. Without echoes, the sent commands fill the memory.
        if sent in self._sent and len(self._sent) < _REMEMBERED:
            while self._sent.popleft() != sent:
                pass
        else:
            self._second_master = True

    @property
    def _masters(self) -> tuple[Fault, ...]:
        """The second-master fault, if there is one."""
        return (SECOND_MASTER,) if self._second_master else ()

    def _answer(self, decode: Callable[[Any], _T | None], give_up: float) -> _T | None:
        """
        Return the newest answer among the frames; wait until ``give_up`` [s] for the first.

        No frame is read after that time: frames may arrive faster than they are read.
        """
        newest = None
        while (left := give_up - time.monotonic()) >= 0:
            message = self._bus.recv(left if newest is None else 0.0)
            if message is None:
                break
            if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
                continue
            answer = decode(message)
            newest = newest if answer is None else answer
        return newest

    def _ask(self, request: Callable[[], None], decode: Callable[[Any], _T | None]) -> _T:
        """Repeat a request until it is answered; raise DeviceError if it is not."""
        give_up = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < give_up:
            request()
            answer = self._answer(decode, time.monotonic() + _ASK_PERIOD)
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
        """Raise DeviceError if the enabled motor keeps reporting torque at zero command."""
        give_up = time.monotonic() + ANSWER_TIMEOUT
        while True:
            reading = self.exchange(0.0, _ASK_PERIOD)
            torque = math.nan if reading is None else reading.torque
            if abs(torque) <= NEAR_ZERO_SHARE * torque_scale(self.capabilities):
                return
            if time.monotonic() > give_up:
                raise DeviceError(
                    f"{self.name} shows {torque:g} N m at zero command: {doubt} Is the joint free?"
                )
            time.sleep(1 / self._options.rate)
