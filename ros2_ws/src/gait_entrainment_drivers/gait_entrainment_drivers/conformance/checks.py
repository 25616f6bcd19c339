# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The promises of an ankle robot: each check is a function whose docstring is the promise.

A check receives a bench with an unconfigured robot. It returns if the promise is kept, and raises
BrokenPromiseError, with one sentence, if it is broken.
"""

import itertools
import math
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import fields, is_dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.robot import DeviceError, DeviceLimits, Pulse, PulseTrain, Shape
from gait_entrainment.robot.faults import EXPERIMENT_SILENT
from gait_entrainment_commands.timing import lateness_ms, quantile, timings_of
from gait_entrainment_drivers.conformance.bench import (
    PERIOD,
    POLL,
    Bench,
    BrokenPromiseError,
    DriverBench,
    require,
)

Check = Callable[[Any], None]


def construction(bench: DriverBench) -> None:
    """Constructing a driver sets its side, options and capabilities."""
    options = bench.driver.options
    require(is_dataclass(options), "Options is not a dataclass.")
    for option in fields(options):
        explained = "setting" in option.metadata
        require(explained, f"The option {option.name} does not state its meaning and unit.")


def lifecycle(bench: Bench) -> None:
    """Configure, activate, begin, deactivate and close work in this order, twice in a row."""
    for _ in range(2):
        bench.start()
        bench.run(0.1)
        bench.robot.deactivate()
        bench.require_no_faults("Deactivating failed")
        bench.robot.close()
        bench.require_no_faults("Closing failed")


def order(bench: Bench) -> None:
    """No train is accepted before configure, activate, arm and begin."""
    for name, step in bench.steps():
        bench.require_refused(bench.train(), f"before {name}")
        if name in ("configure", "activate"):
            _require_device_error(
                lambda: bench.robot.promise(bench.now + bench.stretch),
                f"Torque was promised before {name}.",
            )
        step()
    bench.run(0.4)
    bench.require_no_torque("without a train that was accepted")


def idle(bench: Bench) -> None:
    """Without a train there is no torque and no fault."""
    bench.start()
    bench.run(1.0)
    bench.require_no_torque("without a train")
    bench.require_no_faults("Without a train there was a fault")
    bench.figures |= _distribution("answer_", [1e3 * s for s in bench.promise_times])


def pulses(bench: Bench) -> None:
    """Every pulse is delivered once, at its onset, with its impulse and sign."""
    for sign in (1, -1):
        bench.start()
        train = bench.schedule(count=3, torque=sign * bench.height)
        bench.run(bench.lead + 3 * PERIOD + 0.1)
        bench.require_no_faults("Delivering pulses led to a fault")
        bench.require_delivered(train)
        bench.require_impulses(train)
        bench.robot.close()


def shapes(bench: Bench) -> None:
    """Non-square pulses have the impulse of their shape."""
    bench.start()
    onset, step = bench.now + nanoseconds(bench.lead), nanoseconds(PERIOD)
    pulses = (
        Pulse(onset, bench.height, 0.2, Shape.HALF_SINE),
        Pulse(onset + step, -bench.height, 0.2, Shape.TRAPEZOID, rise=0.08, fall=0.04),
        Pulse(onset + 2 * step, bench.height, 0.2, Shape.SAMPLES, samples=(0.0, 1.0, 0.5, 0.0)),
    )
    train = PulseTrain(bench.side, pulses)
    bench.require_accepted(train)
    bench.run(bench.lead + 3 * PERIOD + 0.1)
    bench.require_delivered(train)
    bench.require_impulses(train)


def cuts(bench: Bench) -> None:
    """The delivered torque does not depend on how it is divided into promises."""
    if not bench.simulated:  # the torque of a real device is never the same twice
        return
    delivered = []
    for instants in ((1_500_000_000,), (100_000_000, 100_000_000, 250_000_001, 1_500_000_000)):
        bench.renew()
        bench.start()
        begin = bench.now
        bench.schedule(count=3)
        for instant in instants:
            bench.advance(begin + instant)
        pieces = [(start - begin, torque) for start, _, torque in bench.pieces]
        changes = itertools.pairwise([(0, 0.0), *pieces])
        delivered.append([new for old, new in changes if new[1] != old[1]])
        bench.robot.close()
    require(
        delivered[0] == delivered[1],
        "The same seed and train gave another torque when promised in pieces.",
    )


def at_limits(bench: DriverBench) -> None:
    """A pulse at the limits is delivered without a fault."""
    bench.start()
    # Only a simulated device gets full torque: a real one gets what its user chose.
    top = bench.largest_torque if bench.simulated else bench.height
    duration = min(bench.longest_pulse, bench.limits.impulse / top)
    bench.schedule(torque=top, duration=duration, period=2 * duration)
    bench.run(bench.lead + duration + 0.2)
    bench.require_no_faults(f"{top:g} N m for {duration:g} s led to a fault")
    reached = bench.largest_since(0)
    within = 0.9 * top <= reached <= (1 + bench.limits.overshoot) * top
    require(within, f"A pulse of {top:g} N m reached {reached:.3g} N m.")


def beyond_limits(bench: Bench) -> None:
    """A train beyond a limit, late, overlapping or not finite is refused and changes nothing."""
    bench.start()
    bench.run(0.1)
    for changes in (
        {"torque": math.nextafter(bench.largest_torque, math.inf)},
        {"torque": -1.01 * bench.largest_torque},
        {"torque": math.nan},
        {"torque": math.inf},
        {"duration": 0.0},
        {"duration": math.nan},
        {"duration": 1.01 * bench.longest_pulse, "period": 10 * bench.longest_pulse},
        {"period": 0.15, "count": 2},
        {"count": 0},
        {"side": bench.side.other},
        {"first_onset": bench.promised_until - 1},
    ):
        bench.require_refused(bench.train(**changes), f"with {changes}")
    bench.run(bench.lead + 0.3)
    bench.require_no_faults("Refusing a train led to a fault")
    bench.require_no_torque("although every train was refused")


def in_turn(bench: Bench) -> None:
    """A second train is refused if it overlaps the one under way; otherwise it follows."""
    bench.start()
    train = bench.schedule(count=2)
    bench.run(bench.lead + 0.05)
    bench.require_refused(bench.train(), "that overlaps the one under way")
    later = bench.schedule(first_onset=train.end + nanoseconds(PERIOD))
    bench.run(4 * PERIOD)
    expected = [*train.onsets, *later.onsets]
    require(
        bench.onsets == expected, f"Pulses at {expected} ns were scheduled, not {bench.onsets}."
    )


def cancelling(bench: Bench) -> None:
    """After cancelling in mid-pulse the torque is zero, and another train is delivered."""
    bench.start()
    since = bench.run_into_pulse()
    bench.robot.cancel()
    bench.run(0.5)
    bench.require_zero(since, "cancelling")
    bench.require_torque("cancelling")


def stopping_in_mid_pulse(bench: Bench) -> None:
    """After a stop in mid-pulse, torque stays zero until the robot is closed and configured."""
    bench.start()
    since = bench.run_into_pulse()
    bench.stop()
    bench.run(0.5)
    bench.require_zero(since, "the stop")
    bench.require_refused(bench.train(), "after the stop")
    bench.robot.deactivate()
    _require_device_error(
        bench.robot.activate, "Activating was possible while the stop was latched."
    )
    bench.robot.close()
    bench.start()
    bench.schedule()


def stopping_in_every_state(bench: Bench) -> None:
    """Stop and close never raise in any state; after a stop the bare driver delivers no torque."""
    for last in itertools.count():
        bench.renew(guarded=False)
        steps: list[tuple[str, Callable[[], object]]] = [
            ("construction", lambda: None),
            *bench.steps(),
            ("schedule", bench.schedule),
            ("deactivate", bench.robot.deactivate),
        ]
        if last == len(steps):
            return
        state = steps[last][0]
        try:
            for _, step in steps[: last + 1]:
                step()
            for _ in range(2):
                _require_no_error(bench.stop, f"stop after {state}")
            if state in ("begin", "schedule"):
                bench.request(bench.train())
                with suppress(DeviceError):
                    bench.run(bench.lead + 0.1)
                bench.require_no_torque(f"after {state} and stop: the driver delivered a train")
        finally:
            for call in (bench.robot.close, bench.robot.close, bench.stop):
                _require_no_error(call, f"{call.__name__} after {state} and stop")


def deactivating(bench: Bench) -> None:
    """After deactivating in mid-pulse the torque is zero, and trains are refused."""
    bench.start()
    since = bench.run_into_pulse()
    bench.robot.deactivate()
    bench.require_refused(bench.train(), "after deactivating")
    with suppress(DeviceError):  # no further promise is required
        bench.run(0.5)
    bench.require_zero(since, "deactivating")


def reconnecting(bench: Bench) -> None:
    """A robot closed in mid-pulse and configured again starts at zero and delivers again."""
    bench.start()
    bench.run_into_pulse()
    bench.robot.close()
    bench.start()
    bench.run(0.4)
    bench.require_zero(bench.begun, "reconnecting")
    bench.require_torque("reconnecting")


def new_run(bench: Bench) -> None:
    """A new run drops the train of the run before, and its profiles adjoin from its start."""
    bench.start()
    bench.schedule(first_onset=bench.now + nanoseconds(bench.lead + 0.2))
    bench.run(0.1)
    bench.begin()
    bench.run(bench.lead + 0.5)
    bench.require_no_torque("from the train of the run before")


def stale_commands(bench: DriverBench) -> None:
    """If the experiment falls silent in mid-pulse, the torque goes to zero and latches."""
    if bench.simulated:  # no device; the run stops when its experiment does
        return
    bench.limits = DeviceLimits(silence=0.1)
    bench.renew()
    bench.limits = DeviceLimits()
    bench.start()
    since = bench.run_into_pulse()
    while not bench.robot.faults and bench.now - since < NANOSECONDS_PER_SECOND:
        time.sleep(POLL)
        bench.look()
    for _ in range(60):
        time.sleep(POLL)
        bench.look()
    silent = EXPERIMENT_SILENT in bench.robot.faults
    require(silent, "The experiment's silence was not noticed.")
    bench.require_zero(since + nanoseconds(0.1), "the limit on the experiment's silence")


def silent_host(bench: DriverBench) -> None:
    """If its host falls silent in mid-pulse, the device brings the torque to zero by itself."""
    if bench.simulated:  # no host: its torque ends where its promises do
        return
    measures = bench.robot.capabilities.measures_torque
    require(measures, "not provable: the device does not measure its torque.")
    silence = torque = 0.0
    for share in (0.125, 0.25, 0.5, 1.0):
        silence, torque = _after_silence(bench, share * bench.tolerances.watchdog)
        if abs(torque) <= bench.tolerances.zero * bench.height:
            bench.figures["zero_within_ms"] = 1e3 * silence
            return
    raise BrokenPromiseError(
        f"holds its last command when the host is silent: {torque:.3g} N m were measured after "
        f"{1e3 * silence:.0f} ms of silence; switch on the device's own watchdog."
    )


def _after_silence(bench: DriverBench, seconds: float) -> tuple[float, float]:
    """Silence the host in mid-pulse; return for how long [s], and the torque afterwards [N m]."""
    bench.renew(guarded=False)  # the guard would end the torque
    bench.start()
    bench.run_into_pulse()
    with ExitStack() as frozen:
        try:
            frozen.enter_context(bench.robot.frozen())
        except DeviceError as error:
            raise BrokenPromiseError(f"not provable: {error}.") from None
        time.sleep(seconds)
        bench.robot.stop()
        thawed = time.time_ns()
    give_up = time.monotonic() + 1.0
    while time.monotonic() < give_up:
        bench.advance(bench.now)
        before = [state for state in bench.states if state.stamp <= thawed]
        after = [s for s in bench.states[len(before) :] if math.isfinite(s.measured)]
        if after:
            bench.robot.close()
            pushed = abs(before[-1].measured) > bench.height / 2
            require(pushed, "not provable: the pulse was over before the host fell silent.")
            silence = (after[0].stamp - before[-1].stamp) / NANOSECONDS_PER_SECOND
            return silence, after[0].measured
    raise BrokenPromiseError(f"not provable: no reading arrived after {seconds:g} s of silence.")


def states(bench: Bench) -> None:
    """States arrive at the promised rate, in order, with finite torques and without faults."""
    bench.start()
    bench.schedule(count=2)
    bench.run(1.2)
    shown = bench.wait_for(lambda: any(state.commanded for state in bench.states))
    require(shown, "No state shows that the pulses were commanded.")
    able, stamps = bench.robot.capabilities, [state.stamp for state in bench.states]
    ascending = all(a < b for a, b in itertools.pairwise(stamps))
    require(ascending, "The stamps of the states are not ascending.")
    for state in bench.states:
        torques = {"commanded": state.commanded}
        if able.measures_torque:
            torques["measured"] = state.measured
        for name, torque in torques.items():
            require(math.isfinite(torque), f"A state has a {name} torque of {torque} N m.")
        names = ", ".join(fault.name for fault in state.faults)
        require(not names, f"A state reports {names} while all is well.")
    if able.state_rate:
        bench.figures["state_rate_hz"] = rate = len(stamps) / 1.2
        least = bench.tolerances.state_rate * able.state_rate
        require(
            least <= rate <= 2 * able.state_rate,  # a rate in the wrong unit is off by 1000
            f"States came at {rate:.0f} Hz; promised: {able.state_rate:g} Hz.",
        )


def timing(bench: Bench) -> None:
    """Pulses are measured at their commanded onsets, within the allowed lag."""
    bench.start()
    count = 20 if bench.simulated else 8
    # A pulse that may come that late must not be over by then.
    duration = min(max(0.12, 2 * bench.tolerances.onset), bench.longest_pulse)
    period = duration + 0.18
    train = bench.schedule(count=count, duration=duration, period=period)
    bench.run(bench.lead + count * period + 0.3)
    bench.wait_for(lambda: bench.states and bench.states[-1].stamp >= train.end)
    late = lateness_ms(timings_of(train.pulses, bench.states), "measured")
    missing = count - len(late)
    bench.require_no_faults("Timing pulses led to a fault")
    require(not missing, f"{missing} of {count} pulses do not appear in the states.")
    bench.figures |= _distribution("", late)
    early, most = -1e3 * bench.tolerances.early, 1e3 * bench.tolerances.onset
    require(
        early <= late[0] and late[-1] <= most,
        f"Pulses were measured {late[0]:+.1f} to {late[-1]:+.1f} ms from their commanded onsets; "
        f"allowed: {early:+.1f} to {most:+.1f} ms.",
    )


def prompt_calls(bench: DriverBench) -> None:
    """Promise and read return promptly, without waiting for the device."""
    bench.start()
    bench.schedule(count=2)
    bench.run(1.0)
    calls = sorted(1e3 * seconds for seconds in [*bench.promise_times, *bench.read_times])
    usual, slowest = quantile(calls, 0.9), calls[-1]
    bench.figures |= {"p90_ms": usual, "worst_ms": slowest}
    most, limit = 1e3 * bench.tolerances.call, 1e3 * bench.tolerances.slowest_call
    require(
        usual <= most and slowest <= limit,
        f"Nine in ten calls took up to {usual:.1f} ms and the slowest {slowest:.0f} ms; "
        f"promised: {most:.0f} and {limit:.0f} ms.",
    )


def chosen_checks(checks: Sequence[Check], names: str) -> list[Check]:
    """Return the checks named in a list with commas, or all; raises UsageError for other names."""
    known = {check.__name__: check for check in checks}
    wanted = names.split(",") if names else [*known]
    for name in wanted:
        if name not in known:
            raise UsageError(f"--only: {name!r} is unknown; allowed: {', '.join(known)}")
    return [known[name] for name in wanted]


def _distribution(prefix: str, ms: Iterable[float]) -> dict[str, float]:
    shares = {"median": 0.5, "p99": 0.99, "worst": 1.0}
    return {f"{prefix}{name}_ms": quantile(sorted(ms), q) for name, q in shares.items()}


def _require_device_error(call: Callable[[], object], otherwise: str) -> None:
    with suppress(DeviceError):
        call()
        raise BrokenPromiseError(otherwise)


def _require_no_error(call: Callable[[], object], what: str) -> None:
    try:
        call()
    except BrokenPromiseError:
        raise
    except Exception as error:
        sentence = f"Calling {what} raised {type(error).__name__}: {error}."
        raise BrokenPromiseError(sentence) from None


# For every bench.
COMMON = (
    lifecycle,
    order,
    idle,
    pulses,
    shapes,
    cuts,
    beyond_limits,
    in_turn,
    cancelling,
    stopping_in_mid_pulse,
    stopping_in_every_state,
    deactivating,
    reconnecting,
    new_run,
    states,
    timing,
)
# For drivers only: topics do not show capabilities, limits or the duration of calls.
CHECKS = (construction, *COMMON, at_limits, stale_commands, silent_host, prompt_calls)
