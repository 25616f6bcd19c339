# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The bench on which an ankle robot is checked: what a check can do and observe."""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    Driver,
    GuardedRobot,
    LimitError,
    PulseTrain,
    RobotState,
)

# Polling period of a robot in real time [s].
POLL = 0.005
# Reports that are pending after this process was held up arrive within this time [s].
_HELD_UP = 0.2
# Pulse period of a harmless train [s].
PERIOD = 0.4
# Start of a simulated run's clock [ns].
START = 1000 * NANOSECONDS_PER_SECOND


class BrokenPromiseError(EntrainmentError):
    """The robot breaks the contract; the message is one sentence for people."""


def require(kept: object, sentence: str) -> None:
    """Raise BrokenPromiseError with a sentence unless a condition holds."""
    if not kept:
        raise BrokenPromiseError(sentence)


@dataclass(frozen=True)
class Tolerances:
    """What the kit tolerates; a lab may be stricter."""

    torque: float = 8.0  # pulse height [N m], or less if the robot allows no more
    zero: float = 0.05  # share of the height below which torque counts as zero
    zero_within: float = 0.2  # torque must be zero this long after it was ended [s]
    impulse: float = 0.15  # largest error of a pulse's impulse, as a share of the command
    onset: float = 0.06  # a pulse may be measured this late [s]
    early: float = 0.002  # or this early [s]
    watchdog: float = 0.2  # torque must be zero after the host was silent for this long [s]
    call: float = 0.01  # nine in ten calls return within this time [s] ...
    slowest_call: float = 0.2  # ... and every call within this time [s]
    state_rate: float = 0.7  # least share of the promised rate of states


@dataclass(frozen=True)
class Result:
    """The outcome of one check."""

    check: str
    promise: str  # one sentence
    broken: str  # how the promise is broken, one sentence; empty if it is kept
    seconds: float  # duration of the check
    figures: dict[str, float]

    @property
    def kept(self) -> bool:
        """Whether the promise is kept."""
        return not self.broken


class Bench(ABC):
    """
    One robot under test, with a record of what it delivered in the current run.

    A robot in simulated time is checked as fast as it answers. Any other robot is checked in real
    time and with real torque: nobody may wear it.
    """

    lead = 0.1  # from the request for pulses to the first onset [s]
    long_pulse = 0.3  # width of a pulse that is ended early [s]
    stretch = 200_000_000  # how far a simulated robot promises at a time [ns]
    # A train beyond these must be refused [N m, s].
    largest_torque = 1e4
    longest_pulse = 100.0

    def __init__(self, side: Side, tolerances: Tolerances) -> None:
        self.side = side
        self.tolerances = tolerances
        self.robot: Any  # a GuardedRobot, or an object with its methods
        self.figures: dict[str, float] = {}  # measured by the current check
        self.promise_times: list[float] = []  # duration of each promise [s]
        self.read_times: list[float] = []  # and of each read of the states [s]

    @abstractmethod
    def make(self, *, guarded: bool) -> Any:
        """Return an unconfigured robot, in its safety envelope or, if possible, without it."""

    def renew(self, *, guarded: bool = True) -> None:
        """Put a new robot on the bench."""
        self.robot = self.make(guarded=guarded)
        self.simulated = self.robot.capabilities.simulated
        self.height = min(self.tolerances.torque, self.largest_torque / 2)  # of the pulses [N m]
        self._simulated_now = START

    @property
    def now(self) -> int:
        """The run's clock [ns]."""
        return self._simulated_now if self.simulated else time.time_ns()

    # The run

    def steps(self) -> list[tuple[str, Callable[[], object]]]:
        """Return the steps, with names, that bring an unconfigured robot into a run."""
        names = [n for n in ("configure", "activate", "arm") if hasattr(self.robot, n)]
        return [*((name, getattr(self.robot, name)) for name in names), ("begin", self.begin)]

    def start(self) -> None:
        """Bring an unconfigured robot into a run."""
        for _, step in self.steps():
            step()

    def begin(self) -> None:
        """Begin a run with an empty record."""
        self.pieces: list[tuple[int, int, float]] = []  # begin, end [ns], delivered torque [N m]
        self.onsets: list[int] = []  # of the pulses that have started [ns]
        self.states: list[RobotState] = []
        self.begun = self.promised_until = self.now  # [ns]
        self.robot.begin(self.begun)
        self.advance(self.now + self.stretch)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end = self.now + nanoseconds(seconds)
        while self.now < end:
            self.advance(min(self.now + self.stretch, end))

    def advance(self, until: int) -> None:
        """Let time pass up to a simulated time [ns], or for one polling period of real time."""
        if self.simulated:
            self._simulated_now = until
        else:
            time.sleep(POLL)
        if hasattr(self.robot, "heard"):
            self.robot.heard()
        self.look()

    def look(self) -> None:
        """Record one promise and the states that come with it."""
        begun = time.monotonic()
        profile = self.robot.promise(self.now)
        promised = time.monotonic()
        self.states += self.robot.read()
        self.promise_times.append(promised - begun)
        self.read_times.append(time.monotonic() - promised)
        self.pieces += [piece for piece in profile.pieces if piece[0] < piece[1]]
        self.onsets += profile.onsets
        self.promised_until = profile.valid_until

    def wait_for(self, condition: Callable[[], object]) -> bool:
        """Return whether a condition holds, now or once the robot has reported everything."""
        return bool(condition())

    def stop(self) -> None:
        """Stop the robot from another thread; any exception of the stop is raised here."""
        thread = ThreadPoolExecutor(1)
        stopping = thread.submit(self.robot.stop)
        thread.shutdown(wait=False)
        returned = wait([stopping], 1.0).done
        require(returned, "A stop from another thread did not return within a second.")
        stopping.result()

    # Trains

    def train(self, **changes: Any) -> PulseTrain:
        """Return a harmless train that begins soon, with changes."""
        values: dict[str, Any] = {
            "side": self.side,
            "first_onset": self.now + nanoseconds(self.lead),
            "period": PERIOD,
            "count": 1,
            "torque": self.height,
            "duration": 0.15,
        }
        return PulseTrain.periodic(**{**values, **changes})

    def request(self, train: PulseTrain) -> str:
        """Request a train; return why it is refused, or an empty text."""
        try:
            self.robot.schedule(train)
        except (DeviceError, LimitError) as error:
            return str(error)
        return ""

    def schedule(self, **changes: Any) -> PulseTrain:
        """Request a harmless train, which must be accepted, and return it."""
        train = self.train(**changes)
        self.require_accepted(train)
        return train

    def require_accepted(self, train: PulseTrain) -> None:
        """Require that a train is accepted."""
        refusal = self.request(train)
        require(not refusal, f"A harmless train was refused: {refusal}.")

    def require_refused(self, train: PulseTrain, what: str) -> None:
        """Require that a train is refused."""
        require(self.request(train), f"A train {what} was accepted.")

    def run_into_pulse(self) -> int:
        """Run into a pulse, most of which is still ahead; return the end of what is promised."""
        train = self.schedule(duration=self.long_pulse, period=3 * self.long_pulse, count=20)
        onset = train.pulses[0].onset
        self.run(self.lead + 0.3 * self.long_pulse)
        give_up = self.now + nanoseconds(self.tolerances.onset)
        while not (pushed := self.largest_since(onset) > self.height / 2) and self.now < give_up:
            self.advance(self.now + self.stretch)
        require(
            pushed,
            f"A pulse of {self.height:g} N m was not delivered {300 * self.long_pulse:.0f} ms "
            "after its onset.",
        )
        return self.promised_until

    # What was delivered

    def largest_since(self, begin: int) -> float:
        """Return the largest magnitude of delivered torque [N m] from a time [ns] on."""
        return max((abs(torque) for _, end, torque in self.pieces if end > begin), default=0.0)

    def impulse(self, begin: int, end: int) -> float:
        """Return the delivered angular impulse [N m s] between two times [ns]."""
        return sum(
            torque * max(min(stop, end) - max(start, begin), 0) / NANOSECONDS_PER_SECOND
            for start, stop, torque in self.pieces
        )

    def require_delivered(self, train: PulseTrain) -> None:
        """Require that every pulse of a train is reported once, at its onset."""
        got, expected = self.onsets, list(train.onsets)
        require(got == expected, f"Onsets {got} were reported for pulses at {expected} ns.")

    def require_impulses(self, train: PulseTrain) -> None:
        """Require that every pulse had the requested impulse; onsets must be PERIOD apart."""
        share = self.tolerances.impulse
        for pulse in train.pulses:
            requested = math.copysign(pulse.impulse, pulse.torque)
            got = self.impulse(pulse.onset - 1, pulse.onset + nanoseconds(PERIOD) - 1)
            require(
                abs(got - requested) <= share * abs(requested),
                f"A pulse of {requested:.3g} N m s had {got:.3g} N m s; allowed error: "
                f"{100 * share:.0f} %.",
            )

    def require_torque(self, after: str) -> None:
        """Require that a harmless train is delivered now."""
        self.schedule()
        begin = self.now
        self.run(self.lead + 0.4)
        require(
            self.largest_since(begin) > self.height / 2,
            f"No torque came from a train scheduled after {after}.",
        )

    def require_no_torque(self, reason: str) -> None:
        """Require that nothing was delivered in this run."""
        largest = self.largest_since(0)
        zero = self.tolerances.zero * self.height
        require(largest <= zero, f"The robot delivered {largest:.3g} N m {reason}.")

    def require_zero(self, since: int, after: str) -> None:
        """Require that torque is zero from a little after a time [ns] on."""
        zero = self.tolerances.zero * self.height
        late = [end for _, end, torque in self.pieces if end > since and abs(torque) > zero]
        gone = (max(late, default=since) - since) / NANOSECONDS_PER_SECOND
        if late:
            self.figures["time_to_zero_ms"] = gone * 1e3
        within = self.tolerances.zero_within
        require(
            gone <= within,
            f"Torque lasted until {gone * 1e3:.0f} ms after {after}; promised: zero within "
            f"{within * 1e3:.0f} ms.",
        )

    def require_no_faults(self, event: str) -> None:
        """Require that no fault was reported."""
        faults = [(fault.name, fault.meaning.rstrip(".")) for fault in self.robot.faults]
        found = "; ".join(": ".join(filter(None, texts)) for texts in faults)
        require(not found, f"{event}: {found}.")


class DriverBench(Bench):
    """A driver's robot in this process."""

    long_pulse = 0.5
    stretch = 17_300_001  # not a multiple of any tick: promises end between ticks too

    def __init__(self, driver: Driver, tolerances: Tolerances | None = None) -> None:
        super().__init__(Side.RIGHT, tolerances or Tolerances())
        self.driver = driver
        self.limits = DeviceLimits()  # of the next robot

    def run(self, seconds: float) -> None:
        """Let time pass, and collect what the robot reported while this process was held up."""
        super().run(seconds)
        due = self.now - nanoseconds(self.tolerances.onset)
        give_up = self.now + nanoseconds(_HELD_UP)
        while not self.simulated and self.promised_until < due and self.now < give_up:
            self.advance(self.now + self.stretch)

    def make(self, *, guarded: bool) -> Any:
        """Return a robot, always with the same seed, so that it behaves the same."""
        robot = self.driver.robot(self.side, self.driver.options, 1)
        self.largest_torque = min(self.limits.torque, robot.capabilities.peak_torque)
        self.longest_pulse = self.limits.duration
        return GuardedRobot(robot, self.side, self.limits) if guarded else robot


def run_check(check: Callable[[Any], None], bench: Bench) -> Result:
    """Run one check on a new robot; any exception becomes a broken promise."""
    begun, broken = time.monotonic(), ""
    bench.figures, bench.promise_times, bench.read_times = {}, [], []
    try:
        bench.renew()
        check(bench)
    except EntrainmentError as error:
        broken = str(error)
    except Exception as error:
        broken = f"{type(error).__name__}: {error}"
    finally:
        with suppress(Exception):
            bench.robot.close()
    promise = (check.__doc__ or "").strip()
    return Result(check.__name__, promise, broken, time.monotonic() - begun, bench.figures)
