# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The conformance kit from outside: any node that speaks the perturbator's topics, in any language.

The node is started by whoever wants it checked, in the same ROS domain, unconfigured. It is
taken through its lifecycle. The stamps of the horizons that it is sent are simulated, or, for a
node that holds a real robot, those of the wall clock: the torque up to a horizon is then promised
piece by piece, once it was measured.
"""

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.messages import nanoseconds_of
from gait_entrainment.robot import DeviceError
from gait_entrainment.robot.timing import quantile
from gait_entrainment_drivers.conformance import BrokenPromiseError, Result, Tolerances
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.messaging.topics import HORIZON, PULSES, ROBOT_STATE, TORQUE_PROFILE

# How long an answer may take, and how long to wait for one that must not come [s].
PATIENCE = 5.0
SILENCE = 0.3
SECOND = NANOSECONDS_PER_SECOND
# How far each horizon leads [ns].
STRETCH = SECOND // 5
# The trains with which is checked: lead of the first onset [ns], period and width [s].
LEAD, PERIOD, WIDTH = 3 * SECOND // 10, 0.5, 0.15


class NodeBench:
    """What stands in for experiment and walker before the node under test."""

    def __init__(
        self, name: str, side: Side, tolerances: Tolerances, *, real_time: bool, arm: bool
    ) -> None:
        self.side, self.height, self.tolerances = side, tolerances.torque, tolerances
        self.real_time = real_time
        self._context = Context()
        rclpy.init(context=self._context)
        self.node = Node("entrain_driver_check", context=self._context)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.profiles: list[msg.TorqueProfile] = []
        self.states: list[msg.AnkleRobotState] = []
        self.pulses: list[msg.TorquePulse] = []
        for topic, heard in (
            (TORQUE_PROFILE, self.profiles),
            (ROBOT_STATE, self.states),
            (PULSES, self.pulses),
        ):
            self.node.create_subscription(topic.type, topic.name, heard.append, topic.qos)
        self._horizons = self.node.create_publisher(HORIZON.type, HORIZON.name, HORIZON.qos)
        self._change = self.node.create_client(ChangeState, f"{name}/change_state")
        self._stop = self.node.create_client(Trigger, f"{name}/stop")
        self._arm = self.node.create_client(Trigger, f"{name}/arm") if arm else None
        self._train = ActionClient(self.node, DeliverPulseTrain, f"{name}/deliver_pulse_train")
        self.run = 0
        self.now = 0  # [ns]
        self.latencies: list[float] = []
        self.figures: dict[str, float] = {}
        found = self.wait(
            lambda: (
                self._change.service_is_ready()
                and self._stop.service_is_ready()
                and (self._arm is None or self._arm.service_is_ready())
                and self._train.server_is_ready()
                and self._horizons.get_subscription_count() > 0
            )
        )
        if not found:
            self.close()
            raise DeviceError(
                f"no node {name} with change_state, stop, {'arm, ' if arm else ''}"
                f"deliver_pulse_train and a subscription of {HORIZON.name} was found: start it in "
                "this ROS domain, unconfigured"
            )

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def wait(self, condition: Callable[[], Any], patience: float = PATIENCE) -> bool:
        """Serve ROS until a condition holds; whether it came to hold."""
        give_up = time.monotonic() + patience
        while not condition():
            if time.monotonic() > give_up:
                return False
            self._executor.spin_once(timeout_sec=0.01)
        return True

    def answer(self, future: Any, what: str) -> Any:
        """Wait for an answer."""
        if not self.wait(future.done):
            raise BrokenPromiseError(f"There was no answer to {what} within {PATIENCE:g} s.")
        return future.result()

    def transition(self, number: int) -> bool:
        """Ask for a lifecycle transition; whether it was made."""
        request = ChangeState.Request(transition=Transition(id=number))
        return bool(self.answer(self._change.call_async(request), "a transition").success)

    def restart(self) -> None:
        """Bring the node from wherever it is to active, and begin a run."""
        for number in (
            Transition.TRANSITION_DEACTIVATE,
            Transition.TRANSITION_CLEANUP,
            Transition.TRANSITION_CONFIGURE,
            Transition.TRANSITION_ACTIVATE,
        ):
            made = self.transition(number)
        if not made:
            raise BrokenPromiseError("The node could not be configured and activated.")
        if self._arm is not None:
            armed = self.answer(self._arm.call_async(Trigger.Request()), "arming")
            if not armed.success:
                raise BrokenPromiseError(f"The node could not be armed: {armed.message}")
        self.begin()
        self.promise()

    def begin(self) -> None:
        """Begin a run, now or at a simulated instant of its own."""
        self.run += 1
        self.now = time.time_ns() if self.real_time else self.run * 1000 * SECOND

    def promise(self) -> None:
        """Send a horizon, hold its answer against the contract, and wait until it is over."""
        until, count = self.now + STRETCH, len(self.profiles)
        due = time.monotonic()
        if self.real_time:
            due += max(until - time.time_ns(), 0) / SECOND
        self.send_horizon(until)
        while self.now < until:
            if not self.wait(lambda seen=count: len(self.profiles) > seen):
                raise BrokenPromiseError(f"A horizon was not answered within {PATIENCE:g} s.")
            self.now = self.end_of(self.profiles[count], until)
            count += 1
            if self.now < until and not self.real_time:
                raise BrokenPromiseError("A profile does not reach up to the horizon.")
        self.latencies.append(max(time.monotonic() - due, 0.0))
        self.wait(lambda: time.monotonic() > due)

    def promise_until(self, instant: int) -> None:
        """Send horizons until what is promised reaches an instant [ns]."""
        while self.now < instant:
            self.promise()

    def send_horizon(self, until: int) -> None:
        """Send one horizon."""
        self._horizons.publish(
            msg.Horizon(header=header(self.now), run=self.run, until=to_time(until))
        )

    def end_of(self, profile: msg.TorqueProfile, until: int) -> int:
        """Hold a profile against the contract; return the instant up to which it promises."""
        times = [nanoseconds_of(t) for t in profile.times]
        ends = [*times[1:], nanoseconds_of(profile.valid_until)]
        if profile.run != self.run:
            raise BrokenPromiseError(f"A profile has run {profile.run} instead of {self.run}.")
        if not times or times[0] != self.now or ends[-1] > until:
            raise BrokenPromiseError(
                "A profile does not adjoin the one before, or goes beyond the horizon."
            )
        if len(times) != len(profile.torques) or any(
            a >= b for a, b in zip(times, ends, strict=True)
        ):
            raise BrokenPromiseError("The times of a profile are not ascending, one per torque.")
        if not all(math.isfinite(torque) for torque in profile.torques):
            raise BrokenPromiseError("The torques of a profile are not all finite.")
        return ends[-1]

    def start(self, **changes: Any) -> Any:
        """Request a harmless train, which must be accepted; return the goal's handle."""
        goal = self.request(**changes)
        if not goal.accepted:
            unarmed = self.real_time and self._arm is None
            hint = " A real robot must be armed: --arm." if unarmed else ""
            raise BrokenPromiseError(f"A harmless train was rejected.{hint}")
        return goal

    def request(self, **changes: Any) -> Any:
        """Request a train; return the goal's handle."""
        values = {
            "run": self.run,
            "side": int(self.side),
            "first_onset": to_time(self.now + LEAD),
            "period": PERIOD,
            "count": 2,
            "torque": self.height,
            "duration": WIDTH,
        }
        goal = DeliverPulseTrain.Goal(**{**values, **changes})
        return self.answer(self._train.send_goal_async(goal), "a goal")

    def pieces(self, begin: int) -> list[tuple[int, int, float]]:
        """Return begin, end [ns] and torque of what was promised from an instant on."""
        found = []
        for profile in self.profiles:
            times = [nanoseconds_of(t) for t in profile.times]
            ends = [*times[1:], nanoseconds_of(profile.valid_until)]
            found += [
                piece
                for piece in zip(times, ends, profile.torques, strict=False)
                if not profile.stop and piece[1] > begin
            ]
        return found

    def require_zero(self, begin: int, after: str) -> None:
        """Hold what was promised from an instant on against zero torque."""
        zero = self.tolerances.zero * self.height
        for start, _, torque in self.pieces(begin):
            if abs(torque) > zero and start > begin + self.tolerances.zero_within * SECOND:
                raise BrokenPromiseError(f"{torque:g} N m were promised after {after}.")


# The checks. The docstring of each is the promise.


def inactive(bench: NodeBench) -> None:
    """Before it is active, the node promises no torque and takes no train."""
    bench.begin()
    bench.send_horizon(bench.now + STRETCH)
    if bench.wait(lambda: bench.profiles, SILENCE):
        raise BrokenPromiseError("A horizon was answered before the node was active.")
    if bench.request().accepted:
        raise BrokenPromiseError("A train was accepted before the node was active.")


def idle(bench: NodeBench) -> None:
    """Every horizon is answered, by profiles that adjoin; without a train there is no torque."""
    bench.restart()
    begin, first = bench.now, len(bench.profiles) - 1
    for _ in range(5):
        bench.promise()
    told = [profile.revision for profile in bench.profiles[first:]]
    if told != list(range(told[0], told[0] + len(told))):
        raise BrokenPromiseError(f"The revisions are not consecutive: {told}.")
    bench.require_zero(begin, "no train at all")
    latencies = sorted(bench.latencies)
    for name, share in (("median", 0.5), ("p99", 0.99), ("worst", 1.0)):
        bench.figures[f"answer_{name}_ms"] = quantile(latencies, share) * 1e3


def pulses(bench: NodeBench) -> None:
    """Every pulse is promised once, at its onset, with its impulse and sign, and announced."""
    for sign in (1, -1):
        bench.restart()
        first, heard = bench.now + LEAD, len(bench.pulses)
        result = bench.start(torque=sign * bench.height).get_result_async()
        begin = len(bench.profiles)
        bench.promise_until(first + 2 * round(PERIOD * SECOND))
        expected = [first, first + round(PERIOD * SECOND)]
        told = [nanoseconds_of(o) for p in bench.profiles[begin:] for o in p.onsets]
        if told != expected:
            raise BrokenPromiseError(f"Onsets {told} were told for pulses at {expected} ns.")
        asked = sign * bench.height * WIDTH
        for onset in expected:
            span = (onset, onset + round(0.95 * PERIOD * SECOND))
            got = sum(
                torque * max(min(end, span[1]) - max(start, span[0]), 0) / SECOND
                for start, end, torque in bench.pieces(first)
            )
            if abs(got - asked) > bench.tolerances.impulse * abs(asked):
                raise BrokenPromiseError(f"A pulse of {asked:.3g} N m s had {got:.3g} N m s.")
        bench.wait(lambda heard=heard: len(bench.pulses) >= heard + 2)
        announced = [nanoseconds_of(pulse.header.stamp) for pulse in bench.pulses[heard:]]
        if announced != expected:
            raise BrokenPromiseError(f"Pulses at {announced} were announced for {expected} ns.")
        outcome = bench.answer(result, "the result of a train").result
        if outcome.outcome != DeliverPulseTrain.Result.DELIVERED or outcome.delivered != 2:
            raise BrokenPromiseError(f"A delivered train ended with: {outcome.message}")


def beyond_limits(bench: NodeBench) -> None:
    """A train that is beyond all limits, late, for another run or with NaN is rejected."""
    bench.restart()
    begin = bench.now
    for changes in (
        {"torque": math.nan},
        {"torque": 1e4},
        {"torque": -1e4},
        {"duration": 0.0},
        {"duration": math.nan},
        {"duration": 100.0, "period": 200.0},
        {"period": 0.1},
        {"count": 0},
        {"side": int(bench.side.other)},
        {"run": bench.run + 7},
        {"first_onset": to_time(bench.now - 1)},
    ):
        if bench.request(**changes).accepted:
            raise BrokenPromiseError(f"A train with {changes} was accepted.")
    bench.promise_until(begin + 3 * STRETCH)
    bench.require_zero(begin, "trains that were all rejected")


def one_at_a_time(bench: NodeBench) -> None:
    """A second train is rejected while one is under way."""
    bench.restart()
    bench.start()
    if bench.request().accepted:
        raise BrokenPromiseError("A second train was accepted while one was under way.")


def cancelling(bench: NodeBench) -> None:
    """Cancelling ends the torque at once, by a stop, and another train may follow."""
    bench.restart()
    goal = bench.start(count=20)
    bench.promise_until(bench.now + LEAD + STRETCH // 2)
    _ended_by_stop(bench, lambda: bench.answer(goal.cancel_goal_async(), "cancelling"))
    begin = bench.now
    bench.promise()
    bench.require_zero(begin, "cancelling")
    if not bench.request().accepted:
        raise BrokenPromiseError("A train was rejected after another one was cancelled.")


def stopping(bench: NodeBench) -> None:
    """The stop service ends the torque at once, latched until cleaned up and configured."""
    bench.restart()
    bench.start(count=20)
    bench.promise_until(bench.now + LEAD + STRETCH // 2)
    _ended_by_stop(
        bench, lambda: bench.answer(bench._stop.call_async(Trigger.Request()), "the stop")
    )
    begin = bench.now
    bench.promise()
    bench.require_zero(begin, "the stop")
    if bench.request().accepted:
        raise BrokenPromiseError("A train was accepted after the stop.")
    bench.transition(Transition.TRANSITION_DEACTIVATE)
    if bench.transition(Transition.TRANSITION_ACTIVATE):
        raise BrokenPromiseError("The node could be activated while the stop was latched.")
    bench.restart()
    if not bench.request().accepted:
        raise BrokenPromiseError("A train was rejected after cleaning up and configuring.")


def deactivating(bench: NodeBench) -> None:
    """Deactivation ends the torque at once, and no train is taken any more."""
    bench.restart()
    bench.start(count=20)
    bench.promise_until(bench.now + LEAD + STRETCH // 2)
    _ended_by_stop(bench, lambda: bench.transition(Transition.TRANSITION_DEACTIVATE))
    if bench.request().accepted:
        raise BrokenPromiseError("A train was accepted after deactivation.")


def states(bench: NodeBench) -> None:
    """States are published, ascending, with finite commands, and name no fault."""
    bench.restart()
    bench.start()
    bench.promise_until(bench.now + LEAD + STRETCH)
    found: list[msg.AnkleRobotState] = []

    def asked() -> bool:
        found[:] = [state for state in bench.states if state.run == bench.run]
        return any(state.commanded_torque for state in found)

    shown = bench.wait(asked)
    stamps = [nanoseconds_of(state.header.stamp) for state in found]
    if not shown:
        raise BrokenPromiseError("No state shows that the robot was asked for the pulses.")
    if stamps != sorted(stamps):
        raise BrokenPromiseError("The stamps of the states are not ascending.")
    for state in found:
        if not math.isfinite(state.commanded_torque):
            raise BrokenPromiseError("A state has a commanded torque that is not finite.")
        if state.faults or state.status != msg.AnkleRobotState.ACTIVE:
            raise BrokenPromiseError("A state reports a fault, or is not active, in a run.")


CHECKS = (
    inactive,
    idle,
    pulses,
    beyond_limits,
    one_at_a_time,
    cancelling,
    stopping,
    deactivating,
    states,
)


def check_node(
    name: str, side: Side, tolerances: Tolerances, *, real_time: bool = False, arm: bool = False
) -> Iterator[Result]:
    """
    Run every check on a node whose robot sits on a side; yields each result as it is there.

    In ``real_time`` stamps are of the wall clock, as the node of a real robot needs them. To
    ``arm`` is to call its service ``~/arm`` after each activation: it may deliver torque.

    Raises
    ------
    DeviceError
        where there is no such node.

    """
    bench = NodeBench(name, side, tolerances, real_time=real_time, arm=arm)
    try:
        for check in CHECKS:
            begun, broken = time.monotonic(), ""
            bench.figures = {}
            try:
                check(bench)
            except BrokenPromiseError as error:
                broken = str(error)
            promise = (check.__doc__ or "").strip()
            seconds = time.monotonic() - begun
            yield Result(check.__name__, promise, broken, seconds, bench.figures)
        bench.transition(Transition.TRANSITION_DEACTIVATE)
        bench.transition(Transition.TRANSITION_CLEANUP)
    finally:
        bench.close()


def _ended_by_stop(bench: NodeBench, end: Callable[[], Any]) -> None:
    """End a train, and see that the walker is told by a profile with the stop flag."""
    count = len(bench.profiles)
    end()
    if not bench.wait(lambda: any(p.stop for p in bench.profiles[count:])):
        raise BrokenPromiseError("No profile with the stop flag was published.")
