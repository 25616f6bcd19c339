# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
experiment: conducts a protocol over the running nodes.

A protocol comes as a goal of ``~/run_protocol``, or as the parameter ``protocol``: then the node
ends with it. It brings the participants together, starts the walker, and from then on answers
every progress of the walker with a horizon. What to perturb and when is the core's Conductor; who
is waited for, and for how long, is decided here.
"""

import contextlib
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.task import Future

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.experiment import Conductor, Phase
from gait_entrainment.gait import GaitEvent
from gait_entrainment.protocol import Protocol, ProtocolError, read_protocol
from gait_entrainment.robot import PulseTrain
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.action import DeliverPulseTrain, RunProtocol
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging.stamps import header, to_nanoseconds, to_time
from gait_entrainment_nodes.messaging.topics import (
    DIAGNOSTICS,
    EXPERIMENT_STATE,
    GAIT_EVENTS,
    HORIZON,
    RECORDER_PROGRESS,
    TORQUE_PROFILE,
    WALKER_PROGRESS,
)
from gait_entrainment_nodes.nodes.node import Participant, declare, run_node
from gait_entrainment_nodes.nodes.participants import Participants
from gait_entrainment_nodes.nodes.waiting import OverdueError, Waiting

# How long each step of ending a failed run may take [s]: who fails may not answer any more. And
# how long its reason may come after its effect, which is on another topic.
FAREWELL = 0.5
NO_REASON = "it ended the torque or refused it, and gave no reason"

_TRANSITIONS = {
    Transition.TRANSITION_CONFIGURE: "be configured",
    Transition.TRANSITION_ACTIVATE: "be activated",
    Transition.TRANSITION_DEACTIVATE: "be deactivated",
}


class ExperimentError(Exception):
    """The experiment cannot go on; the message says why and names who."""


class Experiment(Participant, Node):
    """ROS side of the conductor. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("experiment")
        names: list[str] = declare(
            self,
            "participants",
            ["walker_sim", "perturbator", "gait_analyzer"],
            "names of the nodes that must be ready before a run starts",
        )
        declare(
            self,
            "longest_lookahead",
            10.0,
            "upper bound of the horizon's lead, which never exceeds a stride; "
            "short in real time, so that more can be decided late",
            unit="s",
            within=(0.05, 10.0),
            read_only=False,
        )
        declare(
            self,
            "silence_timeout",
            3.0,
            "a participant that owes an answer for so long ends the run",
            unit="s",
            within=(0.1, 60.0),
            read_only=False,
        )
        declare(
            self,
            "ready_timeout",
            30.0,
            "how long to wait for the participants before a run",
            unit="s",
            within=(1.0, 600.0),
            read_only=False,
        )
        self.protocol = declare(
            self,
            "protocol",
            "",
            "protocol to conduct at once, a file or its text: the node ends with it, with exit "
            "code 1 where it failed; empty waits for goals of ~/run_protocol",
        )
        self.begin_participation()
        self.horizons = self.publisher(HORIZON)
        self.states = self.publisher(EXPERIMENT_STATE)

        self.run_number = 0
        self.begin_run()
        self.busy = bool(self.protocol)  # a protocol has been accepted and has not ended yet
        self.own_begun = False  # the protocol of the parameter is conducted
        self.conductor: Conductor | None = None  # of the run that goes on
        self._goal: Any = None
        self._result = RunProtocol.Result()  # of the goal that was conducted last
        self.perturbator = f"{self.get_namespace()}/perturbator".lstrip("/")
        self.waiting = Waiting()

        self.subscription(GAIT_EVENTS, self.on_event)
        self.subscription(WALKER_PROGRESS, self.on_progress)
        self.subscription(TORQUE_PROFILE, self.on_profile)
        self.subscription(RECORDER_PROGRESS, self.on_recorder_progress)
        self.subscription(DIAGNOSTICS, self.on_diagnostics)
        self._start = self.create_client(StartRun, "walker_sim/start")
        self._change_state = self.create_client(ChangeState, "perturbator/change_state")
        self._get_state = self.create_client(GetState, "perturbator/get_state")
        self._deliver = ActionClient(self, DeliverPulseTrain, "perturbator/deliver_pulse_train")
        self.participants = Participants(self, names, self.waiting)
        self._server = ActionServer(
            self,
            RunProtocol,
            "~/run_protocol",
            execute_callback=self.execute,
            goal_callback=self.on_goal,
            handle_accepted_callback=self.guarded(self.on_accepted),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    # Parameters

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now; timeouts always can."""
        fixed = self.busy and name == "longest_lookahead"
        return f"run {self.run_number} goes on; change it between runs" if fixed else ""

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """Take the next run's lookahead; timeouts count from now on."""
        self.lookahead = value("longest_lookahead")
        self.silence_timeout = value("silence_timeout")
        self.ready_timeout = value("ready_timeout")

    # The run

    def on_goal(self, _: RunProtocol.Goal) -> GoalResponse:
        """Accept one protocol at a time."""
        if self.busy:
            return GoalResponse.REJECT
        self.busy = True
        return GoalResponse.ACCEPT

    def on_accepted(self, goal: Any) -> None:
        """Conduct the protocol of a goal, which is executed at its end: see `waiting`."""
        self._goal = goal
        self.waiting.begin(self.conduct_goal(goal))

    async def conduct_goal(self, goal: Any) -> None:
        """Conduct the protocol of a goal to its end."""
        self._result = await self.run(goal.request.protocol)
        self._goal = None
        goal.execute()

    def execute(self, goal: Any) -> RunProtocol.Result:
        """Say how the protocol of a goal ended."""
        result = self._result
        if result.outcome == RunProtocol.Result.FINISHED:
            goal.succeed()
        elif result.outcome == RunProtocol.Result.CANCELLED:
            goal.canceled()
        else:
            goal.abort()
        return result

    async def conduct_own(self) -> None:
        """Conduct the protocol of the parameter, and end the node with it."""
        result = await self.run(self.protocol)
        if result.outcome == RunProtocol.Result.FINISHED:
            self.finished = True
        else:
            self.failure = self.failure or result.message

    async def run(self, protocol: str) -> RunProtocol.Result:
        """Conduct a protocol, a file or its text; the result says how it ended."""
        self.run_number += 1
        self.begin_run()
        self.note_state(DiagnosticStatus.OK, f"run {self.run_number} goes on")
        result = RunProtocol.Result(run=self.run_number, outcome=RunProtocol.Result.FAILED)
        try:
            final = await self.conduct(read_protocol(protocol))
            result.reproducible = final.reproducible
            result.message = final.message or "every stride of the protocol was walked"
            await self.transition(Transition.TRANSITION_DEACTIVATE)
            self.fail_if_troubled()
            result.outcome = RunProtocol.Result.FINISHED
            self.publish_state(Phase.FINISHED, result.message)
            self.note_state(DiagnosticStatus.OK, f"run {self.run_number} finished")
        except (ExperimentError, OverdueError, ProtocolError) as failure:
            result.message = str(failure)
            await self.give_up(result.message)
            if self.cancelled:
                result.outcome = RunProtocol.Result.CANCELLED
        except Exception as error:
            result.message = str(error)
            self.fail_with(error)
        self.publish_counts(self.run_number, self.known_until)
        self.conductor = None
        self.busy = False
        return result

    async def conduct(self, protocol: Protocol) -> msg.Progress:
        """Conduct a protocol to its end; return the walker's last word."""
        await self.participants_ready()
        await self.activate_perturbator()
        conductor = Conductor(protocol, self.lookahead)
        start = await self.start_walker()
        self.conductor = conductor
        self.fail_if_troubled()
        self.publish_horizon(start)
        final = await self.waiting.until(self.ended)
        await self.close_run(self.silence_timeout)
        # The answer came behind every stop: a walk to its end without torque is no success.
        if self.stopped_at:
            self.trouble = await self.reason()
        self.fail_if_troubled()
        if final.state != msg.Progress.FINISHED:
            raise ExperimentError(final.message or "the walker ended the run")
        return final

    async def close_run(self, timeout: float) -> None:
        """
        Say that the run is over at the end of what was promised, and wait until that is heard.

        After that nobody has torque left to stop, and deactivation says nothing new. In real time
        the walker may be past that end already, where the last promise came late.
        """
        end = self.known_until = max(self.promised_until, self.known_until)
        self.closed = Future()
        self.send_horizon(end, last=True)
        await self.within(self.closed, "perturbator does not answer", timeout)

    async def give_up(self, reason: str) -> None:
        """End a failed run, torque first, as far as the others still answer."""
        self.publish_state(Phase.FAILED, reason)
        self.diagnose(self.known_until, DiagnosticStatus.ERROR, reason)
        if self.activated:
            with contextlib.suppress(ExperimentError, OverdueError):
                await self.transition(Transition.TRANSITION_DEACTIVATE, FAREWELL)
        if self.promised_until and self.closed is None:
            with contextlib.suppress(ExperimentError, OverdueError):
                await self.close_run(FAREWELL)

    def begin_run(self) -> None:
        """Forget the run before."""
        self.ended = Future()  # final progress of the walker, or why the run failed
        self.known_until = 0  # all events up to this instant have been seen [ns since 1970]
        self.events = 0
        self.progress: msg.Progress | None = None  # received, not answered yet
        # Since when an answer is owed, or was last heard, on steady time [s].
        self.progress_at = self.profile_at = self.planning_at = self.recorded_at = 0.0
        self.grant = self.recorded_grant = -1
        self.horizons_sent = self.profiles_received = 0
        self.promised_until = 0  # by the latest horizon [ns since 1970]
        self.planning = False  # a train has been requested and not been accepted yet
        self.activated = False  # the perturbator is, for this run
        self.closed: Future | None = None  # the horizon that closes the run has been answered
        self.shown: tuple[Phase, int] | None = None
        self.trouble = ""  # what the perturbator reports as an error
        self.stopped_at = 0.0  # it has ended the torque or rejected the pulses, steady time [s]

    # Bringing the participants together

    async def participants_ready(self) -> None:
        """Wait until every participant runs and all their subscriptions have been matched."""
        deadline = time.monotonic() + self.ready_timeout
        waiting = "participants"
        while waiting:
            if time.monotonic() > deadline:
                raise ExperimentError(f"not ready within {self.ready_timeout:g} s: {waiting}")
            self.fail_if_cancelled()
            waiting = await self.not_ready_yet()
            if waiting:
                await self.waiting.tick()

    async def not_ready_yet(self) -> str:
        """Return who is waited for, and for what; an empty text once all are ready."""
        waiting = await self.participants.not_ready()
        if waiting:
            return waiting
        if not (self._start.service_is_ready() and self._deliver.server_is_ready()):
            return "walker_sim or perturbator is not there"
        return f"experiment waits for {self.not_ready()}" if self.not_ready() else ""

    async def activate_perturbator(self) -> None:
        """Bring the perturbator from where a run before has left it to active."""
        response = await self.within(
            self._get_state.call_async(GetState.Request()), "perturbator does not answer"
        )
        if response.current_state.id == State.PRIMARY_STATE_UNCONFIGURED:
            await self.transition(Transition.TRANSITION_CONFIGURE)
        if response.current_state.id != State.PRIMARY_STATE_ACTIVE:
            await self.transition(Transition.TRANSITION_ACTIVATE)
        self.activated = True

    async def transition(self, number: int, timeout: float | None = None) -> None:
        """Take the perturbator through one lifecycle transition."""
        response = await self.within(
            self._change_state.call_async(ChangeState.Request(transition=Transition(id=number))),
            "perturbator does not answer",
            timeout,
        )
        if not response.success:
            name = _TRANSITIONS[number]
            raise ExperimentError(f"perturbator refused to {name}: {await self.reason()}")

    async def start_walker(self) -> int:
        """Start the walker; return the instant of heel strike 0 [ns since 1970]."""
        response = await self.within(
            self._start.call_async(StartRun.Request(run=self.run_number)),
            "walker_sim does not answer",
        )
        if not response.success:
            raise ExperimentError(f"walker_sim did not start: {response.message}")
        return to_nanoseconds(response.start)

    # The chain of promises

    def on_event(self, event: msg.GaitEvent) -> None:
        """Take one gait event; plan the pulses when it is time."""
        if self.conductor is None or event.run != self.run_number:
            return
        self.events += 1
        try:
            train = self.conductor.add_event(
                GaitEvent(
                    to_nanoseconds(event.header.stamp),
                    EventKind(event.kind),
                    Side(event.side),
                    event.step,
                )
            )
        except ProtocolError as error:
            self.fail(str(error))
            return
        if train is not None:
            self.request_pulses(train)
        self.answer_progress()

    def on_progress(self, progress: msg.Progress) -> None:
        """Take the walker's progress; it is answered once all that it covers is here."""
        if self.conductor is None or progress.run != self.run_number:
            return
        if self.progress is None:  # else this one says no more than that an answer is owed
            self.progress_at = time.monotonic()
        self.progress = progress
        if self.recorded_grant >= self.grant:
            self.recorded_at = time.monotonic()
        self.grant = progress.grant
        self.answer_progress()

    def answer_progress(self) -> None:
        """Answer the latest progress with a horizon, unless something is still to come."""
        progress, conductor = self.progress, self.conductor
        if progress is None or conductor is None or self.planning:
            return
        if self.events < progress.events or self.ended.done():
            return
        self.progress = None
        self.known_until = to_nanoseconds(progress.header.stamp)
        if progress.state != msg.Progress.WALKING:
            self.ended.set_result(progress)
            return
        self.publish_horizon(self.known_until)
        shown = (conductor.phase(self.known_until), conductor.strides)
        if shown != self.shown:
            self.shown = shown
            self.publish_state(shown[0], "")

    def publish_horizon(self, known_until: int) -> None:
        """Promise how far no new pulse will be requested."""
        assert self.conductor is not None
        self.known_until = known_until
        horizon = self.conductor.horizon(known_until)
        if horizon.until == self.promised_until:
            return  # in real time progress goes on while the last stretch is walked
        self.send_horizon(horizon.until, horizon.last)

    def send_horizon(self, until: int, last: bool) -> None:
        """Publish a horizon, which is owed an answer from now on."""
        self.promised_until = until
        self.horizons.publish(
            msg.Horizon(
                header=header(self.known_until),
                run=self.run_number,
                until=to_time(until),
                last=last,
            )
        )
        if self.horizons_sent == self.profiles_received:
            self.profile_at = time.monotonic()
        self.horizons_sent += 1

    def request_pulses(self, train: PulseTrain) -> None:
        """Ask the perturbator for the pulses; no promise goes out until it has accepted."""
        self.planning, self.planning_at = True, time.monotonic()
        goal = DeliverPulseTrain.Goal(
            run=self.run_number,
            side=train.side,
            first_onset=to_time(train.first_onset),
            period=train.period,
            count=train.count,
            torque=train.torque,
            duration=train.duration,
        )
        answered = self._deliver.send_goal_async(goal)
        answered.add_done_callback(self.guarded(self.on_pulses_answered))

    def on_pulses_answered(self, future: Future) -> None:
        """Go on once the perturbator has accepted the pulses."""
        train_goal = future.result()
        if not train_goal.accepted:
            self.stopped_at = time.monotonic()
            return
        self.trouble = ""  # of somebody else's train
        # Asked for at once: results expire.
        ended = train_goal.get_result_async()
        ended.add_done_callback(self.guarded(self.on_pulses_ended))
        self.planning = False
        self.answer_progress()

    def on_pulses_ended(self, future: Future) -> None:
        """End the run where the pulses were ended before their time."""
        result = future.result().result
        if result.outcome in (
            DeliverPulseTrain.Result.STOPPED,
            DeliverPulseTrain.Result.CANCELLED,
        ):
            self.fail(f"the pulses were ended: {result.message}")

    def on_profile(self, profile: msg.TorqueProfile) -> None:
        """Note that the perturbator has answered a horizon."""
        if profile.run != self.run_number:
            return
        if profile.stop:
            self.stopped_at = self.stopped_at or time.monotonic()
        else:
            self.profiles_received += 1
            self.profile_at = time.monotonic()
            closed = self.closed
            if closed is not None and not closed.done():
                closed.set_result(None)

    def on_diagnostics(self, message: Any) -> None:
        """Note an error of the perturbator, and why it rejects pulses; the run ends with it."""
        for status in message.status:
            if status.name != f"{self.perturbator}: run":
                continue
            error = status.level == DiagnosticStatus.ERROR
            if error or self.planning:
                self.trouble = status.message
            if error and self.conductor is not None:
                self.fail(f"perturbator: {status.message}")

    async def reason(self) -> str:
        """Return why the perturbator did what it did; it may come later, on another topic."""
        deadline = time.monotonic() + FAREWELL
        while not self.trouble and time.monotonic() < deadline:
            await self.waiting.tick()
        return self.trouble or NO_REASON

    def fail_if_troubled(self) -> None:
        """Raise where the perturbator has reported an error."""
        if self.trouble:
            raise ExperimentError(f"perturbator: {self.trouble}")

    def on_recorder_progress(self, progress: msg.Progress) -> None:
        """Note how far the recorder is, to name it where it is what the walker waits for."""
        if progress.run == self.run_number:
            self.recorded_at, self.recorded_grant = time.monotonic(), progress.grant

    # Waiting, on steady time

    def next_deadline(self) -> float:
        """Return the time of the next tick."""
        return self.waiting.deadline

    def on_deadline(self) -> None:
        """Look after everything that is waited for."""
        if self.protocol and not self.own_begun:
            self.own_begun = True
            self.waiting.begin(self.conduct_own())
        now = time.monotonic()
        if self.waiting.look_after():
            # This process was held up: what came meanwhile has not been heard yet.
            self.progress_at = self.profile_at = self.planning_at = self.recorded_at = now
        if self.conductor is not None and not self.ended.done():
            silent = self.silent_participant(now)
            if self.cancelled:
                self.fail("cancelled by the client")
            elif self.stopped_at and (self.trouble or now > self.stopped_at + FAREWELL):
                self.fail(f"perturbator: {self.trouble or NO_REASON}")
            elif silent:
                self.fail(f"{silent} for {self.silence_timeout:g} s")

    def on_stop(self) -> None:
        """Say so where the node is ended before its own protocol is."""
        if self.protocol and self.busy and not self.failure:
            self.failure = "stopped before the end of the protocol"

    def silent_participant(self, now: float) -> str:
        """Return who has owed what for too long, or an empty text."""
        latest = now - self.silence_timeout
        silent = "{} has been silent".format
        if self.planning:
            return silent("perturbator") if self.planning_at < latest else ""
        if self.horizons_sent > self.profiles_received:
            return silent("perturbator") if self.profile_at < latest else ""
        if "bag_recorder" in self.participants.names and self.recorded_grant < self.grant:
            # In lock-step the walker waits for the recorder, rightly.
            return silent("bag_recorder") if self.recorded_at < latest else ""
        if max(self.progress_at, self.profile_at) >= latest:
            return ""
        if self.progress is not None:
            total = self.progress.events
            return f"walker_sim: {total - self.events} of {total} gait events missing"
        return silent("walker_sim")

    @property
    def cancelled(self) -> bool:
        """Whether the client has cancelled the run."""
        return self._goal is not None and bool(self._goal.is_cancel_requested)

    def fail_if_cancelled(self) -> None:
        """Raise where the client has cancelled the run."""
        if self.cancelled:
            raise ExperimentError("cancelled by the client")

    def fail(self, reason: str) -> None:
        """End the run that goes on."""
        if not self.ended.done():
            self.ended.set_exception(ExperimentError(reason))

    async def within(self, future: Future, reason: str, timeout: float | None = None) -> Any:
        """Wait for an answer, at most for a time [s], by default the silence timeout."""
        timeout = self.silence_timeout if timeout is None else timeout
        return await self.waiting.within(future, reason, timeout)

    # Telling people

    def publish_state(self, phase: Phase, message: str) -> None:
        """Publish phase and progress of the protocol, also as the action's feedback."""
        state = msg.ExperimentState(
            header=header(self.known_until),
            run=self.run_number,
            phase=phase,
            message=message,
            measured_period=float("nan"),
            measured_period_error=float("nan"),
            pulse_period=float("nan"),
        )
        conductor = self.conductor
        if conductor is not None:
            state.stride = min(conductor.strides, conductor.protocol.strides)
            state.strides = conductor.protocol.strides
            state.measured_period = conductor.measured_period
            state.measured_period_error = conductor.measured_period_error
            if conductor.train is not None:
                state.pulse_period = conductor.train.period
                state.first_onset = to_time(conductor.train.first_onset)
        self.states.publish(state)
        if self._goal is not None:
            self._goal.publish_feedback(RunProtocol.Feedback(state=state))


def main() -> int:
    """Run the node."""
    return run_node(Experiment)
