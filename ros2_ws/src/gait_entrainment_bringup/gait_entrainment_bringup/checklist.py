# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The points of the checklist before a session, each with its finding."""

import math
import shutil
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import DeviceError, GuardedRobot, driver_on, make_robots
from gait_entrainment.robot.faults import STOPPED
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_bringup.node_list import CLOCK_OFFSET, limits_of
from gait_entrainment_bringup.operator_console import STOP_KEY, pressed_key
from gait_entrainment_bringup.run_options import check_output
from gait_entrainment_drivers.monitor import NEAR_ZERO_SHARE, torque_scale
from gait_entrainment_drivers.proof import proof_of
from gait_entrainment_drivers.stop_channel import StopAnswer, stop_all
from gait_entrainment_nodes.messaging.domain import wanted_domain
from gait_entrainment_nodes.messaging.environment import set_environment
from gait_entrainment_nodes.nodes.stop_thread import StopThread

# How long the commands of the robot's loop are watched [s].
_WATCHED = 3.0
# How late a command may be [s]: a quarter of what the loop itself allows.
_LATE = 0.0125
# Least free space for a session [bytes]: an hour of samples at 1 kHz.
_SPACE = 2 * 10**9
# How many times each clock is compared; the quickest answer is the most accurate.
_COMPARISONS = 20
# Torque has this long to fall after the stop [s].
_FALL_TIME = 0.3


@dataclass
class Point:
    """One point of the checklist."""

    name: str
    passed: bool
    finding: str


def points(
    protocol: Protocol, bag: Path, elsewhere: Sequence[str], timeout: float
) -> Iterator[Point]:
    """
    Go through the checklist with a protocol's robot, enabled at zero torque.

    ``elsewhere`` are nodes on other hosts; the stop must be pressed within ``timeout`` [s].
    """
    yield _limits(protocol)
    for side in protocol.sides:
        yield _watchdog(driver_on(protocol.driver, side))
    yield _record(bag)
    if elsewhere:
        yield from _clocks(elsewhere)
    try:
        for robot in make_robots(protocol.driver, protocol.sides, protocol.limits).values():
            with robot:
                robot.configure()
                robot.activate()
                identity = robot.identity or "answers, but does not identify itself"
                yield Point("device", True, identity)
                yield _loop(robot)
                yield _stop(robot, timeout)
    except DeviceError as error:
        yield Point("device", False, str(error))


def _limits(protocol: Protocol) -> Point:
    limits = asdict(protocol.limits) | limits_of(protocol, worn=True)
    listed = ", ".join(f"{name} {value:g}" for name, value in limits.items())
    plan = protocol.planned
    most = "" if len(protocol.sequence) == 1 else "at most "
    pulses = f"{plan.count} pulses of {most}{protocol.pulse_torque:g} N m for {plan.duration:g} s"
    return Point("limits", True, f"{pulses}; {listed}")


def _watchdog(driver: str) -> Point:
    proof = proof_of(driver)
    if proof is None:
        return Point("watchdog", False, f"not proved: entrain driver prove '{driver}' --arm")
    within = f"torque ends {1e3 * proof.within:.0f} ms after the host falls silent"
    return Point("watchdog", True, f"{within}, proved {proof.at}")


def _record(bag: Path) -> Point:
    try:
        check_output(bag, exactly=False)
    except UsageError as error:
        return Point("record", False, str(error))
    parent = next(folder for folder in bag.absolute().parents if folder.exists())
    free = shutil.disk_usage(parent).free
    return Point("record", free > _SPACE, f"{free / 1e9:.1f} GB free in {parent}")


def _clocks(nodes: Sequence[str]) -> Iterator[Point]:
    """Compare the clocks of other hosts with this one."""
    set_environment(wanted_domain() or 0, real_time=True)
    # Not at the top: they load ROS, for which the environment must be set first.
    from gait_entrainment_msgs.srv import Ready
    from gait_entrainment_nodes.messaging.client import Client
    from gait_entrainment_nodes.nodes.experiment_run import ExperimentError
    from gait_entrainment_nodes.nodes.participants import ClockOffset

    with Client("entrain_preflight") as client:
        for node in nodes:
            offsets = []
            for _ in range(_COMPARISONS):
                question = client.ask(Ready, f"{node}/ready")
                if not client.wait(question.answer, 5.0):
                    break
                sent = time.time_ns()
                answer = client.call(Ready, f"{node}/ready")
                remote = nanoseconds_of(answer.now)
                offsets.append(ClockOffset.measured(sent, remote, time.time_ns()))
            if not offsets:
                yield Point("clock", False, f"{node} does not answer")
                continue
            best = min(offsets, key=lambda offset: offset.uncertainty)
            try:
                best.check(node, CLOCK_OFFSET)
            except ExperimentError as error:
                yield Point("clock", False, str(error))
                continue
            ahead, uncertain = 1e3 * best.offset, 1e3 * best.uncertainty
            found = f"{node}'s clock is ahead by {ahead:+.2f} ms, give or take {uncertain:.2f} ms"
            yield Point("clock", True, f"{found}; allowed: {1e3 * CLOCK_OFFSET:g} ms")


def _loop(robot: GuardedRobot) -> Point:
    """Watch how regularly the device is commanded."""
    robot.begin(time.time_ns())
    measured = _watch(robot, lambda: False, _WATCHED)
    if robot.faults:
        return Point("loop", False, "; ".join(f"{f.name}: {f.meaning}" for f in robot.faults))
    if math.isnan(measured):
        return Point("loop", False, "the device gave no reading")
    late = robot.timing.late
    if len(late) < 2:
        return Point("loop", True, "the device times its torque itself")
    percentiles = statistics.quantiles(late, n=100)
    p50, p99, worst = (1e3 * value for value in (percentiles[49], percentiles[98], max(late)))
    found = f"commands late by {p50:.2f} ms (median), {p99:.2f} ms (99 %), {worst:.2f} ms (worst)"
    if refused := robot.timing.refused:
        found += f"; the system does not permit {refused}: docs/safety.md"
    return Point("loop", max(late) < _LATE, found)


def _stop(robot: GuardedRobot, timeout: float) -> Point:
    """Wait for the stop to be pressed, and check that it is obeyed."""

    def stop() -> StopAnswer:
        robot.stop()
        return StopAnswer(True, "the stop is latched")

    def pressed() -> bool:
        if pressed_key() == STOP_KEY:
            stop_all()
        return STOPPED in robot.faults

    print(
        f"      press the stop within {timeout:g} s: the space bar here, or `entrain stop` in "
        "another terminal",
        file=sys.stderr,
    )
    channel = StopThread("preflight", stop)
    try:
        _watch(robot, pressed, timeout)
        if STOPPED not in robot.faults:
            return Point("stop", False, f"not pressed within {timeout:g} s")
        measured = _watch(robot, lambda: False, _FALL_TIME)
    finally:
        channel.close()
    if not abs(measured) <= NEAR_ZERO_SHARE * torque_scale(robot.capabilities):
        return Point("stop", False, f"pressed, but {measured:.2f} N m is measured: cut the power")
    return Point("stop", True, f"obeyed and latched, {measured:+.2f} N m measured")


def _watch(robot: GuardedRobot, over: Callable[[], bool], longest: float) -> float:
    """Read a robot until a condition holds or time [s] is up; return the last measured torque."""
    give_up, measured = time.monotonic() + longest, math.nan
    while time.monotonic() < give_up and not over():
        time.sleep(0.01)
        robot.heard()
        robot.promise(max(time.time_ns(), robot.promised_until))
        for state in robot.read():
            measured = state.measured
    return measured
