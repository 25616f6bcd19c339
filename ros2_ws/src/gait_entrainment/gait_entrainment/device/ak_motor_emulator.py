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

"""
ak_motor_emulator: the motor's side of MIT mode, as a process of its own.

It speaks on any python-can bus that crosses processes and reproduces what a real motor does to
its users: it holds the last command when frames stop, unless its own timeout is switched on (a
real one has it off by default); replies have 6 or 8 bytes; frames get lost; errors come up.

Its torque follows the command as a first-order lag. Not modelled: motion (position and velocity
are zero), heat, supply, arbitration and load of the bus, bit errors.
"""

import argparse
import math
import random
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

from gait_entrainment.device.ak_mit import (
    ENTER,
    EXIT,
    MOTORS,
    SET_ZERO,
    AkMotor,
    Reply,
    pack_reply,
    unpack_command,
)
from gait_entrainment.device.can_bus import open_bus
from gait_entrainment.device.faults import DeviceError

# How often the emulator looks after itself while no frame comes [s].
_TICK = 0.001


class EmulatedAkMotor:
    """
    The motor itself, without a bus: frames in, replies out, torque as a function of time.

    Parameters
    ----------
    motor, motor_id
        Ranges and id.
    bandwidth
        Of the torque [Hz].
    timeout
        Its own watchdog [s]: without a frame for so long it drops its command; 0 is off.
    reply_bytes
        6 or 8.

    """

    def __init__(
        self, motor: AkMotor, motor_id: int, bandwidth: float, timeout: float, reply_bytes: int
    ) -> None:
        self.motor = motor
        self.motor_id = motor_id
        self.error = 0
        self.enabled = False
        self.command = 0.0  # held [N m]
        self.torque = 0.0  # delivered [N m]
        self._bandwidth = bandwidth
        self._timeout = timeout
        self._reply_bytes = reply_bytes
        self._now = 0.0
        self._last_frame = 0.0

    def advance(self, now: float) -> None:
        """Let the torque follow up to a time [s]."""
        if self._timeout and now - self._last_frame > self._timeout:
            self.command = 0.0
        target = self.command if self.enabled and not self.error else 0.0
        decay = math.exp(-2 * math.pi * self._bandwidth * (now - self._now))
        self.torque = target + (self.torque - target) * decay
        self._now = now

    def receive(self, data: bytes, now: float) -> bytes:
        """Obey a frame at a time [s] and return the reply."""
        self.advance(now)
        self._last_frame = now
        if data == ENTER:
            self.enabled = True
        elif data == EXIT:
            self.enabled = False
        elif data != SET_ZERO and len(data) == 8:
            self.command = unpack_command(data, self.motor).torque
        reply = Reply(self.motor_id, 0.0, 0.0, self.torque, self.error)
        return pack_reply(reply, self.motor, self._reply_bytes)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the emulator until SIGINT or SIGTERM; 1 where the bus cannot be opened."""
    options = _parser().parse_args(arguments)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    try:
        bus = open_bus(options.interface, options.channel, 1_000_000, options.port)
    except DeviceError as error:
        print(f"ak_motor_emulator: {error}", file=sys.stderr)
        return 1
    print(f"ak_motor_emulator: {options.motor}, id {options.motor_id}, ready", flush=True)
    with bus:
        trace = options.trace.open("w", buffering=1) if options.trace else None
        try:
            _serve(bus, options, trace)
        except KeyboardInterrupt:
            pass
        finally:
            if trace is not None:
                trace.close()
    return 0


def _serve(bus: Any, options: argparse.Namespace, trace: TextIO | None) -> None:
    import can

    motor = EmulatedAkMotor(
        MOTORS[options.motor],
        options.motor_id,
        options.bandwidth,
        options.timeout,
        options.reply_bytes,
    )
    chance = random.Random(options.seed)
    torque_since: float | None = None
    while True:
        message = bus.recv(_TICK)
        now = time.monotonic()
        motor.advance(now)
        if torque_since is None and motor.enabled and motor.command > 0.1:
            torque_since = now
        under_torque = now - torque_since if torque_since is not None else 0.0
        if options.error and under_torque > options.error_after:
            motor.error = options.error
        if trace is not None:
            trace.write(f"{time.time_ns()} {motor.command:.4f} {motor.torque:.4f}\n")
        mine = message is not None and message.arbitration_id == options.motor_id
        if not mine or message.is_extended_id or chance.random() < options.loss:
            continue
        reply = motor.receive(bytes(message.data), now)
        silent = options.silent_after is not None and under_torque > options.silent_after
        if not silent and chance.random() >= options.loss:
            # Replies go to the host's id, which is 0.
            bus.send(can.Message(arbitration_id=0, data=reply, is_extended_id=False))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ak_motor_emulator",
        description="The motor's side of a CubeMars AK motor in MIT mode, on a CAN bus.",
    )
    parser.add_argument("--interface", default="udp_multicast", help="python-can interface")
    parser.add_argument("--channel", default="239.74.163.2", help="channel of the bus")
    parser.add_argument(
        "--port", type=int, default=0, help="of udp_multicast; 0: python-can's own"
    )
    parser.add_argument("--motor", choices=MOTORS, default="AK80-9", help="type of the motor")
    parser.add_argument("--motor-id", type=int, default=1, help="1 to 127")
    parser.add_argument("--bandwidth", type=float, default=30.0, help="of the torque [Hz]")
    parser.add_argument(
        "--timeout", type=float, default=0.0, help="the motor's own watchdog [s]; 0 is off"
    )
    parser.add_argument("--reply-bytes", type=int, choices=(6, 8), default=8)
    parser.add_argument(
        "--loss", type=float, default=0.0, help="share of the frames that get lost"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the losses")
    parser.add_argument("--error", type=int, default=0, help="error that comes up, 1 to 255")
    parser.add_argument(
        "--error-after", type=float, default=0.0, help="from the first torque to the error [s]"
    )
    parser.add_argument(
        "--silent-after", type=float, help="from the first torque on it answers no more [s]"
    )
    parser.add_argument(
        "--trace", type=Path, help="file for time [ns], command and torque [N m], a line each"
    )
    return parser


def _end(*_: object) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
