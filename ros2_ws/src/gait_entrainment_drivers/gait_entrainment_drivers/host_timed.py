# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Robots whose pulses are timed by the host: the driver contract on top of a torque loop.

The loop is a separate process (torque_loop.py). This module sends trains to it, and turns its
samples into promises and states.
"""

import contextlib
import math
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.robot.contract import AnkleRobot, Capabilities, LoopTiming, RobotState
from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment.settings import setting
from gait_entrainment_drivers.device import TorqueDevice
from gait_entrainment_drivers.link import Link, Sample
from gait_entrainment_drivers.monitor import MonitorSettings

_LOOP = "gait_entrainment_drivers.torque_loop"
# The loop has this long to start, and to open, enable, disable or close its device [s].
_START_TIMEOUT = 10.0
_ANSWER_TIMEOUT = 2.0
# Commands whose lateness is remembered: ten seconds of the fastest loop.
_REMEMBERED = 10_000
_LOOP_ENDED = Fault(
    "torque_loop_ended",
    "The process that streams torque has ended: the device's own watchdog must bring the torque "
    "to zero. If torque is felt, cut the power.",
)
_LOOP_SILENT = Fault(
    "torque_loop_silent",
    "The process that streams torque was silent for longer than the limit: it or a call of its "
    "driver is frozen. The device's own watchdog must bring the torque to zero. If torque is "
    "felt, cut the power.",
)


@dataclass(frozen=True)
class LoopOptions(MonitorSettings):
    """How the torque loop runs, and how it checks the readings."""

    rate: float = setting(500.0, "torque commands per second", "Hz", (50.0, 1000.0))
    silence: float = setting(0.05, "longest silence of the device", "s", (0.005, 1.0))
    lateness: float = setting(0.05, "longest delay in waking up the loop", "s", (0.005, 1.0))
    host_silence: float = setting(
        0.2, "longest silence of the robot's process, or of the loop itself", "s", (0.02, 5.0)
    )
    bandwidth: float = setting(
        30.0,
        "torque bandwidth (-3 dB) of the device, by which its readings are judged",
        "Hz",
        (1.0, 500.0),
    )

    def capabilities(self, peak_torque: float) -> Capabilities:
        """Return the capabilities of a device that measures its torque, for a peak [N m]."""
        return Capabilities(
            peak_torque,
            torque_rate=math.inf,
            measures_torque=True,
            simulated=False,
            state_rate=self.rate,
            torque_bandwidth=self.bandwidth,
        )


class HostTimedRobot(AnkleRobot):
    """
    A device to which the host streams torque at a fixed rate, from a separate process.

    A driver names its device, a TorqueDevice; its options must have the fields of LoopOptions.
    A state's stamp is the time at which the command was sent; the measurement is up to one round
    trip later. After a fault the loop continues and commands zero torque.
    """

    Device: ClassVar[type[TorqueDevice]]

    def __init__(self, side: Side, options: Any, seed: int) -> None:  # noqa: ARG002
        self._side, self._options = side, options
        self.capabilities = self.Device(options).capabilities
        self._process: subprocess.Popen[bytes] | None = None
        self._link: Link | None = None
        self._train: PulseTrain | None = None
        self._faults: tuple[Fault, ...] = ()
        self._states: list[RobotState] = []
        self._late: deque[float] = deque(maxlen=_REMEMBERED)
        self.timing = LoopTiming(late=self._late)
        self._samples: list[tuple[int, float]] = []  # stamp [ns], measured torque [N m]
        self._held = 0.0  # torque of the last sample that was promised [N m]
        self._promised = 0  # up to this instant [ns]; 0 until a run begins
        self._offset = time.time_ns() - time.monotonic_ns()  # from steady time to stamps
        self._done: dict[str, str] = {}  # the loop's answers: error texts
        # The loop ends its torque by itself if it is late, and reports once per period at most.
        self._longest_silence = max(options.host_silence, options.lateness + 2 / options.rate)
        self._streams, self._heard_at = False, 0.0  # whether the loop streams; last heard at [s]
        self._latest = 0  # stamp of its latest sample [ns]

    # Lifecycle

    def configure(self) -> None:
        """Start the loop and have it connect."""
        self._faults, self._train, self._done = (), None, {}
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", _LOOP, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env={**os.environ, "PYTHONSAFEPATH": "1"},  # no modules of the working folder
                start_new_session=True,  # a terminal's Ctrl-C and Ctrl-Z are for the parent
            )
        self._link = Link(ours)
        self._link.send(self.Device, self._options)
        self._ask("open", _START_TIMEOUT)

    def activate(self) -> None:
        """Have the loop enable the device and stream zero torque."""
        self._promised = 0
        self._ask("enable")
        self._streams = True

    def deactivate(self) -> None:
        """Have the loop bring the torque to zero and disable the device."""
        self._train, self._streams = None, False
        if self._process is not None and _LOOP_ENDED not in self._faults:
            self._ask("disable")

    def close(self) -> None:
        """End the loop, which brings the torque to zero before it exits."""
        process, link = self._process, self._link
        self._process = self._link = None
        if process is None or link is None:
            return
        link.send("close")
        try:
            process.wait(_ANSWER_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        link.close()

    # A run

    def begin(self, start: int) -> None:
        """Start the record of a run."""
        self.cancel()
        self._listen()
        self._promised, self._latest, self._states = start, time.time_ns(), []
        # Earlier stamps have another offset if the wall clock was set meanwhile.
        self._held = self._samples[-1][1] if self._samples else 0.0
        self._samples = []
        self._offset = time.time_ns() - time.monotonic_ns()

    def schedule(self, train: PulseTrain) -> None:
        """Hand over a train; raise LimitError if its first onset is in the past."""
        late = time.monotonic_ns() + self._offset - train.onsets[0]
        if late > 0:
            raise LimitError(f"onset: {late / NANOSECONDS_PER_SECOND:.3g} s in the past")
        self._train = self._train.followed_by(train) if self._train else train
        self._tell("train", train.shifted(-self._offset))

    def cancel(self) -> None:
        """Drop the train; the next command is zero."""
        self._train = None
        self._tell("cancel")

    def stop(self) -> None:
        """Drop the train permanently; the loop's next command is zero."""
        self._train = None
        self._tell("stop")

    def promise(self, until: int) -> TorqueProfile:
        """Return the measured torque from the last promise up to the last measurement."""
        self._listen()
        begin = self._promised
        known = [sample for sample in self._samples if sample[0] < until]
        # The last sample holds until a later one is known, and is promised with that one.
        end = until if len(known) < len(self._samples) else known[-1][0] if known else begin
        end = max(end, begin)
        self._samples = [sample for sample in self._samples if sample[0] >= end]
        changes = [(begin, self._held)]
        changes += [new for old, new in pairwise([*changes, *known]) if new[1] != old[1]]
        onsets = self._train.onsets_within(begin, end) if self._train is not None else ()
        profile = TorqueProfile.from_changes(self._side, begin, end, changes, onsets)
        self._held, self._promised = profile.torques[-1], end
        return profile

    def read(self) -> Sequence[RobotState]:
        """Return a state for each answered command and, after a fault, for each unanswered one."""
        self._tell("alive")
        self._listen()
        states, self._states = self._states, []
        return states

    @contextlib.contextmanager
    def frozen(self) -> Iterator[None]:
        """Freeze the loop's process between two commands; its ports and buses stay open."""
        process = self._process
        if process is None:
            raise DeviceError("the torque loop is not running; configure first")
        # It stops itself, because no command may be sent only in part.
        self._tell("freeze")
        give_up = time.monotonic() + _ANSWER_TIMEOUT
        try:
            while os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOHANG) is None:
                if time.monotonic() > give_up:
                    raise DeviceError("the torque loop does not freeze: cut the power")
                time.sleep(0.001)
            yield
        finally:
            process.send_signal(signal.SIGCONT)

    # The loop's messages

    def _tell(self, *message: Any) -> None:
        if self._link is not None:
            self._link.send(*message)

    def _ask(self, kind: str, timeout: float = _ANSWER_TIMEOUT) -> None:
        """Have the loop do something; raise DeviceError if it fails or does not answer."""
        link, give_up = self._link, time.monotonic() + timeout
        if link is None:
            raise DeviceError("the torque loop is not running; configure first")
        self._done.pop(kind, None)
        link.send(kind)
        while kind not in self._done:
            left = give_up - time.monotonic()
            if left <= 0:
                raise DeviceError(f"the torque loop does not answer ({kind}): cut the power")
            select.select([link], [], [], left)
            self._listen()
            if _LOOP_ENDED in self._faults:
                raise DeviceError(_LOOP_ENDED.meaning)
        if error := self._done[kind]:
            raise DeviceError(error)

    def _listen(self) -> None:
        """Take the loop's messages."""
        if self._link is None:
            return
        try:
            messages = self._link.received()
        except EOFError:
            self._miss(_LOOP_ENDED)
            return
        now = time.monotonic()
        if messages or not self._streams:
            self._heard_at = now
        elif now - self._heard_at > self._longest_silence:
            self._miss(_LOOP_SILENT)
        for kind, *content in messages:
            if kind == "samples":
                for sample in content[0]:
                    self._take(sample)
            elif kind == "faults":
                (self._faults,) = content
                self._train = None
            elif kind == "done":
                name, self._done[name] = content[0], content[1]
            elif kind == "scheduling":
                (self.timing.refused,) = content
            elif kind == "identity":
                (self.identity,) = content

    def _miss(self, fault: Fault) -> None:
        """Report that the loop is no longer heard, with the stamp of its latest sample."""
        if fault not in self._faults:
            self._train, self._faults = None, (*self._faults, fault)
            state = RobotState(self._latest, 0.0, math.nan, math.nan, self._faults)
            self._states.append(state)

    def _take(self, sample: Sample) -> None:
        stamp, reading = sample.sent + self._offset, sample.reading
        self._late.append(sample.late)
        self._latest = stamp
        if not self._promised:  # samples are not used until a run begins
            self._samples, self._states = self._samples[-1:], self._states[-1:]
        if reading is not None:
            self._samples.append((stamp, reading.torque))
            measured, angle = reading.torque, reading.angle
        elif self._faults:
            measured = angle = math.nan
        else:
            return
        self._states.append(RobotState(stamp, sample.commanded, measured, angle, self._faults))
