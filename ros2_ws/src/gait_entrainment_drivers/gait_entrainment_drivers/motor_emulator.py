# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The motor's side of a CAN bus as a process of its own: what the emulators share.

An emulator speaks on any python-can bus that crosses processes and reproduces what a real motor
does to its users: it holds the last command when frames stop, unless its own watchdog is switched
on (real ones have it off by default); frames get lost; errors come up.

Its torque follows the command as a first-order lag. Not modelled: motion (position and velocity
are zero), heat, supply, arbitration and load of the bus, bit errors.
"""

import argparse
import math
import random
import signal
import sys
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, TextIO

from gait_entrainment.robot.faults import DeviceError
from gait_entrainment_drivers.can_bus import open_bus

Frames = list[tuple[int, bytes]]  # id and data of each

# How often the emulator looks after itself while no frame comes [s].
_TICK = 0.001


class EmulatedMotor(ABC):
    """
    The motor itself, without a bus: frames in, replies out, torque as a function of time.

    Parameters
    ----------
    bandwidth
        Of the torque [Hz].
    timeout
        Its own watchdog [s]: it acts when it was not fed for so long; 0 is off.

    """

    def __init__(self, bandwidth: float, timeout: float) -> None:
        self.error = 0
        self.enabled = False
        self.command = 0.0  # held [N m]
        self.torque = 0.0  # delivered [N m]
        self._bandwidth = bandwidth
        self._timeout = timeout
        self._now = 0.0
        self._fed = 0.0

    def advance(self, now: float) -> None:
        """Let the torque follow up to a time [s]."""
        if self._timeout and now - self._fed > self._timeout:
            self.expire()
        target = self.command if self.enabled and not self.error else 0.0
        decay = math.exp(-2 * math.pi * self._bandwidth * (now - self._now))
        self.torque = target + (self.torque - target) * decay
        self._now = now

    def feed(self, now: float) -> None:
        """Let the torque follow up to a time [s] at which the watchdog is fed."""
        self.advance(now)
        self._fed = now

    @abstractmethod
    def expire(self) -> None:
        """Act on the watchdog's having expired."""

    @abstractmethod
    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Obey a frame at a time [s] and return the replies; none where it is not addressed."""

    def spontaneous(self, now: float) -> Frames:  # noqa: ARG002
        """Return frames that the motor sends without being asked."""
        return []


def emulator_parser(name: str, description: str) -> argparse.ArgumentParser:
    """Return a command line with what every emulator takes."""
    parser = argparse.ArgumentParser(
        prog=name,
        description=description,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--interface", default="udp_multicast", help="python-can interface")
    parser.add_argument("--channel", default="239.74.163.2", help="channel of the bus")
    parser.add_argument(
        "--port", type=int, default=0, help="UDP port of udp_multicast; 0: python-can's own"
    )
    parser.add_argument(
        "--bandwidth", type=float, default=30.0, help="bandwidth of the torque [Hz]"
    )
    parser.add_argument(
        "--timeout", type=float, default=0.0, help="the motor's own watchdog [s]; 0 is off"
    )
    parser.add_argument(
        "--loss", type=float, default=0.0, help="share of the frames that get lost"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the losses")
    parser.add_argument(
        "--error", type=lambda text: int(text, 0), default=0, help="error that comes up"
    )
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


def run_emulator(motor: EmulatedMotor, name: str, options: argparse.Namespace) -> int:
    """Run a motor on its bus until SIGINT or SIGTERM; 1 where the bus cannot be opened."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    try:
        bus = open_bus(options.interface, options.channel, 1_000_000, options.port)
    except DeviceError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    print(f"{name}: ready", flush=True)
    with bus:
        trace = options.trace.open("w", buffering=1) if options.trace else None
        try:
            _serve(bus, motor, options, trace)
        except KeyboardInterrupt:
            pass
        finally:
            if trace is not None:
                trace.close()
    return 0


def _serve(
    bus: Any, motor: EmulatedMotor, options: argparse.Namespace, trace: TextIO | None
) -> None:
    import can

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
            motor.error |= options.error
        if trace is not None:
            trace.write(f"{time.time_ns()} {motor.command:.4f} {motor.torque:.4f}\n")
        replies = motor.spontaneous(now)
        lost = chance.random() < options.loss
        if message is not None and not message.is_extended_id and not lost:
            remote = message.is_remote_frame
            data = bytes(message.data)
            replies += motor.obey(message.arbitration_id, data, remote=remote, now=now)
        if options.silent_after is not None and under_torque > options.silent_after:
            continue
        for identifier, data in replies:
            if chance.random() >= options.loss:
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


def _end(*_: object) -> None:
    raise KeyboardInterrupt
