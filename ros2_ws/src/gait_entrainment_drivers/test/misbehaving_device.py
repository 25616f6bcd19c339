# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A device without hardware that misbehaves on request and traces its commands."""

import math
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path

from gait_entrainment.robot.faults import Fault
from gait_entrainment.settings import setting
from gait_entrainment_drivers.device import Reading, TorqueDevice
from gait_entrainment_drivers.host_timed import HostTimedRobot, LoopOptions

PEAK = 20.0
OVERHEATED = Fault("overheated", "The motor is too hot.")


@dataclass(frozen=True)
class MisbehavingOptions(LoopOptions):
    """What goes wrong, when it starts, and the file that commands are written to."""

    does: str = setting("nothing", "what goes wrong")
    after: float = setting(0.0, "since the first command of torque", "s", (0.0, 100.0))
    trace: str = setting("", "file for time [ns] and commanded torque [N m]")


class MisbehavingDevice(TorqueDevice):
    """Follows its command with a lag of 30 Hz until it misbehaves."""

    name = "bench device"

    def __init__(self, options: MisbehavingOptions) -> None:
        self._options = options
        self.address = f"bench device with trace {options.trace}"
        self.capabilities = options.capabilities(PEAK)
        self._torque = self._command = 0.0
        self._at = self._first = math.inf
        self._frozen: Reading | None = None
        self._past: deque[tuple[float, float]] = deque()
        self._trace = Path(options.trace) if options.trace else None

    def open(self) -> None:
        """Nothing to connect."""

    def enable(self) -> None:
        """Nothing to enable."""

    def forget(self) -> None:
        """No answer is ever left over."""

    def disable(self) -> None:
        """Write it to the trace, as NaN."""
        self._note(math.nan)

    def shut(self) -> None:
        """Nothing to release."""

    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """Follow the command, or misbehave."""
        now = time.monotonic()
        if torque and math.isinf(self._first):
            self._first = now
        does = self._options.does if now - self._first >= self._options.after else "nothing"
        self._note(torque)
        if does == "raise" and torque:
            raise OSError("bus gone")
        if does == "take its time":
            self._first = math.inf
            time.sleep(0.2)
        if does == "stutter":
            time.sleep(0.1)
        reading = Reading(self._follow(torque, now), 0.1, 0.0, 30.0)
        if does == "stop answering":
            time.sleep(timeout)
            return None
        return {
            "push 12 N m": replace(reading, torque=12.0),
            "push the wrong way": replace(reading, torque=-reading.torque),
            "answer 40 ms late": self._late(reading, now),
            "repeat one reply": self._repeated(reading, does),
            "stick at 2 rad": replace(reading, angle=2.0),
            "spin": replace(reading, velocity=60.0),
            "heat up": replace(reading, temperature=120.0),
            "report an error": replace(reading, faults=(OVERHEATED,)),
            "measure NaN": replace(reading, torque=math.nan),
            "lose the angle": replace(reading, angle=math.nan),
            "answer a number": reading.torque,
            "measure None": replace(reading, torque=None),
            "report a text": replace(reading, faults=("overheated",)),
        }.get(does, reading)

    def _follow(self, torque: float, now: float) -> float:
        decay = math.exp(-2 * math.pi * 30.0 * max(now - self._at, 0.0))
        self._torque = self._command + (self._torque - self._command) * decay
        self._command, self._at = torque, now
        return self._torque

    def _late(self, reading: Reading, now: float) -> Reading:
        self._past.append((now, reading.torque))
        while len(self._past) > 1 and self._past[1][0] < now - 0.04:
            self._past.popleft()
        return replace(reading, torque=self._past[0][1])

    def _repeated(self, reading: Reading, does: str) -> Reading:
        if does != "repeat one reply" or self._frozen is None:
            self._frozen = reading
        return self._frozen

    def _note(self, torque: float) -> None:
        if self._trace is not None:
            with self._trace.open("a") as file:
                file.write(f"{time.time_ns()} {torque:.4f}\n")


class MisbehavingRobot(HostTimedRobot):
    """The robot of the tests."""

    Options = MisbehavingOptions
    Device = MisbehavingDevice
