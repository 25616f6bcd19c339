# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
serial_ankle_emulator: the robot's side of the line, as a process on a pseudo-terminal.

It has the hazard of a real robot: without its own watchdog it holds the last command.
Not modelled: motion, heat, line speed, bit errors.
"""

import argparse
import contextlib
import math
import os
import pty
import select
import sys
import time
import tty

from serial_ankle_robot.frames import (
    DRIVER_FAULT,
    ENABLED,
    TORQUE,
    WATCHDOG_EXPIRED,
    Command,
    Reply,
    take_frame,
)

_TICK = 0.001  # update period while nothing arrives [s]


class EmulatedRobot:
    """
    The robot itself, without a line: frames in, replies out, torque as a function of time.

    The torque follows with a first-order lag of a bandwidth [Hz]. The watchdog expires when no
    command arrives for longer than ``timeout`` [s]; 0 switches it off.
    """

    def __init__(self, bandwidth: float, timeout: float) -> None:
        self.torque = self.command = 0.0  # delivered and held [N m]
        self.status = 0
        self._bandwidth, self._timeout = bandwidth, timeout
        self._now = self._fed = 0.0

    def advance(self, now: float) -> None:
        """Let the torque follow up to a time [s]."""
        if self.status & ENABLED and self._timeout and now - self._fed > self._timeout:
            self.status = self.status & ~ENABLED | WATCHDOG_EXPIRED
        on = self.status & ENABLED and not self.status & DRIVER_FAULT
        target = self.command if on else 0.0
        decay = math.exp(-2 * math.pi * self._bandwidth * (now - self._now))
        self.torque = target + (self.torque - target) * decay
        self._now = now

    def obey(self, command: Command, now: float) -> Reply:
        """Carry out a command at a time [s]; return the reply, measured before it takes effect."""
        self.advance(now)
        reply = Reply(command.number, self.status, self.torque)
        self._fed, self.command = now, command.torque
        if command.mode != TORQUE:  # this also clears the watchdog
            self.status &= DRIVER_FAULT
        elif not self.status & WATCHDOG_EXPIRED:
            self.status |= ENABLED
        return reply


def main() -> int:
    """Run the emulator until it is terminated."""
    parser = argparse.ArgumentParser(
        "serial_ankle_emulator",
        description="Emulate an ankle robot on a pseudo-terminal, and print its name.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--bandwidth", type=float, default=30.0, help="torque bandwidth [Hz]")
    parser.add_argument("--timeout", type=float, default=0.0, help="watchdog timeout [s]; 0: off")
    parser.add_argument("--fault-after", type=float, help="from the first torque to a fault [s]")
    options = parser.parse_args()
    ours, theirs = pty.openpty()
    tty.setraw(theirs)  # kept open: a driver that closes the line leaves the robot running
    with contextlib.suppress(PermissionError):  # it represents hardware, which never waits
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(60))
    print(os.ttyname(theirs), flush=True)
    robot = EmulatedRobot(options.bandwidth, options.timeout)
    received, torque_since = bytearray(), math.inf
    while True:
        if select.select([ours], [], [], _TICK)[0]:
            received += os.read(ours, 4096)
        now = time.monotonic()
        robot.advance(now)
        if options.fault_after is not None and now - torque_since > options.fault_after:
            robot.status |= DRIVER_FAULT
        while (body := take_frame(received, Command)) is not None:
            command = Command.unpack(body)
            torque_since = min(torque_since, now) if command.torque else torque_since
            os.write(ours, robot.obey(command, now).pack())


if __name__ == "__main__":
    sys.exit(main())
