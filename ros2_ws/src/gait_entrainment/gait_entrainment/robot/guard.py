# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The safety envelope: the only way to reach an ankle robot, whatever its driver.

Nothing else holds the driver. Every train is checked against the limits before the driver sees it,
and delivered torque is checked afterwards. Every exit path, exceptions included, brings the torque
to zero before the device is disabled. Any fault latches: torque stays at zero until ``close`` and
``configure``.

docs/safety.md describes what software cannot guarantee on a system that is not real-time.
"""

import atexit
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import TypeVar

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.robot import faults
from gait_entrainment.robot.contract import AnkleRobot, Capabilities, LoopTiming, RobotState
from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.robot.limits import DeviceLimits, Dose
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import Pulse, PulseTrain

# Period at which the watchdog checks for silence [s].
_WATCH_PERIOD = 0.01
# After this long without a pulse [ns] the next pulses count as a new train, whose first ones rise.
_PAUSE = 5 * NANOSECONDS_PER_SECOND

_T = TypeVar("_T")


class GuardedRobot:
    """An ankle robot behind the safety envelope; nothing else may keep the driver."""

    def __init__(
        self,
        robot: AnkleRobot,
        side: Side,
        limits: DeviceLimits | None = None,
        dose: Dose | None = None,
    ) -> None:
        self._robot, self.side = robot, side
        self.capabilities: Capabilities = robot.capabilities  # what the device can do
        self.limits = limits or DeviceLimits()
        self.dose = dose or Dose()  # carried from robot to robot within a session
        self.train: PulseTrain | None = None  # scheduled in the run, as given to the driver
        self.delivered = 0  # pulses of the run that began before promised_until
        self.promised_until = 0  # everything before this instant is promised [ns]
        self.faults: tuple[Fault, ...] = ()  # what latched the torque at zero, in order
        self.partner: GuardedRobot | None = None  # on the other ankle: both stop together
        self.enabled = False  # whether the device has been activated, latched or not
        self._configured = self._in_run = False
        self._begun = 0  # pulses scheduled since the latest pause
        self._past: tuple[Pulse, ...] = ()  # pulses of cancelled trains that had begun
        self._read_until, self._unasked_since = -math.inf, math.inf  # stamps of states [ns]
        # Measured torque must be below the first, once the command has been zero for the second.
        self._unasked = 0.12 * min(self.capabilities.peak_torque, self.limits.torque)
        self._fall_time = nanoseconds(0.15 + 0.5 / self.capabilities.torque_bandwidth)
        self._offset = time.time_ns() - time.monotonic_ns()  # from steady time to the wall clock
        self._armed_until = -math.inf  # steady time [s]
        self._delivered_torque = _DeliveredTorque(self.limits)
        self._last_heard = self._news_at = math.inf  # experiment, new state: steady time [s]
        self._called_at = math.inf  # start of a driver call under way, steady time [s]
        self._watching = threading.Event()

    @property
    def identity(self) -> str:
        """What the device reports about itself, such as its firmware; may be empty."""
        return str(self._robot.identity or "")

    @property
    def timing(self) -> LoopTiming:
        """Timing of the loop that streams torque."""
        return self._robot.timing

    @property
    def armed(self) -> bool:
        """Whether torque is allowed."""
        return time.monotonic() < self._armed_until

    # Lifecycle. Each step raises DeviceError if it is out of order or the driver fails.

    def configure(self) -> None:
        """Connect to the device; clears latched faults."""
        if self._configured:
            raise DeviceError("the device is already configured; close it first")
        self.faults = ()
        try:
            self._call(self._robot.configure)
        except DeviceError:
            self._quietly(self._robot.close)
            raise
        self._configured = True

    def activate(self) -> None:
        """Enable the device at zero torque."""
        if not self._configured:
            raise DeviceError("the device is not configured; configure it first")
        self._refuse_latched()
        if self.enabled:
            raise DeviceError("the device is already active; deactivate it first")
        self._call(self._robot.activate)
        self.enabled = True
        self.disarm()
        if not self.capabilities.simulated:
            # Interpreter exit kills a driver's threads: bring the torque to zero before that.
            atexit.register(self.close)
            self._watching.set()
            threading.Thread(target=self._watch, name="experiment watchdog", daemon=True).start()

    def arm(self) -> None:
        """Allow torque for a limited time, once a person has checked that all is well."""
        self._refuse_latched()
        self._refuse_inactive()
        if not self.capabilities.simulated:
            self._armed_until = time.monotonic() + self.limits.arming

    def disarm(self) -> None:
        """Accept no train until armed again; a device in simulated time needs no arming."""
        self._armed_until = math.inf if self.capabilities.simulated else -math.inf

    def begin(self, start: int) -> None:
        """
        Start a run at ``start`` [ns] and drop the train of an earlier run.

        A latched device may also begin: there will be no torque.
        """
        self._refuse_inactive()
        self._call(lambda: self._robot.begin(start))
        self.train, self.delivered, self.promised_until = None, 0, start
        self._past, self._news_at = (), time.monotonic()
        self._read_until, self._unasked_since = -math.inf, math.inf
        self._offset = time.time_ns() - time.monotonic_ns()
        self._delivered_torque = _DeliveredTorque(self.limits)
        self._in_run = True
        self.heard()

    def deactivate(self) -> None:
        """
        Bring the torque to zero, then disable the device; errors become faults.

        Promises may still be requested until the run is over.
        """
        self.train = None
        self._watching.clear()
        if self.enabled:
            self.enabled, self._armed_until = False, -math.inf
            self._quietly(self._robot.deactivate)

    def close(self) -> None:
        """Bring the torque to zero, disable and release, from any state; never raises."""
        self.deactivate()
        self._configured = self._in_run = False
        self._quietly(self._robot.close)
        atexit.unregister(self.close)

    def __enter__(self) -> "GuardedRobot":
        """Return the robot; leaving the context always closes it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the robot."""
        self.close()

    # Torque

    def heard(self) -> None:
        """Record a sign of life from the experiment."""
        self._last_heard = time.monotonic()

    def schedule(self, train: PulseTrain) -> None:
        """
        Accept a train of pulses that follows those accepted before.

        Raises LimitError and changes nothing if the train, alone or with those before it, exceeds
        the limits, is for the other ankle, or begins before ``promised_until``. Raises DeviceError
        if the device is not active, not armed, latched, or cannot accept the train.
        """
        self._refuse_latched()
        self._refuse_inactive()
        self._refuse_before_begin()
        if not self.armed:
            lapsed = math.isfinite(self._armed_until)
            why = f"was armed more than {self.limits.arming:g} s ago" if lapsed else "is not armed"
            raise DeviceError(f"the device {why}; check that all is well, then arm it")
        before = self.train
        self.limits.check(train, (*self._past, *(before.pulses if before else ())))
        both = [(r.train.pulses, r.promised_until) for r in (self, self.partner) if r and r.train]
        coming = [pulse for pulses, until in both for pulse in pulses if pulse.onset >= until]
        self.limits.check_dose(self.dose, [*coming, *train.pulses])
        peak = self.capabilities.peak_torque
        largest = max((pulse.torque for pulse in train.pulses), key=abs)
        if abs(largest) > peak:
            raise LimitError(
                f"torque: {largest:g} N m is more than the device can deliver; "
                f"allowed: -{peak:g} to {peak:g} N m"
            )
        if train.side is not self.side:
            raise LimitError(f"side: {train.side.name.lower()}; the robot sits on the other ankle")
        first = train.onsets[0]
        if first < self.promised_until:
            late = (self.promised_until - first) / NANOSECONDS_PER_SECOND
            raise LimitError(f"onset: lies {late:g} s inside what is already promised")
        if before is None or first - before.end > _PAUSE:
            self._begun = 0
        train = self.limits.softened(train, self._begun)
        self._call(lambda: self._robot.schedule(train), may_refuse=True)
        self._begun += len(train.pulses)
        self.train = before.followed_by(train) if before else train
        self.heard()
        if self.faults:  # another thread has called stop in the meantime
            self.stop()
            self._refuse_latched()

    def cancel(self) -> None:
        """Drop the train: torque is zero from now on."""
        if self.train is not None:
            self._past += self.train.until(self.promised_until)
            self.train = None
            self._call(self._robot.cancel)

    def stop(self, fault: Fault = faults.STOPPED) -> None:
        """
        Bring the torque to zero and keep it there; from any thread and state, never raises.

        A driver that raises here breaks its last guarantee, which is a separate fault.
        """
        new = fault not in self.faults
        self._latch(fault)
        self.train = None
        try:
            self._robot.stop()
        except (Exception, SystemExit):
            self._latch(faults.NOT_STOPPED)
        if new and self.partner is not None:
            self.partner.stop(fault)

    def promise(self, until: int) -> TorqueProfile:
        """
        Return the delivered torque from the last promise up to ``until`` [ns] at most.

        It becomes binding. Delivered torque or impulse beyond the limits latches a fault, but is
        still returned.

        Raises ValueError if ``until`` lies before the last promise, DeviceError if no run is under
        way, or if the driver fails or breaks its contract.
        """
        begin = self.promised_until
        if until < begin:
            raise ValueError(f"a promise up to {until} ns would take back one up to {begin} ns")
        self._refuse_before_begin()
        profile = self._call(
            lambda: self._robot.promise(until), lambda answer: answer.check(begin, until)
        )
        self.delivered += len(profile.onsets)
        self.dose.pulses += len(profile.onsets)
        self.dose.impulse += sum(_impulse(*piece) for piece in profile.pieces)
        self.promised_until = profile.valid_until
        fault = self._delivered_torque.add(profile)
        behind = min(until, time.monotonic_ns() + self._offset) - self.promised_until
        if self.train and behind > nanoseconds(self.limits.silence):
            fault = fault or faults.READINGS_OLD  # never in simulated time: it promises it all
        if fault is not None:
            self.stop(fault)
        return profile

    def read(self) -> Sequence[RobotState]:
        """Return the states since the last call; faults latch, invalid ones raise DeviceError."""
        return self._call(lambda: tuple(self._robot.read()), self._watch_states)

    # Guarding

    def _latch(self, fault: Fault) -> None:
        if fault not in self.faults:
            self.faults = (*self.faults, fault)

    def _refuse_latched(self) -> None:
        if self.faults:
            names = ", ".join(fault.name for fault in self.faults)
            raise DeviceError(f"torque is latched at zero ({names}): clean up and configure first")

    def _refuse_inactive(self) -> None:
        if not self.enabled:
            raise DeviceError("the device is not active; configure and activate it first")

    def _refuse_before_begin(self) -> None:
        if not self._in_run:
            raise DeviceError("no run is under way; begin one first")

    def _call(
        self,
        function: Callable[[], _T],
        check: Callable[[_T], object] = lambda _: None,
        *,
        may_refuse: bool = False,
    ) -> _T:
        """Call the driver and check its result; on any exception, end the torque, then raise."""
        self._called_at = time.monotonic()
        try:
            result = function()
            check(result)
            return result
        except BaseException as error:
            if may_refuse and isinstance(error, LimitError):
                raise  # nothing has changed
            if self.enabled:
                self.stop(faults.DRIVER_FAILED)
            if isinstance(error, DeviceError) or not isinstance(error, Exception):
                raise
            raise DeviceError(f"the driver failed: {type(error).__name__}: {error}") from error
        finally:
            self._called_at = math.inf

    def _watch_states(self, states: Sequence[RobotState]) -> None:
        """Latch faults that states report or show; an invalid state raises an exception."""
        able, until = self.capabilities, self.promised_until
        if not able.simulated:  # a device's clock may be a little ahead
            until = time.monotonic_ns() + self._offset + NANOSECONDS_PER_SECOND // 10
        for state in states:
            measured = state.measured if able.measures_torque and not state.faults else 0.0
            before, self._read_until = self._read_until, state.stamp
            finite = math.isfinite(state.commanded + measured) and not math.isinf(state.angle)
            known = all(isinstance(fault, Fault) for fault in state.faults)
            if not (known and finite and before <= state.stamp <= until):
                raise ValueError(f"{state} after {before} and by {until} ns")
            if state.stamp > max(before, until - nanoseconds(0.1 + self.limits.silence)):
                self._news_at = time.monotonic()
            for fault in state.faults:
                if fault not in self.faults:
                    self.stop(fault)
            unasked = not state.commanded and abs(measured) > self._unasked
            self._unasked_since = min(self._unasked_since, state.stamp) if unasked else math.inf
            # In simulated time an excess is only an emulated sensor error.
            if abs(measured) > self._delivered_torque.most and not able.simulated:
                self.stop(faults.TORQUE_EXCEEDED)
            if state.stamp - self._unasked_since > self._fall_time and not able.simulated:
                self.stop(faults.TORQUE_UNASKED)
        period = 3 / able.state_rate if able.state_rate and not able.simulated else math.inf
        if self.train and time.monotonic() - self._news_at > max(period, self.limits.silence):
            self.stop(faults.READINGS_OLD)

    def _quietly(self, function: Callable[[], None]) -> None:
        """Call the driver during shutdown: an error becomes a fault, and shutdown continues."""
        try:
            function()
        except Exception:
            self.stop(faults.DRIVER_FAILED)

    def _watch(self) -> None:
        """Stop the torque if the experiment or a driver falls silent while torque is possible."""
        while self._watching.is_set():
            now, longest = time.monotonic(), self.limits.silence
            silent = self.train is not None and now - self._last_heard > longest
            if silent or now - self._called_at > longest:  # the driver may already have a train
                blocked = now - min(r._called_at for r in (self, self.partner) if r) > longest / 2
                self.stop(faults.DRIVER_BLOCKED if blocked else faults.EXPERIMENT_SILENT)
                return
            time.sleep(_WATCH_PERIOD)


class _DeliveredTorque:
    """Watches the delivered torque, and its impulse within any window as long as a stride."""

    def __init__(self, limits: DeviceLimits) -> None:
        margin = 1 + limits.overshoot
        self.most = limits.torque * margin  # [N m]
        self._impulse = limits.impulse * margin
        self._window = round(limits.stride * NANOSECONDS_PER_SECOND)
        self._pieces: deque[tuple[int, int, float]] = deque()  # begin, end [ns], magnitude [N m]
        self._sum = 0.0  # impulse of these pieces [N m s]

    def add(self, profile: TorqueProfile) -> Fault | None:
        """Account for a profile; return a fault if it exceeds a limit."""
        found = None
        for begin, end, torque in profile.pieces:
            if torque == 0:
                continue
            if abs(torque) > self.most:
                found = found or faults.TORQUE_EXCEEDED
            self._pieces.append((begin, end, abs(torque)))
            self._sum += _impulse(begin, end, torque)
            while self._pieces[0][1] <= end - self._window:
                self._sum -= _impulse(*self._pieces.popleft())
            first, _, height = self._pieces[0]
            before = _impulse(first, max(first, end - self._window), height)
            if self._sum - before > self._impulse:
                found = found or faults.IMPULSE_EXCEEDED
        return found


def _impulse(begin: int, end: int, torque: float) -> float:
    """Return the magnitude of the angular impulse [N m s] of a constant torque."""
    return abs(torque) * (end - begin) / NANOSECONDS_PER_SECOND
