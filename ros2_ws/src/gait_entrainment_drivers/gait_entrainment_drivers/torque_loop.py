# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The torque loop: a separate process that streams torque to one device and does nothing else.

No ROS, no threads, garbage collection frozen; SCHED_FIFO and locked memory if the system permits
them (docs/safety.md describes how to permit them, and the cost of not doing so). Its parent, the
robot's process, uses a socket (link.py): trains come in, samples go out, and neither side waits.
If the parent ends or falls silent, or any process requests a stop, torque goes to zero here.

    python -m gait_entrainment_drivers.torque_loop DESCRIPTOR     started by host_timed.py
"""

import contextlib
import ctypes
import gc
import math
import os
import select
import signal
import socket
import sys
import time
from typing import Any

from gait_entrainment.robot.faults import DRIVER_FAILED, STOPPED, DeviceError, Fault
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment_drivers.device import Reading, TorqueDevice
from gait_entrainment_drivers.device_lock import DeviceLock
from gait_entrainment_drivers.link import Link, Sample
from gait_entrainment_drivers.monitor import NEAR_ZERO_SHARE, NOT_FALLING, Monitor, torque_scale
from gait_entrainment_drivers.stop_channel import StopAnswer, StopListener

DEVICE_SILENT = Fault(
    "device_silent",
    "The device sent no reply for longer than the limit: check its power and wiring, and what"
    " else loads this computer.",
)
HOST_LOOP_LATE = Fault(
    "host_loop_late",
    "The loop that times the torque woke up later than the limit: check what else loads this"
    " computer.",
)
DRIVER_SLOW = Fault(
    "driver_slow",
    "The driver's exchange takes longer than its timeout: check its bus and the load.",
)
HOST_SILENT = Fault(
    "host_silent",
    "The process that holds the robot was silent for longer than the limit: it is frozen, or "
    "this computer is overloaded.",
)
# Before the device is disabled, zero torque is sent this many times, in case a frame is lost, and
# then until torque has fallen to this share of its scale, or for this long [s].
_ZERO_TICKS = 5
_RUN_DOWN_SHARE = 0.02
_RUN_DOWN_TIME = 0.2
# After it is ended, torque has this long to fall [s].
_FALL_TIME = 0.15
# Polling period of the stop channel and the parent while nothing is streamed [s].
_IDLE_PERIOD = 0.02
# Below the kernel's own threads, above all user processes.
_PRIORITY = 50
_MCL_CURRENT_AND_FUTURE = 3
_PR_SET_PDEATHSIG = 1


class TorqueLoop:
    """Streams torque to a device; see the module's docstring."""

    def __init__(self, link: Link, device: TorqueDevice, settings: Any) -> None:
        self._link, self._device, self._settings = link, device, settings
        self._stop_channel = StopListener(device.name)
        self._period = 1 / settings.rate
        capabilities = device.capabilities
        self._gone = _RUN_DOWN_SHARE * torque_scale(capabilities)
        self._near_zero = NEAR_ZERO_SHARE * torque_scale(capabilities)
        self._monitor = Monitor(settings, capabilities)
        self._lock: DeviceLock | None = None  # while the device is open
        self._train: PulseTrain | None = None  # onsets in steady time
        self._faults: tuple[Fault, ...] = ()
        self._enabled = self._closing = False
        self._halted = False  # no more torque for the life of this process
        self._samples: list[Sample] = []  # not handed over yet
        self._askers: list[str | bytes | None] = []  # senders of a stop, not answered yet
        self._ended_at = math.inf  # when torque was ended [s]
        self._measured = math.nan  # torque measured last [N m]
        self._took = 0.0  # duration of the latest exchange [s]
        self._heard_at = self._answered_at = self._due = time.monotonic()

    def serve(self) -> None:
        """Serve until the parent closes the loop or is gone."""
        try:
            while not self._closing:
                if self._enabled:
                    self._tick()
                else:
                    ends: list[Link | StopListener] = [self._link, self._stop_channel]
                    select.select(ends, [], [], _IDLE_PERIOD)
                    self._listen()
        finally:
            self._disable()
            with contextlib.suppress(Exception):
                self._device.shut()
            if self._lock is not None:
                self._lock.release()
            self._stop_channel.close()

    # One command

    def _tick(self) -> None:
        time.sleep(max(self._due - time.monotonic(), 0.0))
        self._listen()
        late = time.monotonic() - self._due
        if late > self._settings.lateness:
            self._end_torque(DRIVER_SLOW if self._took > late / 2 else HOST_LOOP_LATE)
        if not self._enabled:
            return
        sent = time.monotonic_ns()
        now = sent / 1e9
        train = self._train
        torque = train.torque_at(sent) if train is not None else 0.0
        if train is not None and now - self._heard_at > self._settings.host_silence:
            self._end_torque(HOST_SILENT)
            torque = 0.0
        self._monitor.expect(torque, now)
        reading = self._exchange(torque, late, now)
        self._took = time.monotonic() - now
        if reading is not None:
            self._answered_at, self._measured = now, reading.torque
        elif now - self._answered_at > self._settings.silence:
            self._end_torque(DEVICE_SILENT)
        self._samples.append(Sample(sent, torque, reading, late))
        del self._samples[:-30_000]  # the parent may be frozen for hours
        self._answer_stops(now)
        self._link.send_samples(self._samples)
        # After a hiccup the loop continues from now: missed commands are not made up for, and
        # several short hiccups do not add up to a long one.
        self._due = max(self._due + self._period, now)

    def _exchange(self, torque: float, late: float, now: float) -> Reading | None:
        """Exchange a torque for a reading and judge it; after any exception, zero is sent."""
        try:
            if late > self._period:
                self._device.forget()
            # Wait for most of the period at most: a later answer is read with the next one.
            reading = self._device.exchange(torque, 0.8 * self._period)
            if reading is not None:
                for fault in (*reading.faults, *self._monitor.judge(reading, now)):
                    self._end_torque(fault)
            return reading
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            self._end_torque(Fault(DRIVER_FAILED.name, f"The driver's exchange failed: {text}."))
            return None

    def _end_torque(self, fault: Fault | None = None) -> None:
        """Command zero torque from now on, permanently, for this reason."""
        self._train = None
        if not self._halted:
            self._halted, self._ended_at = True, time.monotonic()
        if fault is not None and fault.name not in {known.name for known in self._faults}:
            self._faults = (*self._faults, fault)
            self._link.send("faults", self._faults)

    def _answer_stops(self, now: float) -> None:
        """Answer the senders of a stop once torque has fallen, or does not fall in time."""
        ended = now - self._ended_at
        fell = abs(self._measured) <= self._near_zero
        current = now - self._answered_at < self._settings.silence
        if ended > _FALL_TIME and not (fell and current):
            self._end_torque(NOT_FALLING)
        if not self._askers:
            return
        if fell and current and self._answered_at > self._ended_at:
            answer = StopAnswer(
                True, f"torque is zero, latched ({self._measured:+.2f} N m measured)"
            )
        elif ended > _FALL_TIME:
            measured = f"{self._measured:+.2f} N m measured" if current else "nothing measured"
            answer = StopAnswer(False, f"zero is commanded, but {measured}: cut the power")
        else:
            return
        self._stop_channel.answer(self._askers, answer)
        self._askers = []

    # Listening

    def _listen(self) -> None:
        """Take stop requests and the parent's messages."""
        askers = self._stop_channel.requests()
        if askers:
            self._end_torque(STOPPED)
            if self._enabled:
                self._askers += askers
            else:
                answer = StopAnswer(True, "not enabled: no torque is possible; latched")
                self._stop_channel.answer(askers, answer)
        try:
            messages = self._link.received()
        except EOFError:
            self._closing = True  # the parent has ended
            return
        for kind, *content in messages:
            self._heard_at = time.monotonic()
            self._obey(kind, *content)

    def _obey(self, kind: str, *content: Any) -> None:
        if kind == "train":
            (train,) = content
            if not self._halted:
                self._train = self._train.followed_by(train) if self._train else train
        elif kind == "cancel":
            self._train = None
        elif kind == "stop":
            self._end_torque()  # the parent knows why
        elif kind == "freeze":
            os.kill(os.getpid(), signal.SIGSTOP)
            self._listen()  # the next message was sent before SIGCONT
        elif kind in ("open", "enable", "disable", "close"):
            error = ""
            try:
                getattr(self, f"_{kind}")()
            except Exception as failure:
                named = "" if isinstance(failure, DeviceError) else f"{type(failure).__name__}: "
                error = f"{named}{failure}"
            self._link.send("done", kind, error)

    def _open(self) -> None:
        self._lock = DeviceLock(self._device.address)
        self._device.open()
        self._link.send("identity", self._device.identity)

    def _enable(self) -> None:
        try:
            self._device.enable()
        except BaseException:
            # How far it got is unknown, and nothing is streamed that would bring zero torque.
            with contextlib.suppress(Exception):
                self._device.disable()
            raise
        self._enabled = True
        self._due = self._answered_at = self._heard_at = time.monotonic()

    def _disable(self) -> None:
        """Bring the torque to zero, then disable; do each step even if the previous one fails."""
        if not self._enabled:
            return
        self._train, self._enabled = None, False
        give_up = time.monotonic() + _RUN_DOWN_TIME
        ticks, torque = 0, math.inf
        while (ticks < _ZERO_TICKS or abs(torque) > self._gone) and time.monotonic() < give_up:
            with contextlib.suppress(Exception):
                reading = self._device.exchange(0.0, 0.8 * self._period)
                torque = math.inf if reading is None else reading.torque
                if reading is not None:
                    self._answered_at, self._measured = time.monotonic(), torque
            ticks += 1
            time.sleep(self._period)
        self._answer_stops(time.monotonic())  # no later call answers them
        with contextlib.suppress(Exception):
            self._device.disable()

    def _close(self) -> None:
        self._closing = True


def prefer_this_process() -> str:
    """Request real-time scheduling and locked memory; return what was refused, as text."""
    gc.collect()
    gc.freeze()
    gc.disable()  # nothing in the loop creates reference cycles
    refused = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError:
        refused.append("SCHED_FIFO")
    if ctypes.CDLL(None).mlockall(_MCL_CURRENT_AND_FUTURE) != 0:
        refused.append("locked memory")
    return " and ".join(refused)


def main() -> int:
    """Serve the parent at the other end of the socket with the given descriptor."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)  # the parent obeys them, and then informs the loop
    # When its parent dies, a frozen loop is continued and notices it.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGCONT)
    link = Link(socket.socket(fileno=int(sys.argv[1])))
    device_type, options = link.first()
    loop = TorqueLoop(link, device_type(options), options)
    signal.signal(signal.SIGTERM, lambda *_: loop._close())
    link.send("scheduling", prefer_this_process())
    loop.serve()
    return 0


if __name__ == "__main__":
    sys.exit(main())
