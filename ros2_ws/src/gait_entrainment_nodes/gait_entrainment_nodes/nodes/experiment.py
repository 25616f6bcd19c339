# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
experiment: conducts a protocol with the running nodes.

The protocol is a goal of ``~/run_protocol``, or the parameter ``protocol``, in which case the node
ends with it. The node waits for the participants and starts the walker. From then on the run in
experiment_run.py decides what to promise and which participant is silent.
"""

import contextlib
import time
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.action import ActionClient
from rclpy.task import Future

from gait_entrainment.experiment import Conductor, Part
from gait_entrainment.protocol import ProtocolError, read_protocol
from gait_entrainment.robot import PulseTrain
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.action import DeliverPulseTrain, RunProtocol
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.goals import goal_of
from gait_entrainment_nodes.messaging.readers import who_hangs
from gait_entrainment_nodes.nodes.experiment_run import (
    PERTURBATOR,
    REASON_TIMEOUT,
    RECORDER,
    WALKER,
    ExperimentError,
    Run,
)
from gait_entrainment_nodes.nodes.goal_server import GoalServer
from gait_entrainment_nodes.nodes.parameters import texts
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.participants import ClockError, Participants
from gait_entrainment_nodes.nodes.waiting import Waiting

# Longest time for each step of ending a failed run [s]: a failed node may not answer.
FAREWELL = 0.5
# How long a node may take to answer a request before and after a run, such as to enable a device
# [s]. During a run silence_timeout applies.
ANSWER_TIMEOUT = 5.0

_TRANSITIONS = {
    Transition.TRANSITION_CONFIGURE: "be configured",
    Transition.TRANSITION_ACTIVATE: "be activated",
    Transition.TRANSITION_DEACTIVATE: "be deactivated",
}


@dataclass(frozen=True)
class Settings:
    """Parameters of the node; timeouts take effect immediately, others with the next run."""

    participants: tuple[str, ...] = texts(
        "names of the nodes that must be ready before a run starts",
        WALKER,
        PERTURBATOR,
        "gait_analyzer",
    )
    walker: str = setting(WALKER, "name of the node in the walker's role, for error messages")
    longest_lookahead: float = setting(
        10.0,
        "upper bound of the lookahead, which never exceeds a stride; short in real time, so that "
        "decisions can be made late",
        "s",
        (0.05, 10.0),
    )
    silence_timeout: float = setting(
        3.0, "how long a participant may owe an answer before the run fails", "s", (0.1, 60.0)
    )
    ready_timeout: float = setting(
        30.0, "how long to wait for the participants before a run", "s", (1.0, 600.0)
    )
    longest_clock_offset: float = setting(
        0.0,
        "largest offset of a participant's clock; 0: not checked, which suits simulated time",
        "s",
        (0.0, 10.0),
    )
    protocol: str = setting(
        "",
        "protocol to conduct immediately, a file or its text; the node then ends, with exit code "
        "1 if the run failed; empty: wait for goals of ~/run_protocol",
    )


class Experiment(Participant):
    """ROS side of the conductor: waits for participants, relays messages to and from a run."""

    settings: Settings
    run: Run | None

    def __init__(self) -> None:
        super().__init__("experiment", settings=Settings, fixed=("protocol",))
        self._runs = 0  # how many have started
        self._waiting = Waiting()

        self.offer(topics.HORIZON)
        self.offer(topics.EXPERIMENT_STATE)
        self.subscribe_to_run(topics.GAIT_EVENTS, Run.take_event)
        self.subscribe_to_run(topics.WALKER_PROGRESS, Run.take_progress)
        self.subscribe_to_run(topics.TORQUE_PROFILE, Run.take_profile)
        self.subscribe_to_run(topics.RECORDER_PROGRESS, Run.take_recorder_progress)
        self.subscribe(topics.TROUBLE, self._on_trouble)
        self._start = self.client(StartRun, "walker/start")
        self._change_state = self.client(ChangeState, f"{PERTURBATOR}/change_state")
        self._get_state = self.client(GetState, f"{PERTURBATOR}/get_state")
        self._deliver = ActionClient(self, DeliverPulseTrain, f"{PERTURBATOR}/deliver_pulse_train")
        self._participants = Participants(self, self.settings.participants, self._waiting)
        self._server = GoalServer(
            self,
            RunProtocol,
            "~/run_protocol",
            accept=lambda _: not self._waiting.busy,
            # The newline marks it as text: a goal cannot name a file on this host.
            begin=lambda goal: self._waiting.begin(self._conduct_goal(f"{goal.protocol}\n")),
        )
        if self.settings.protocol:
            self._waiting.begin(self._conduct_own())

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now; timeouts always can."""
        return super().why_fixed(name) if name.startswith("longest_") else ""

    # The run

    async def _conduct_goal(self, protocol: str) -> None:
        self._server.end(await self._conduct(protocol))

    async def _conduct_own(self) -> None:
        """Conduct the protocol given as a parameter, then end the node."""
        result = await self._conduct(self.settings.protocol)
        if result.outcome == result.FINISHED:
            self.finished = True
        else:
            self.failure = self.failure or result.message

    async def _conduct(self, protocol: str) -> RunProtocol.Result:
        """Conduct a protocol, a file or its text; the result says how it ended."""
        self._runs += 1
        recorded = RECORDER in self._participants.names
        run = self.run = Run(
            self._runs,
            self.publish,
            self._request,
            walker=self.settings.walker,
            recorded=recorded,
            real_time=self.real_time,
            held_up=lambda: who_hangs(self),
        )
        self.note_state(DiagnosticStatus.OK, f"run {run.number} is in progress")
        result = RunProtocol.Result(run=run.number, outcome=RunProtocol.Result.FAILED)
        try:
            final = await self._conduct_run(run, protocol)
            result.outcome, result.reproducible = result.FINISHED, final.reproducible
            result.message = final.message or "every stride of the protocol was walked"
            self.publish(topics.EXPERIMENT_STATE, run.state(Part.FINISHED, result.message))
            self.note_state(DiagnosticStatus.OK, f"run {run.number} finished")
        except (ExperimentError, ProtocolError) as failure:
            result.message, result.blamed = str(failure), getattr(failure, "node", "")
            await self._give_up(run, result.message)
            if self._server.cancelled:
                result.outcome = result.CANCELLED
        except Exception as error:
            result.message, result.blamed = str(error), self.get_name()
            self.fail_with(error)
        self.publish_counts(run.number, run.known_until)
        self.run = None
        return result

    async def _conduct_run(self, run: Run, protocol: str) -> msg.Progress:
        """Conduct a run to its end; return the walker's final progress."""
        conductor = Conductor(read_protocol(protocol), self.settings.longest_lookahead)
        await self._participants_ready()
        await self._activate_perturbator(run)
        run.begin(conductor, await self._start_walker(run))
        await self._waiting.until(lambda: run.over)
        if run.failure is not None:
            raise run.failure
        await self._close(run)
        # Any stop came before the answer: walking to the end without torque is not a success.
        if run.stopped_at is not None:
            await self._wait_for_reason(run)
        run.fail_if_troubled()
        final = run.final
        assert final is not None
        if final.state != msg.Progress.FINISHED:
            blamed = run.walker if final.state == msg.Progress.ABORTED else ""
            raise ExperimentError(final.message or "the walker ended the run", blamed)
        await self._transition(run, Transition.TRANSITION_DEACTIVATE)
        run.fail_if_troubled()
        return final

    async def _close(self, run: Run, timeout: float = ANSWER_TIMEOUT) -> None:
        """Announce the end of the run, and wait until the perturbator has answered."""
        run.close()
        silence = ExperimentError(f"{PERTURBATOR} does not answer", PERTURBATOR)
        await self._waiting.until(lambda: run.closed, timeout, silence)

    async def _give_up(self, run: Run, reason: str) -> None:
        """End a failed run, torque first, as far as the other nodes still answer."""
        self.publish(topics.EXPERIMENT_STATE, run.state(Part.FAILED, reason))
        self.diagnose(run.known_until, DiagnosticStatus.ERROR, reason)
        if run.activated:
            with contextlib.suppress(ExperimentError):
                await self._transition(run, Transition.TRANSITION_DEACTIVATE, FAREWELL)
        if run.promised_until and not run.closing:
            with contextlib.suppress(ExperimentError):
                await self._close(run, FAREWELL)

    # Bringing the participants together

    async def _participants_ready(self) -> None:
        """Wait until all participants are running and their subscriptions are matched."""
        timeout = self.settings.ready_timeout
        give_up = time.monotonic() + timeout
        while True:
            if self._server.cancelled:
                raise ExperimentError("cancelled by the client")
            try:
                await self._participants.check(self.settings.longest_clock_offset)
                if not (self._start.service_is_ready() and self._deliver.server_is_ready()):
                    walker = self.settings.walker
                    raise ExperimentError(f"{walker} or {PERTURBATOR} is not available", walker)
                if waiting := self.not_ready():
                    raise ExperimentError(f"experiment waits for {waiting}", self.get_name())
                return
            except ClockError:
                raise
            except ExperimentError as missing:
                if time.monotonic() > give_up:
                    what = f"not ready within {timeout:g} s: {missing}"
                    raise ExperimentError(what, missing.node) from None
            await self._waiting.tick()

    async def _activate_perturbator(self, run: Run) -> None:
        """Activate the perturbator from the state in which an earlier run left it."""
        response = await self._answer(self._get_state, GetState.Request(), PERTURBATOR)
        if response.current_state.id == State.PRIMARY_STATE_UNCONFIGURED:
            await self._transition(run, Transition.TRANSITION_CONFIGURE)
        if response.current_state.id != State.PRIMARY_STATE_ACTIVE:
            await self._transition(run, Transition.TRANSITION_ACTIVATE)
        run.activated = True

    async def _transition(self, run: Run, number: int, timeout: float = ANSWER_TIMEOUT) -> None:
        """Take the perturbator through one lifecycle transition."""
        request = ChangeState.Request(transition=Transition(id=number))
        response = await self._answer(self._change_state, request, PERTURBATOR, timeout)
        if not response.success:
            await self._wait_for_reason(run)
            raise run.trouble_error(f" refused to {_TRANSITIONS[number]}")

    async def _start_walker(self, run: Run) -> int:
        """Start the walker; return the time of heel strike 0 [ns since 1970]."""
        walker = run.walker
        response = await self._answer(self._start, StartRun.Request(run=run.number), walker)
        if not response.success:
            raise ExperimentError(f"{walker} did not start: {response.message}", walker)
        return nanoseconds_of(response.start)

    async def _answer(
        self, client: Any, request: Any, node: str, timeout: float = ANSWER_TIMEOUT
    ) -> Any:
        """Return a node's answer, for which it has ``timeout`` [s]."""
        call = client.call_async(request)
        silence = ExperimentError(f"{node} does not answer", node)
        await self._waiting.until(call.done, timeout, silence)
        return call.result()

    async def _wait_for_reason(self, run: Run) -> None:
        """Wait for the perturbator's reason, which may arrive later, on another topic."""
        await self._waiting.until(lambda: bool(run.trouble), REASON_TIMEOUT)

    # Messages to and from the run

    def publish(self, topic: topics.Topic, message: Any) -> None:
        """Publish a message; send the state of the run as action feedback as well."""
        super().publish(topic, message)
        if topic is topics.EXPERIMENT_STATE:
            self._server.publish_feedback(RunProtocol.Feedback(state=message))

    def _on_trouble(self, trouble: msg.Trouble) -> None:
        # Before the first horizon of a run the perturbator does not know its number.
        if self.run is not None:
            self.run.take_trouble(trouble)

    def _request(self, train: PulseTrain) -> None:
        """Request pulses of the run from the perturbator."""
        run = self.run
        assert run is not None

        def on_answered(future: Future) -> None:
            handle = future.result()
            if handle.accepted:
                # Requested immediately, because results expire.
                handle.get_result_async().add_done_callback(self.guarded(on_ended))
            run.take_answer(handle.accepted)

        def on_ended(future: Future) -> None:
            result = future.result().result
            if result.outcome in (result.STOPPED, result.CANCELLED):
                run.fail(ExperimentError(f"the pulses were stopped: {result.message}"))

        goal = goal_of(run.number, run.key, train)
        self._deliver.send_goal_async(goal).add_done_callback(self.guarded(on_answered))

    # Waiting, on steady time

    def next_deadline(self) -> float:
        """Return the time of the next tick."""
        return self._waiting.deadline

    def on_deadline(self) -> None:
        """Check everything that the node waits for."""
        held_up = self._waiting.look_after(self.settings.silence_timeout)
        run = self.run
        if run is None:
            return
        if held_up:
            run.forgive()
        if self._server.cancelled and run.conductor is not None:
            run.fail(ExperimentError("cancelled by the client"))
        run.check(self.settings.silence_timeout)

    def on_stop(self) -> None:
        """Report a failure if the node ends before its own protocol."""
        if self.settings.protocol and self._waiting.busy and not self.failure:
            self.failure = "stopped before the end of the protocol"


main = Experiment.main
