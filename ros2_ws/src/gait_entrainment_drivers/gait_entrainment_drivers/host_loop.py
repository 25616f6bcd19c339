# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Robots whose pulses are timed by the host: a thread streams torque to the device.

A driver of such a device says how to open, enable, exchange one command for one reading, disable
and shut; the loop, its timing, the account of what was delivered and the faults are here.
"""

import contextlib
import math
import threading
import time
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.robot import AnkleRobot, PulseTrain, RobotState, TorqueProfile
from gait_entrainment.robot.faults import (
    DEVICE_SILENT,
    DRIVER_FAILED,
    HOST_LOOP_LATE,
    DeviceError,
    Fault,
    LimitError,
)

# Before the device is disabled it is asked for zero torque this often, so that a lost frame does
# not matter, and on until its torque has run down to this share of its peak, or for this long [s].
_ZERO_TICKS = 5
_RUN_DOWN_SHARE = 0.02
_RUN_DOWN_TIME = 0.2
# The loop has this long to end [s].
_JOIN_TIMEOUT = 1.0


@dataclass(frozen=True)
class Reading:
    """A device's answer to one command."""

    torque: float  # measured [N m], plantarflexion positive
    angle: float  # measured [rad], plantarflexion positive; NaN if it measures none
    faults: tuple[Fault, ...] = ()


class HostTimedRobot(AnkleRobot):
    """
    Streams torque at a fixed rate from a thread of its own, outside any executor.

    A subclass sets ``capabilities``, calls this constructor and implements the five methods whose
    names begin with an underscore. They are called from one thread at a time: ``_open`` and
    ``_shut`` by configure and close, the others by the loop while it runs.

    The loop sends ``rate`` commands per second. It may wake up ``lateness`` [s] late; without an
    answer for longer than ``silence`` [s] the device counts as silent. After a fault it goes on
    and commands zero torque. A state is stamped with the instant at which the command was sent;
    what it measured is up to one round trip younger.
    """

    def __init__(self, side: Side, rate: float, silence: float, lateness: float) -> None:
        self._side = side
        self._period = 1 / rate
        self._silence = silence
        self._lateness = lateness
        self._train: PulseTrain | None = None
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._faults: tuple[Fault, ...] = ()
        self._halted = False  # no torque until closed
        self._lock = threading.Lock()  # of the two lists, which the loop fills
        self._states: list[RobotState] = []
        self._samples: list[tuple[int, float]] = []
        self._held = 0.0  # torque of the last sample that was promised [N m]
        self._promised = 0  # up to this instant [ns]; 0 until a run begins
        self._offset = time.time_ns() - time.monotonic_ns()  # from steady time to stamps

    @abstractmethod
    def _open(self) -> None:
        """Connect; see that the device answers and is the right one; may raise DeviceError."""

    @abstractmethod
    def _enable(self) -> None:
        """Enable the device at zero torque; may raise DeviceError."""

    @abstractmethod
    def _exchange(self, torque: float, patience: float) -> Reading | None:
        """Send a torque [N m]; return the answer, or None if there is none in time [s]."""

    @abstractmethod
    def _disable(self) -> None:
        """Disable the device, whose torque is zero."""

    @abstractmethod
    def _shut(self) -> None:
        """Release everything; may be called twice, and without ``_open``."""

    # The contract

    def configure(self) -> None:
        """Connect."""
        self._faults, self._halted, self._train = (), False, None
        self._open()

    def activate(self) -> None:
        """Enable the device and start to stream zero torque."""
        try:
            self._enable()
        except BaseException:
            # How far it got is not known, and no loop will disable it.
            with contextlib.suppress(Exception):
                self._disable()
            raise
        self._ending.clear()
        self._promised = 0
        self._thread = threading.Thread(target=self._run, name="torque loop", daemon=True)
        self._thread.start()

    def begin(self, start: int) -> None:
        """Start the account of a run."""
        with self._lock:
            self._train = None
            self._promised, self._states = start, []
            # Earlier stamps are of another offset if the wall clock has been set since.
            self._held = self._samples[-1][1] if self._samples else 0.0
            self._samples = []
            self._offset = time.time_ns() - time.monotonic_ns()

    def schedule(self, train: PulseTrain) -> None:
        """Take over a train; raises LimitError if its first onset is over already."""
        late = time.monotonic_ns() + self._offset - train.first_onset
        if late > 0:
            raise LimitError(f"first_onset: is over by {late / NANOSECONDS_PER_SECOND:.3g} s")
        self._train = train

    def cancel(self) -> None:
        """Drop the train; the next command is zero."""
        self._train = None

    def promise(self, until: int) -> TorqueProfile:
        """Return the measured torque from the last promise up to the last measurement."""
        begin = self._promised
        with self._lock:
            known = [sample for sample in self._samples if sample[0] < until]
            # The last sample holds until a later one is known: it is promised with that one.
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
        """Return one state for each command that was answered, and each tick without an answer."""
        with self._lock:
            states, self._states = self._states, []
        return states

    def stop(self) -> None:
        """Drop the train for good: the loop's next command is zero."""
        self._halted = True
        self._train = None

    def deactivate(self) -> None:
        """End the loop, which sends zero torque and disables the device on its way out."""
        self._train = None
        thread, self._thread = self._thread, None
        if thread is None:
            return
        self._ending.set()
        thread.join(_JOIN_TIMEOUT)
        if thread.is_alive():
            raise DeviceError("the torque loop does not end: cut the power of the device")
        if DRIVER_FAILED in self._faults:
            raise DeviceError("the torque loop failed before the device was disabled")

    def close(self) -> None:
        """End the loop and release the device."""
        with contextlib.suppress(DeviceError):
            self.deactivate()
        with contextlib.suppress(Exception):
            self._shut()

    # The loop

    def _run(self) -> None:
        try:
            self._stream()
        except Exception:
            self._fault(DRIVER_FAILED)
            self._note(time.monotonic_ns(), 0.0, None)
        finally:
            # Zero before disabling, whatever happened; each step even if the one before fails.
            self._run_down()
            with contextlib.suppress(Exception):
                self._disable()

    def _stream(self) -> None:
        due = last_answer = time.monotonic()
        while not self._ending.is_set():
            if time.monotonic() - due > self._lateness:
                self._fault(HOST_LOOP_LATE)
            sent = time.monotonic_ns()
            train = None if self._halted else self._train
            torque = train.torque_at(sent + self._offset) if train is not None else 0.0
            # Most of the period at most: an answer that comes later is read with the next one.
            reading = self._exchange(torque, 0.8 * self._period)
            if reading is not None:
                last_answer = time.monotonic()
                for fault in reading.faults:
                    self._fault(fault)
            elif time.monotonic() - last_answer > self._silence:
                self._fault(DEVICE_SILENT)
            self._note(sent, torque, reading)
            due = max(due + self._period, time.monotonic() - self._lateness)
            self._ending.wait(max(due - time.monotonic(), 0.0))

    def _run_down(self) -> None:
        gone = _RUN_DOWN_SHARE * self.capabilities.peak_torque
        give_up = time.monotonic() + _RUN_DOWN_TIME
        ticks, torque = 0, math.inf
        while (ticks < _ZERO_TICKS or abs(torque) > gone) and time.monotonic() < give_up:
            with contextlib.suppress(Exception):
                reading = self._exchange(0.0, 0.8 * self._period)
                torque = math.inf if reading is None else reading.torque
            ticks += 1
            time.sleep(self._period)

    def _fault(self, fault: Fault) -> None:
        self._halted = True
        self._train = None
        if fault not in self._faults:
            self._faults = (*self._faults, fault)

    def _note(self, sent: int, torque: float, reading: Reading | None) -> None:
        stamp = sent + self._offset
        with self._lock:
            if not self._promised:  # nobody asks for samples until a run begins
                self._samples, self._states = self._samples[-1:], self._states[-1:]
            if reading is not None:
                self._samples.append((stamp, reading.torque))
            if reading is not None or self._faults:
                measured = reading or Reading(math.nan, math.nan)
                state = RobotState(stamp, torque, measured.torque, measured.angle, self._faults)
                self._states.append(state)
