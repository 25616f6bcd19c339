# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Code shared by the motor emulators: the motor's side of a CAN bus, as a separate process.

An emulator runs on any python-can bus that connects processes, and has the hazards of a real
motor: it holds the last command when frames stop, unless its own watchdog is switched on (real
motors have it off by default); frames get lost; errors occur.

Its torque follows the command as a first-order lag. Not modelled: motion (position and velocity
are zero), heat, supply, bus arbitration and load, bit errors.
"""

import argparse
import math
import os
import random
import signal
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any, TextIO

import can

from gait_entrainment.robot.faults import DeviceError
from gait_entrainment_drivers.can_bus import open_bus, send

Frames = list[tuple[int, bytes]]  # id and data of each

_PRIORITY = 60  # above the loop that times the torque
# Update period of the emulator while no frame arrives [s].
_TICK = 0.001
# Name, type, default and meaning of the options that every emulator has.
_OPTIONS: tuple[tuple[str, Callable[[str], object], object, str], ...] = (
    ("--interface", str, "udp_multicast", "python-can interface"),
    ("--channel", str, "239.74.163.2", "bus channel"),
    ("--port", int, 0, "UDP port of udp_multicast; 0 is python-can's default"),
    ("--bandwidth", float, 30.0, "torque bandwidth [Hz]"),
    ("--timeout", float, 0.0, "timeout of the motor's own watchdog [s]; 0 is off"),
    ("--loss", float, 0.0, "share of frames that are lost"),
    ("--seed", int, 0, "random seed of the losses"),
    ("--error", lambda text: int(text, 0), 0, "error that the motor reports"),
    ("--error-after", float, 0.0, "from the first torque to the error [s]"),
    ("--silent-after", float, math.inf, "from the first torque to the last answer [s]"),
    ("--trace", Path, None, "file for time [ns], command and torque [N m], one line per update"),
)


class EmulatedMotor(ABC):
    """
    The motor itself, without a bus: frames in, replies out, torque as a function of time.

    ``bandwidth`` [Hz] is that of the torque. The motor's own watchdog expires when it is not fed
    for longer than ``timeout`` [s]; 0 switches it off.
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
        """Do what the watchdog does when it expires."""

    @abstractmethod
    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Handle a frame at a time [s]; return the replies, none if it is for another motor."""

    def spontaneous(self, now: float) -> Frames:  # noqa: ARG002
        """Return frames that the motor sends without a request."""
        return []


def run_emulator(
    name: str,
    description: str,
    make: Callable[[argparse.Namespace], EmulatedMotor],
    **more: dict[str, Any],
) -> int:
    """
    Run a motor emulator until SIGINT or SIGTERM; return 1 if the bus cannot be opened.

    ``make`` creates the motor from the options; ``more`` are further options, by name, with
    their arguments for argparse.
    """
    parser = argparse.ArgumentParser(
        name, description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    for option, kind, default, meaning in _OPTIONS:
        parser.add_argument(option, type=kind, default=default, help=meaning)
    for option, settings in more.items():
        parser.add_argument("--" + option.replace("_", "-"), **settings)
    options = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        bus = open_bus(options.interface, options.channel, 1_000_000, options.port)
    except DeviceError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    with suppress(PermissionError):  # it represents hardware, which never waits
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    print(f"{name}: ready", flush=True)
    trace = options.trace.open("w", buffering=1) if options.trace else nullcontext()
    with bus, trace as file, suppress(KeyboardInterrupt):
        _serve(bus, make(options), options, file)
    return 0


def _serve(
    bus: can.BusABC, motor: EmulatedMotor, options: argparse.Namespace, trace: TextIO | None
) -> None:
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
        if under_torque > options.silent_after:
            continue
        for identifier, data in replies:
            if chance.random() >= options.loss:
                send(bus, identifier, data)
