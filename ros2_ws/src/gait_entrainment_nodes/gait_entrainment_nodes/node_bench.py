# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The conformance kit for a running node, in any language, over the perturbator's topics.

The user starts the node in the same ROS domain; its lifecycle is managed here. Horizons are sent
with simulated stamps or, to a node with a real robot, those of the wall clock: the torque is then
promised piece by piece, once it has been measured.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, Fault, LimitError, PulseTrain, TorqueProfile
from gait_entrainment_bags.messages import nanoseconds_of, profile_of, state_of
from gait_entrainment_drivers.conformance.bench import (
    Bench,
    Result,
    Tolerances,
    require,
    run_check,
)
from gait_entrainment_drivers.conformance.checks import COMMON, chosen_checks
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import Horizon
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.goals import goal_of, seal_of
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.messaging.topics import HORIZON, PULSES, ROBOT_STATE, TORQUE_PROFILE

# How long an answer may take, and how long to wait for one that must not come [s].
TIMEOUT = 5.0
SILENCE = 0.3
# How far horizons lead in real time [ns].
LEAD = 200_000_000
# Shows that a run's pulses are requested by the sender of its horizons.
KEY = "the kit's"
SEAL = seal_of(KEY)


class _NodeRobot:
    """A node, used like a GuardedRobot; what it sends is checked against the contract."""

    def __init__(self, name: str, *, simulated: bool, arm: bool) -> None:
        # What the topics do not show.
        unknown = {"measures_torque": False, "state_rate": 0.0}
        self.capabilities = SimpleNamespace(simulated=simulated, **unknown)
        self.faults: tuple[Fault, ...] = ()
        self.run = 0
        self.key = KEY
        self.goal: Any = None  # the latest that was accepted, unless it was ended early
        self.announced: list[int] = []  # onsets [ns]
        self.client = Client("entrain_driver_check")
        self._name, self._arm = name, arm
        self._configured = self._active = True  # as far as is known
        self._states: list[Any] = []
        self._profiles: list[Any] = []
        self._revisions: list[int] = []
        self._promised_until = 0  # [ns]
        self._stops = 0  # profiles with the stop flag
        self.client.subscribe(TORQUE_PROFILE, self._hear_profile)
        self.client.subscribe(ROBOT_STATE, self._hear_state)
        self.client.subscribe(PULSES, self._hear_pulse)
        self._horizons = self.client.node.create_publisher(HORIZON.type, HORIZON.name, HORIZON.qos)
        kinds = {"change_state": ChangeState, "stop": Trigger} | ({"arm": Trigger} if arm else {})
        ready = [self.client.service(kinds[n], f"{name}/{n}").service_is_ready for n in kinds]
        self._train = f"{name}/deliver_pulse_train"
        ready.append(self.client.action(DeliverPulseTrain, self._train).server_is_ready)
        ready.append(self._horizons.get_subscription_count)
        if not self.client.wait(lambda: all(known() for known in ready), TIMEOUT):
            self.client.close()
            raise DeviceError(
                f"no node {name} with {', '.join(kinds)}, deliver_pulse_train and a subscription "
                f"to {HORIZON.name} was found: start it in this ROS domain, unconfigured"
            )

    def configure(self) -> None:
        _require(self._change(Transition.TRANSITION_CONFIGURE), "configured")
        self._configured, self.faults = True, ()

    def activate(self) -> None:
        _require(self._change(Transition.TRANSITION_ACTIVATE), "activated")
        self._active = True

    def arm(self) -> None:
        if self._arm:
            _require(self._call(Trigger, "arm"), "armed")

    def begin(self, start: int) -> None:
        self.run += 1
        self.goal, self._promised_until = None, start
        for account in (self.announced, self._profiles, self._revisions, self._states):
            account.clear()

    def schedule(self, train: PulseTrain) -> None:
        goal = goal_of(self.run, self.key, train)
        handle = self.client.send_goal(DeliverPulseTrain, self._train, goal, timeout=TIMEOUT)
        if not handle.accepted:
            unarmed = not (self.capabilities.simulated or self._arm)
            raise LimitError(f"rejected{'; a real robot must be armed: --arm' if unarmed else ''}")
        self.goal = handle

    def promise(self, until: int) -> TorqueProfile:
        """Send a horizon; return the profile once it is promised up to an instant [ns]."""
        simulated = self.capabilities.simulated
        horizon = until if simulated else until + LEAD
        run, timeout = (self.run, TIMEOUT) if self._active else (self.run + 1, SILENCE)
        pieces: list[tuple[int, int, float]] = []
        onsets: list[int] = []
        if self._promised_until < until:  # a horizon without length would end the run
            begin, end = header(self._promised_until), to_time(horizon)
            self._horizons.publish(Horizon(header=begin, run=run, until=end, seal=SEAL))
        while self._promised_until < until:
            if not self.client.wait(lambda: self._profiles, timeout):
                raise DeviceError(f"A horizon was not answered within {timeout:g} s.")
            message = self._profiles.pop(0)
            require(message.run == run, f"A profile has run {message.run} instead of {run}.")
            profile = profile_of(message)
            profile.check(self._promised_until, horizon)
            reaches = profile.valid_until >= until if simulated else profile.has_length
            require(reaches, "A profile does not reach up to the horizon.")
            self._promised_until = profile.valid_until
            pieces += profile.pieces
            onsets += profile.onsets
        ordered = self._revisions == list(range(len(self._revisions)))
        require(ordered, f"The revisions are not consecutive: {self._revisions}.")
        times, _, torques = zip(*(pieces or [(until, until, 0.0)]), strict=True)
        return TorqueProfile(Side.LEFT, times, torques, tuple(onsets), self._promised_until)

    def read(self) -> list[Any]:
        states, self._states = self._states, []
        self.faults += tuple(fault for state in states for fault in state.faults)
        return states

    def cancel(self) -> None:
        answer = self._end(self.goal.cancel_goal_async)
        require(self.client.wait(answer.done, TIMEOUT), "Cancelling was not answered.")

    def stop(self) -> None:
        _require(self._end(lambda: self._call(Trigger, "stop")), "stopped")
        if not self._configured:
            # It must be refused once, or a run about to begin would release the stop by itself.
            held = not self._change(Transition.TRANSITION_CONFIGURE).success
            require(held, "A node stopped before it was configured could be configured.")

    def deactivate(self) -> None:
        self._active = False
        answer = self._end(lambda: self._change(Transition.TRANSITION_DEACTIVATE))
        _require(answer, "deactivated")

    def close(self) -> None:
        was_configured, self._configured = self._configured, False
        was_active, self._active = self._active, False
        self.goal, self._promised_until = None, 0
        if was_active:
            self._change(Transition.TRANSITION_DEACTIVATE)
        if was_configured:
            _require(self._change(Transition.TRANSITION_CLEANUP), "cleaned up")

    def _end(self, call: Callable[[], Any]) -> Any:
        """Make a call that ends the torque; if there may be any, the walker must get a stop."""
        stops, answer = self._stops, call()
        stopped = not self.goal or self.client.wait(lambda: self._stops > stops, TIMEOUT)
        require(stopped, "No profile with the stop flag was published.")
        self.goal = None
        return answer

    def _change(self, transition: int) -> Any:
        request = ChangeState.Request(transition=Transition(id=transition))
        return self._call(ChangeState, "change_state", request)

    def _call(self, service: Any, name: str, request: Any = None) -> Any:
        path = f"{self._name}/{name}"
        return self.client.call(service, path, request, period=math.inf, timeout=TIMEOUT)

    def _hear_profile(self, message: Any) -> None:
        if message.run == self.run:
            self._revisions.append(message.revision)
        if message.stop:
            self._stops += 1
        elif message.run != self.run - 1:  # those may have been under way when the run began
            self._profiles.append(message)

    def _hear_state(self, message: Any) -> None:
        if message.run == self.run:
            names = list(message.faults)
            if self._active and not names and message.status != message.ACTIVE:
                names = ["a status other than active"]
            faults = tuple(Fault(name, "") for name in names)
            self._states.append(replace(state_of(message), faults=faults))

    def _hear_pulse(self, message: Any) -> None:
        if message.run == self.run:
            self.announced.append(nanoseconds_of(message.header.stamp))


def _require(answer: Any, what: str) -> None:
    if not answer.success:
        raise DeviceError(
            f"The node could not be {what}: {getattr(answer, 'message', '') or 'refused'}."
        )


class NodeBench(Bench):
    """A node on the bench."""

    lead = 0.3

    def __init__(self, robot: _NodeRobot, side: Side, tolerances: Tolerances) -> None:
        super().__init__(side, tolerances)
        self.robot = self._node = robot

    def make(self, *, guarded: bool) -> _NodeRobot:  # noqa: ARG002
        """Return the node, unconfigured: it makes a new robot when it is configured."""
        with suppress(DeviceError):
            self._node.close()
        return self._node

    def stop(self) -> None:
        """Call the stop service."""
        self.robot.stop()

    def wait_for(self, condition: Callable[[], object]) -> bool:
        """Wait for messages until a condition holds; return whether it does."""

        def shown() -> object:
            self.states.extend(self.robot.read())
            return condition()

        return bool(self.robot.client.wait(shown, TIMEOUT))

    def require_delivered(self, train: PulseTrain) -> None:
        """Require that every pulse is reported and announced once, and the goal is delivered."""
        super().require_delivered(train)
        announced, onsets = self.robot.announced, self.onsets
        self.wait_for(lambda: len(announced) >= len(onsets))
        require(announced == onsets, f"Pulses were announced at {announced}, not at {onsets} ns.")
        ended = self.robot.client.result(self.robot.goal, TIMEOUT)
        require(ended, "A delivered train did not end.")
        outcome, delivered = ended.result.outcome, ended.result.delivered
        require(
            (outcome, delivered) == (ended.result.DELIVERED, len(train.pulses)),
            f"A delivered train ended with: {ended.result.message}",
        )


def other_run(bench: NodeBench) -> None:
    """A train for a run other than the current one is refused, and a train with another key."""
    bench.start()
    bench.robot.run += 7
    bench.require_refused(bench.train(), "for another run")
    bench.robot.run -= 7
    bench.robot.key = "another client's"
    bench.require_refused(bench.train(), "with another key")
    bench.robot.key = KEY
    bench.run(bench.lead + 0.2)
    bench.require_no_torque("although both trains were refused")


def check_node(
    name: str, side: Side, tolerances: Tolerances, *, real_time: bool, arm: bool, only: str = ""
) -> Iterator[Result]:
    """
    Run every check, or ``only`` some, on a node whose robot is on ``side``; yield each result.

    With ``real_time`` the stamps are of the wall clock, as the node of a real robot needs them;
    with ``arm`` its service ``~/arm`` is called, and it may deliver torque. Raises DeviceError if
    there is no such node, UsageError for an unknown check.
    """
    checks = chosen_checks((*COMMON, other_run), only)
    robot = _NodeRobot(name, simulated=not real_time, arm=arm)
    with robot.client:
        bench = NodeBench(robot, side, tolerances)
        for check in checks:
            yield run_check(check, bench)
