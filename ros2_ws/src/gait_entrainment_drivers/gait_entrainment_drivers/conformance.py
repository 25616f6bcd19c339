# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The conformance kit, which shows whether a driver keeps every promise of the contract.

Each check is a function that is given a bench, and raises BrokenPromiseError with one sentence
where the robot on it breaks a promise. ``run_checks`` runs them all, each on a robot of its own.
The same kit is behind ``entrain driver check`` and behind the pytest plugin.

A robot in simulated time is checked at once; any other in real time, with real torque: nobody may
wear it.
"""

import itertools
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.robot.contract import AnkleRobot, RobotState
from gait_entrainment.robot.drivers import Driver
from gait_entrainment.robot.faults import DeviceError, LimitError
from gait_entrainment.robot.guard import GuardedRobot
from gait_entrainment.robot.limits import DeviceLimits
from gait_entrainment.robot.measured_onsets import MeasuredOnsets
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment.robot.timing import quantile

_SIDE = Side.RIGHT
# A robot in simulated time is promised in stretches of this length [ns]: not a multiple of any
# tick, so that cuts fall anywhere.
_STRETCH = 17_300_001
# How often a robot in real time is looked after [s].
_POLL = 0.005
# From the request for pulses to the first one [s].
_LEAD = 0.1


class BrokenPromiseError(Exception):
    """A driver does not do what the contract says; the message is one sentence for people."""


@dataclass(frozen=True)
class Tolerances:
    """What the kit puts up with; a lab may be stricter."""

    torque: float = 8.0  # height of the pulses with which is checked [N m], where it can be
    zero: float = 0.05  # of the height: less than this counts as zero torque
    zero_within: float = 0.2  # torque must be gone so long after it was ended [s]
    impulse: float = 0.15  # share by which a pulse's impulse may differ from the commanded one
    onset: float = 0.06  # a pulse may be measured this late [s]
    early: float = 0.002  # or this early [s]
    call: float = 0.01  # nine in ten calls return within this time [s] ...
    slowest_call: float = 0.2  # ... and each within this one [s]
    state_rate: float = 0.7  # share of the promised rate of states


@dataclass(frozen=True)
class Result:
    """The outcome of one check."""

    check: str
    promise: str  # what is promised, in a sentence
    broken: str  # how it is broken, in a sentence; empty where it is kept
    seconds: float  # that the check took
    figures: dict[str, float]

    @property
    def kept(self) -> bool:
        """Whether the promise is kept."""
        return not self.broken


class Bench:
    """One robot under test, behind its safety envelope, with an account of what it did."""

    def __init__(self, driver: Driver, tolerances: Tolerances) -> None:
        self.driver = driver
        self.tolerances = tolerances
        self.limits = DeviceLimits()
        self.robot = self.new_robot()
        self.simulated = self.robot.capabilities.simulated
        self.height = min(
            tolerances.torque, self.limits.torque / 2, self.robot.capabilities.peak_torque / 2
        )
        self.figures: dict[str, float] = {}
        self.calls: list[float] = []  # durations [s]
        self._reset()
        self._simulated_now = 0

    def _reset(self) -> None:
        self.pieces: list[tuple[int, int, float]] = []  # begin, end [ns], torque [N m]
        self.onsets: list[int] = []
        self.states: list[RobotState] = []

    def new_robot(self) -> GuardedRobot:
        """Return another robot of the driver, not configured."""
        return self.driver.make(_SIDE, self.limits, seed=1)

    def new_driver(self) -> AnkleRobot:
        """Return a driver without the safety envelope, for what the envelope would hide."""
        return self.driver.robot(_SIDE, self.driver.options, 1)

    def close(self) -> None:
        """Close the robot, however the check ended."""
        self.robot.close()

    @property
    def now(self) -> int:
        """The run's clock [ns]."""
        return self._simulated_now if self.simulated else time.time_ns()

    def start(self) -> None:
        """Bring the robot to where it takes pulses."""
        self.robot.configure()
        self.robot.activate()
        self.robot.arm()
        self.begin()

    def begin(self) -> None:
        """Begin a run."""
        self._reset()
        self.robot.begin(self.now)

    def train(self, **changes: Any) -> PulseTrain:
        """Return a harmless train that begins soon."""
        values: dict[str, Any] = {
            "side": _SIDE,
            "first_onset": self.now + nanoseconds(_LEAD),
            "period": 0.4,
            "count": 1,
            "torque": self.height,
            "duration": 0.15,
        }
        return PulseTrain(**{**values, **changes})

    def run(self, seconds: float) -> None:
        """Let time go by, and note what the robot delivers."""
        end = self.now + nanoseconds(seconds)
        while self.now < end:
            if self.simulated:
                self._simulated_now = min(self._simulated_now + _STRETCH, end)
            else:
                time.sleep(_POLL)
            self.robot.heard()
            self.look()

    def look(self) -> None:
        """Take one promise and the states with it."""
        before = time.monotonic()
        profile = self.robot.promise(self.now)
        self.calls.append(time.monotonic() - before)
        ends = [*profile.times[1:], profile.valid_until]
        self.pieces += [
            (begin, end, torque)
            for begin, end, torque in zip(profile.times, ends, profile.torques, strict=True)
            if end > begin
        ]
        self.onsets += profile.onsets
        before = time.monotonic()
        self.states += self.robot.read()
        self.calls.append(time.monotonic() - before)

    def run_into_pulse(self) -> None:
        """Schedule the longest pulse and let time go by to where most of it is still to come."""
        duration = self.limits.duration
        self.robot.schedule(self.train(duration=duration, period=3 * duration))
        self.run(_LEAD + 0.3 * duration)
        if self.torque_since(self.now - nanoseconds(0.1)) < self.height / 2:
            raise BrokenPromiseError(
                f"{300 * duration:.0f} ms after its onset a pulse of {self.height:g} N m was not "
                "delivered."
            )

    def torque_since(self, begin: int) -> float:
        """Return the largest magnitude of delivered torque [N m] from an instant [ns] on."""
        return max((abs(torque) for _, end, torque in self.pieces if end > begin), default=0.0)

    def impulse(self, begin: int, end: int) -> float:
        """Return the delivered angular impulse [N m s] between two instants [ns]."""
        return sum(
            torque * max(min(stop, end) - max(start, begin), 0) / NANOSECONDS_PER_SECOND
            for start, stop, torque in self.pieces
        )

    def require_zero(self, since: int, after: str) -> None:
        """Hold what is delivered from an instant [ns] on against zero torque."""
        zero = self.tolerances.zero * self.height
        late = [end for _, end, torque in self.pieces if end > since and abs(torque) > zero]
        if late:
            gone = (max(late) - since) / NANOSECONDS_PER_SECOND
            self.figures["time_to_zero_ms"] = gone * 1e3
            if gone > self.tolerances.zero_within:
                raise BrokenPromiseError(
                    f"There was torque up to {gone * 1e3:.0f} ms after {after}; promised: zero "
                    f"within {self.tolerances.zero_within * 1e3:.0f} ms."
                )


# The checks. The docstring of each is the promise.


def construction(bench: Bench) -> None:
    """Constructing a driver sets its side, options and capabilities."""
    capabilities = bench.robot.capabilities
    if not capabilities.peak_torque > 0:
        raise BrokenPromiseError(f"capabilities.peak_torque is {capabilities.peak_torque:g} N m.")
    if not capabilities.torque_rate > 0:
        raise BrokenPromiseError(
            f"capabilities.torque_rate is {capabilities.torque_rate:g} N m/s."
        )
    if not 0 <= capabilities.state_rate < math.inf:
        raise BrokenPromiseError(f"capabilities.state_rate is {capabilities.state_rate:g} Hz.")
    options = bench.driver.options
    if not is_dataclass(options):
        raise BrokenPromiseError("Options is no dataclass.")
    for option in fields(options):
        if "setting" not in option.metadata:
            raise BrokenPromiseError(
                f"The option {option.name} does not tell its meaning and unit."
            )


def lifecycle(bench: Bench) -> None:
    """Configure, activate, begin, deactivate and close work in this order, twice over."""
    for _ in range(2):
        bench.start()
        bench.run(0.1)
        bench.robot.deactivate()
        if bench.robot.faults:
            raise BrokenPromiseError(f"Deactivating failed: {_names(bench.robot)}.")
        bench.robot.close()
        if bench.robot.faults:
            raise BrokenPromiseError(f"Closing failed: {_names(bench.robot)}.")


def order(bench: Bench) -> None:
    """Nothing is taken before its turn: no train without configure, activate, arm and begin."""
    robot = bench.robot
    steps: list[tuple[str, Callable[[], None]]] = [
        ("configure", robot.configure),
        ("activate", robot.activate),
        ("arm", robot.arm),
        ("begin", bench.begin),
    ]
    for name, step in steps:
        with suppress(DeviceError):
            robot.schedule(bench.train())
            raise BrokenPromiseError(f"A train was accepted before {name}.")
        step()
    bench.run(0.4)
    if bench.torque_since(0) > bench.tolerances.zero * bench.height:
        raise BrokenPromiseError("There was torque without a train that was accepted.")


def idle(bench: Bench) -> None:
    """Without a train there is no torque and no fault."""
    bench.start()
    bench.run(0.5)
    if bench.torque_since(0) > bench.tolerances.zero * bench.height:
        raise BrokenPromiseError(f"There were {bench.torque_since(0):.3g} N m without a train.")
    if bench.robot.faults:
        raise BrokenPromiseError(f"Without a train there was a fault: {_names(bench.robot)}.")


def pulses(bench: Bench) -> None:
    """Every pulse is delivered once, at its onset, with its impulse and sign."""
    for sign in (1, -1):
        bench.start()
        train = bench.train(count=3, torque=sign * bench.height)
        bench.robot.schedule(train)
        bench.run(_LEAD + 3 * train.period + 0.1)
        if bench.robot.faults:
            raise BrokenPromiseError(f"Delivering pulses led to a fault: {_names(bench.robot)}.")
        expected = [train.onset(n) for n in range(3)]
        if bench.onsets != expected:
            raise BrokenPromiseError(
                f"Onsets {bench.onsets} were told for pulses at {expected} ns."
            )
        asked = train.torque * train.duration
        for onset in expected:
            got = bench.impulse(onset - 1, onset + nanoseconds(train.period) - 1)
            if not abs(got - asked) <= bench.tolerances.impulse * abs(asked):
                raise BrokenPromiseError(
                    f"A pulse of {asked:.3g} N m s had {got:.3g} N m s; allowed: "
                    f"{100 * bench.tolerances.impulse:.0f} % off."
                )
        bench.robot.close()


def cuts(bench: Bench) -> None:
    """What is delivered does not depend on how it is asked for."""
    if not bench.simulated:  # the torque of a real device is never the same twice
        return
    told = []
    for pattern in ((1_500_000_000,), (100_000_000, 100_000_000, 250_000_001, 1_500_000_000)):
        robot = bench.new_robot()
        robot.configure()
        robot.activate()
        robot.begin(0)
        robot.schedule(bench.train(first_onset=nanoseconds(_LEAD), count=3))
        pieces: list[tuple[int, float]] = []
        for until in pattern:
            profile = robot.promise(until)
            for begin, torque in zip(profile.times, profile.torques, strict=True):
                if begin < profile.valid_until and (not pieces or pieces[-1][1] != torque):
                    pieces.append((begin, torque))
        told.append(pieces)
        robot.close()
    if told[0] != told[1]:
        raise BrokenPromiseError(
            "The same seed and train gave another torque when asked in pieces."
        )


def at_limits(bench: Bench) -> None:
    """A pulse at the limits is delivered without a fault."""
    bench.start()
    capabilities, limits = bench.robot.capabilities, bench.limits
    top = min(limits.torque, capabilities.peak_torque)
    if not bench.simulated:  # full torque is for a device on its own: not without being asked
        top = min(top, bench.height)
    duration = min(limits.duration, limits.impulse / top)
    bench.robot.schedule(bench.train(torque=top, duration=duration, period=2 * duration))
    bench.run(_LEAD + duration + 0.2)
    if bench.robot.faults:
        raise BrokenPromiseError(f"{top:g} N m for {duration:g} s led to {_names(bench.robot)}.")
    reached = bench.torque_since(0)
    if not 0.9 * top <= reached <= (1 + limits.overshoot) * top:
        raise BrokenPromiseError(f"A pulse of {top:g} N m reached {reached:.3g} N m.")


def beyond_limits(bench: Bench) -> None:
    """A train beyond a limit, late, overlapping, or with NaN is refused and changes nothing."""
    bench.start()
    bench.run(0.1)
    top = min(bench.limits.torque, bench.robot.capabilities.peak_torque)
    for changes in (
        {"torque": math.nextafter(top, math.inf)},
        {"torque": -1.01 * top},
        {"torque": math.nan},
        {"torque": math.inf},
        {"duration": 0.0},
        {"duration": math.nan},
        {"duration": bench.limits.duration * 1.01, "period": 5.0},
        {"period": math.nan, "count": 2},
        {"period": 0.15, "count": 2},
        {"count": 0},
        {"side": _SIDE.other},
        {"first_onset": bench.robot.promised_until - 1},
    ):
        train = bench.train(**changes)
        with suppress(LimitError):
            bench.robot.schedule(train)
            raise BrokenPromiseError(f"A train with {changes} was accepted.")
    bench.run(0.4)
    if bench.robot.faults:
        raise BrokenPromiseError(f"Refusing a train led to a fault: {_names(bench.robot)}.")
    if bench.torque_since(0) > bench.tolerances.zero * bench.height:
        raise BrokenPromiseError("There was torque although every train was refused.")


def one_at_a_time(bench: Bench) -> None:
    """A second train is refused while one is under way, and does not disturb it."""
    bench.start()
    train = bench.train(count=2)
    bench.robot.schedule(train)
    bench.run(_LEAD + 0.05)
    with suppress(LimitError):
        bench.robot.schedule(bench.train())
        raise BrokenPromiseError("A second train was accepted while one was under way.")
    bench.run(2 * train.period)
    if len(bench.onsets) != 2:
        raise BrokenPromiseError(
            f"{len(bench.onsets)} of 2 pulses came after a second was refused."
        )


def cancelling(bench: Bench) -> None:
    """After cancelling in mid-pulse the torque is zero, and another train is delivered."""
    bench.start()
    bench.run_into_pulse()
    since = bench.now
    bench.robot.cancel()
    bench.run(0.5)
    bench.require_zero(since, "cancelling")
    bench.robot.schedule(bench.train())
    bench.run(0.5)
    if bench.torque_since(bench.now - nanoseconds(0.45)) < bench.height / 2:
        raise BrokenPromiseError(
            "No torque came from a train that was scheduled after cancelling."
        )


def stopping_in_mid_pulse(bench: Bench) -> None:
    """After a stop in mid-pulse, from another thread, the torque is zero and stays there."""
    bench.start()
    bench.run_into_pulse()
    since = bench.now
    thread = threading.Thread(target=bench.robot.stop)
    thread.start()
    thread.join(1.0)
    if thread.is_alive():
        raise BrokenPromiseError("A stop from another thread did not return within a second.")
    bench.run(0.5)
    bench.require_zero(since, "the stop")
    with suppress(DeviceError):
        bench.robot.schedule(bench.train())
        raise BrokenPromiseError("A train was accepted after the stop.")


def stopping_in_every_state(bench: Bench) -> None:
    """Stop and close raise in no state; after a stop the driver itself delivers no torque."""
    states: list[tuple[str, Callable[[AnkleRobot], None]]] = [
        ("construction", lambda _: None),
        ("configure", lambda driver: driver.configure()),
        ("activate", lambda driver: driver.activate()),
        ("begin", lambda driver: driver.begin(bench.now)),
        ("schedule", lambda driver: driver.schedule(bench.train())),
        ("deactivate", lambda driver: driver.deactivate()),
    ]
    for last, (name, _) in enumerate(states):
        driver = bench.new_driver()
        try:
            for _, step in states[: last + 1]:
                step(driver)
            for call in (driver.stop, driver.stop):
                _must_not_raise(call, f"stop after {name}")
            if 3 <= last <= 4:
                _stays_at_zero(bench, driver, name)
        finally:
            for call in (driver.close, driver.close, driver.stop):
                _must_not_raise(call, f"{call.__name__} after {name} and stop")


def reconnecting(bench: Bench) -> None:
    """Closed in mid-pulse and configured again, it is at zero torque and delivers anew."""
    bench.start()
    bench.run_into_pulse()
    bench.robot.close()
    bench.start()
    since = bench.now
    bench.run(0.4)
    bench.require_zero(since, "reconnecting")
    bench.robot.schedule(bench.train())
    bench.run(0.5)
    if bench.torque_since(0) < bench.height / 2:
        raise BrokenPromiseError(
            "No torque came from a train that was scheduled after reconnecting."
        )


def new_run(bench: Bench) -> None:
    """A new run forgets the train of the one before, and profiles adjoin from its start on."""
    bench.start()
    bench.robot.schedule(bench.train(first_onset=bench.now + nanoseconds(0.3)))
    bench.run(0.1)
    bench.begin()
    bench.run(0.6)
    if bench.torque_since(0) > bench.tolerances.zero * bench.height:
        raise BrokenPromiseError("A pulse of the run before came in the new one.")


def stale_commands(bench: Bench) -> None:
    """Where the experiment falls silent in mid-pulse, the torque goes to zero and latches."""
    if bench.simulated:  # nobody to push; the run stands still with its experiment
        return
    bench.limits = DeviceLimits(silence=0.1)
    bench.robot = bench.new_robot()
    bench.start()
    bench.run_into_pulse()
    since = bench.now
    while not bench.robot.faults and bench.now - since < NANOSECONDS_PER_SECOND:
        time.sleep(_POLL)
        bench.look()
    for _ in range(60):
        time.sleep(_POLL)
        bench.look()
    if "experiment_silent" not in _names(bench.robot):
        raise BrokenPromiseError("The experiment's silence was not noticed.")
    bench.require_zero(since + nanoseconds(0.1), "the limit of the experiment's silence")


def states(bench: Bench) -> None:
    """States come at the promised rate, ascending, with finite torques, and without faults."""
    bench.start()
    bench.robot.schedule(bench.train(count=2))
    bench.run(1.2)
    stamps = [state.stamp for state in bench.states]
    if any(a >= b for a, b in itertools.pairwise(stamps)):
        raise BrokenPromiseError("The stamps of the states are not ascending.")
    capabilities = bench.robot.capabilities
    for state in bench.states:
        if not math.isfinite(state.commanded):
            raise BrokenPromiseError(f"A state has a commanded torque of {state.commanded} N m.")
        if capabilities.measures_torque and not math.isfinite(state.measured):
            raise BrokenPromiseError(f"A state has a measured torque of {state.measured} N m.")
        if state.faults:
            raise BrokenPromiseError(f"A state reports {state.faults[0].name} while all is well.")
    if not any(state.commanded for state in bench.states):
        raise BrokenPromiseError("No state shows that the device was asked for the pulses.")
    if capabilities.state_rate:
        rate = len(stamps) / 1.2
        bench.figures["state_rate_hz"] = rate
        if rate < bench.tolerances.state_rate * capabilities.state_rate:
            raise BrokenPromiseError(
                f"States came at {rate:.0f} Hz; promised: {capabilities.state_rate:.0f} Hz."
            )


def timing(bench: Bench) -> None:
    """Pulses are measured when they were commanded, up to the device's lag."""
    bench.start()
    count = 20 if bench.simulated else 8
    train = bench.train(count=count, duration=0.12, period=0.3)
    bench.robot.schedule(train)
    bench.run(_LEAD + count * train.period + 0.3)
    onsets = MeasuredOnsets()
    onsets.add_promise([train.onset(number) for number in range(count)], train.onset(count))
    for number in range(count):
        onsets.add_pulse(train.onset(number), train.torque, train.duration)
    for state in bench.states:
        onsets.add_state(state)
    onsets.finish()
    measured = [t.measured - t.commanded for t in onsets.timings if t.measured is not None]
    if len(measured) < count:
        raise BrokenPromiseError(f"{count - len(measured)} of {count} pulses show in no state.")
    late = sorted(onset / NANOSECONDS_PER_SECOND for onset in measured)
    for name, share in (("median", 0.5), ("p99", 0.99), ("worst", 1.0)):
        bench.figures[f"{name}_ms"] = quantile(late, share) * 1e3
    if late[-1] > bench.tolerances.onset or late[0] < -bench.tolerances.early:
        raise BrokenPromiseError(
            f"Pulses were measured {late[0] * 1e3:+.1f} to {late[-1] * 1e3:+.1f} ms from their "
            f"commanded onsets; allowed: {-bench.tolerances.early * 1e3:+.1f} to "
            f"{bench.tolerances.onset * 1e3:+.1f} ms."
        )


def prompt_calls(bench: Bench) -> None:
    """Promise and read return at once, so that nobody waits for the device."""
    bench.start()
    bench.robot.schedule(bench.train(count=2))
    bench.run(1.0)
    calls = sorted(bench.calls)
    usual, slowest = quantile(calls, 0.9), calls[-1]
    bench.figures |= {"p90_ms": usual * 1e3, "worst_ms": slowest * 1e3}
    if usual > bench.tolerances.call or slowest > bench.tolerances.slowest_call:
        raise BrokenPromiseError(
            f"Nine in ten calls took up to {usual * 1e3:.1f} ms and the slowest "
            f"{slowest * 1e3:.0f} ms; promised: {bench.tolerances.call * 1e3:.0f} and "
            f"{bench.tolerances.slowest_call * 1e3:.0f} ms."
        )


CHECKS: tuple[Callable[[Bench], None], ...] = (
    construction,
    lifecycle,
    order,
    idle,
    pulses,
    cuts,
    at_limits,
    beyond_limits,
    one_at_a_time,
    cancelling,
    stopping_in_mid_pulse,
    stopping_in_every_state,
    reconnecting,
    new_run,
    stale_commands,
    states,
    timing,
    prompt_calls,
)


def run_check(
    check: Callable[[Bench], None], driver: Driver, tolerances: Tolerances | None = None
) -> Result:
    """Run one check on a robot of its own; whatever it raises becomes a broken promise."""
    begun = time.monotonic()
    broken, figures = "", {}
    try:
        bench = Bench(driver, tolerances or Tolerances())
        figures = bench.figures
        with closing(bench):
            check(bench)
    except BrokenPromiseError as error:
        broken = str(error)
    except Exception as error:
        broken = f"{type(error).__name__}: {error}"
    promise = (check.__doc__ or "").strip()
    return Result(check.__name__, promise, broken, time.monotonic() - begun, figures)


def run_checks(driver: Driver, tolerances: Tolerances | None = None) -> Iterator[Result]:
    """Run every check; yields each result as it is there."""
    for check in CHECKS:
        yield run_check(check, driver, tolerances)


def _names(robot: GuardedRobot) -> str:
    return ", ".join(fault.name for fault in robot.faults)


def _must_not_raise(call: Callable[[], None], what: str) -> None:
    try:
        call()
    except Exception as error:
        raise BrokenPromiseError(
            f"Calling {what} raised {type(error).__name__}: {error}."
        ) from None


def _stays_at_zero(bench: Bench, driver: AnkleRobot, state: str) -> None:
    """See that a driver that was stopped delivers nothing, not even what it is asked for."""
    with suppress(DeviceError, LimitError):
        driver.schedule(bench.train())
    end = bench.now + nanoseconds(_LEAD + 0.1)
    while not bench.simulated and bench.now < end:
        time.sleep(_POLL)
    with suppress(DeviceError):
        profile = driver.promise(end)
        if any(abs(t) > bench.tolerances.zero * bench.height for t in profile.torques):
            raise BrokenPromiseError(f"Stopped after {state}, the driver delivered a train.")
