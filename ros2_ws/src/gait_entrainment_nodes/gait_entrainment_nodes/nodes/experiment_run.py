# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One run of the experiment without a node: what it promises, who owes it an answer and since when.

The core's Conductor decides what to perturb and when. The run answers each progress of the walker
with a horizon, once it has all events that the progress covers. While pulses are being requested
it promises nothing.
"""

import math
import secrets
import time
from collections.abc import Callable, Iterator
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.experiment import Conductor, Part
from gait_entrainment.robot import PulseTrain
from gait_entrainment_bags.messages import MessageError, event_of, nanoseconds_of
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.errors import NodeError
from gait_entrainment_nodes.messaging.goals import seal_of
from gait_entrainment_nodes.messaging.stamps import header, to_time

# How long after its effect the perturbator's reason may arrive [s]: they are on two topics.
REASON_TIMEOUT = 0.5
# Real time: how far a stamp may be ahead of the steady time since the start [ns]: clocks slew.
STAMP_TOLERANCE = 100_000_000
PERTURBATOR, WALKER, RECORDER = "perturbator", "walker_sim", "bag_recorder"


class ExperimentError(NodeError):
    """The run cannot continue."""


class Run:
    """
    One run, from waiting for its participants to the walker's final progress.

    ``request`` asks the perturbator for pulses; pass its answer to ``take_answer``. If the run is
    ``recorded``, the walker waits for the recorder. In ``real_time`` no node waits for another,
    and each is responsible for its own messages. ``walker`` is the node in that role. ``held_up``
    returns which process holds up the others, if known. ``clock`` returns steady time [s].
    """

    def __init__(
        self,
        number: int,
        publish: Callable[[topics.Topic, Any], None],
        request: Callable[[PulseTrain], None],
        *,
        recorded: bool,
        walker: str = WALKER,
        real_time: bool = False,
        held_up: Callable[[], str] = lambda: "",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.number, self.walker = number, walker
        # A client without it gets no pulses in this run. In lock-step, where nobody wears a robot,
        # it is fixed, so that a run's record is always the same.
        self.key = secrets.token_hex() if real_time else f"run {number}"
        self._seal = seal_of(self.key)
        self.conductor: Conductor | None = None  # once the walker has started
        self.known_until = 0  # all events up to this time have been received [ns since 1970]
        self.promised_until = 0  # by the latest horizon [ns since 1970]; 0 before the first
        self.final: msg.Progress | None = None  # the walker's last progress
        self.failure: ExperimentError | None = None
        self.trouble = ""  # what the perturbator has reported
        self.activated = False  # whether the perturbator was activated for this run
        self.stopped_at: float | None = None  # when it ended or refused torque, steady time [s]
        self.closing = self.closed = False  # the closing horizon was sent, was answered
        self._publish, self._request = publish, request
        self._recorded, self._real_time = recorded, real_time
        self._held_up, self._clock = held_up, clock
        self._events = 0
        self._progress: msg.Progress | None = None  # received, not answered yet
        self._reported = self._recorded_until = 0  # by walker and recorder [ns since 1970]
        self._covered: dict[int, int] = {}  # by each ankle's profiles [ns since 1970]
        self._closed: set[int] = set()  # ankles whose robots have answered the closing horizon
        self._planning = False  # pulses were requested and not answered yet
        # Real time: latest and earliest possible start of the walk, minus steady time [ns].
        self._began: tuple[int, int] | None = None
        self._shown: tuple[Part, int] | None = None
        self.forgive()

    @property
    def _covered_until(self) -> int:
        """Time up to which every robot's torque is promised [ns since 1970]."""
        sides = self.conductor.protocol.sides if self.conductor else ()
        return min((self._covered.get(side, 0) for side in sides), default=0)

    @property
    def over(self) -> bool:
        """Whether the walker has sent its final progress, or the run has failed."""
        return self.final is not None or self.failure is not None

    def begin(self, conductor: Conductor, start: int) -> None:
        """Make the first promise, with heel strike 0 at ``start`` [ns since 1970]."""
        self.conductor = conductor
        if self.trouble:
            self.fail(self.trouble_error())
        else:
            self._promise(conductor, start)
            # In real time the walk begins a little later than the walker's answer.
            now = time.time_ns()
            later = max(start - now, 0) / NANOSECONDS_PER_SECOND
            self._progress_at = self._clock() + later
            if self._real_time:  # a source may count from before the request
                steady = round(self._clock() * NANOSECONDS_PER_SECOND)
                self._began = max(start, now) - steady, min(start, now) - steady

    def fail(self, error: ExperimentError) -> None:
        """End the run, if it is not over."""
        if not self.over:
            self.failure = error

    def close(self) -> None:
        """
        Promise that the run ends where the last promise ended.

        After the answer no torque is left to stop, and deactivation publishes nothing new. In real
        time the walker may already be past that end if the last promise was late.
        """
        self.closing = True
        self.known_until = max(self.promised_until, self.known_until)
        self._send_horizon(self.known_until, last=True)

    def state(self, phase: Part, message: str = "") -> msg.ExperimentState:
        """Return phase and progress of the protocol, for display."""
        state = msg.ExperimentState(
            header=header(self.known_until),
            run=self.number,
            phase=phase,
            message=message,
            measured_period=math.nan,
            measured_period_error=math.nan,
            pulse_period=math.nan,
        )
        if (conductor := self.conductor) is not None:
            block = conductor.block
            state.strides = conductor.protocol.strides
            state.stride = min(conductor.strides, state.strides)
            state.block, state.blocks = block.number, len(conductor.protocol.sequence)
            state.block_name = block.plan.name
            state.measured_period = block.measured_period
            state.measured_period_error = block.measured_period_error
            state.pulse_period = block.pulse_period
            if block.first_onset is not None:
                state.first_onset = to_time(block.first_onset)
        return state

    # Incoming messages

    def take_event(self, event: msg.GaitEvent) -> None:
        """Take one gait event and act on it."""
        if self.conductor is None:
            return
        try:
            self.conductor.add_event(event_of(event), self._latest_stamp())
        except MessageError:
            return  # an invalid event, which the analyzer reports
        except EntrainmentError as error:
            self.fail(ExperimentError(str(error)))
            return
        self._events += 1
        self._answer()

    def take_progress(self, progress: msg.Progress) -> None:
        """Take the walker's progress; answer it once everything that it covers has arrived."""
        stamp = nanoseconds_of(progress.header.stamp)
        back = self._began is None and stamp < self.known_until  # impossible in lock-step
        if self.conductor is None or back:
            return
        if (ahead := stamp - self._latest_stamp()) > 0:
            lead = f"{ahead / NANOSECONDS_PER_SECOND:.3g} s beyond what is possible by now"
            self.fail(ExperimentError(f"{self.walker} reports progress {lead}", self.walker))
            return
        if self._progress is None:  # else an answer is already owed
            self._progress_at = self._clock()
            if self._began is not None:  # a lag would hide that the gait has stopped
                about = (stamp - self._began[1]) / NANOSECONDS_PER_SECOND
                owed_from = about + self.conductor.longest_lookahead
                self._progress_at = min(self._progress_at, owed_from)
        self._progress = progress
        if self._recorded_until >= self._reported:
            self._recorded_at = self._clock()
        self._reported = stamp
        self._answer()

    def take_recorder_progress(self, progress: msg.Progress) -> None:
        """Note how far the recorder is, to name it if the walker waits for it."""
        if (stamp := nanoseconds_of(progress.header.stamp)) <= self._latest_stamp():
            self._recorded_at, self._recorded_until = self._clock(), stamp

    def take_profile(self, profile: msg.TorqueProfile) -> None:
        """Note that the perturbator has answered a horizon, or has ended the torque."""
        if profile.stop:
            self._note_stop()
        else:
            until, self._profile_at = nanoseconds_of(profile.valid_until), self._clock()
            self._covered[profile.side] = min(until, self.promised_until)  # no more was requested
            if self.closing and self.conductor is not None:
                self._closed.add(profile.side)
                self.closed = self._closed.issuperset(self.conductor.protocol.sides)

    def take_trouble(self, trouble: msg.Trouble) -> None:
        """Take a report of the perturbator; a fault that has ended the torque ends the run."""
        latched = trouble.kind == msg.Trouble.LATCHED
        # During a run another client may request pulses and be refused.
        if latched or self._planning or self.conductor is None:
            self.trouble = trouble.message
        if latched and self.conductor is not None:
            self.fail(self.trouble_error())

    def take_answer(self, accepted: bool) -> None:
        """Continue once the pulses are accepted; the reason for a refusal may arrive later."""
        if not accepted:
            self._note_stop()
            return
        self.trouble = ""  # about another client's pulses
        self._planning = False
        self._answer()

    def _latest_stamp(self) -> float:
        """Return the latest stamp that the walker can have reached [ns since 1970]."""
        if self._began is None:  # lock-step
            return self.promised_until
        return self._began[0] + round(self._clock() * NANOSECONDS_PER_SECOND) + STAMP_TOLERANCE

    def _note_stop(self) -> None:
        if self.stopped_at is None:
            self.stopped_at = self._clock()

    # Outgoing messages

    def _answer(self) -> None:
        """
        Request the pulses that are due, else answer the latest progress with a horizon.

        Nothing is requested while an answer of the perturbator is missing, and no progress is
        answered while one of its events is.
        """
        progress, conductor = self._progress, self.conductor
        if conductor is None or self._planning or self.over:
            return
        if progress is not None and self._events < progress.events:
            progress = None
        if progress is not None:
            self.known_until = nanoseconds_of(progress.header.stamp)
        if train := conductor.due(self.known_until):
            self._planning, self._planning_at = True, self._clock()
            self._request(train)
            return
        if progress is None:
            return
        self._progress = None
        if progress.state != msg.Progress.WALKING:
            ended = conductor.part(self.known_until) is Part.FINISHED
            if progress.state == progress.FINISHED and not ended:
                walked = f"after {conductor.strides} strides of {conductor.protocol.strides}"
                self.fail(ExperimentError(f"{self.walker} ended the run {walked}", self.walker))
            self.final = progress
            return
        self._promise(conductor, self.known_until)
        shown = (conductor.part(self.known_until), conductor.strides)
        if shown != self._shown:
            self._shown = shown
            self._publish(topics.EXPERIMENT_STATE, self.state(shown[0]))

    def _promise(self, conductor: Conductor, known_until: int) -> None:
        """Promise up to when no new pulse will be requested."""
        self.known_until = known_until
        try:
            horizon = conductor.horizon(known_until)
        except EntrainmentError as error:
            self.fail(ExperimentError(str(error)))
            return
        # In real time progress continues while the last stretch is walked.
        if horizon.until != self.promised_until:
            self._send_horizon(horizon.until, horizon.last)

    def _send_horizon(self, until: int, last: bool) -> None:
        """Publish a horizon, to which an answer is owed from now on."""
        if self._covered_until >= self.promised_until:  # nothing was owed until now
            self._profile_at = self._clock()
        self.promised_until = until
        horizon = msg.Horizon(header=header(self.known_until), run=self.number, last=last)
        horizon.until, horizon.seal = to_time(until), self._seal
        self._publish(topics.HORIZON, horizon)

    # Silence

    def forgive(self) -> None:
        """Count silence from now: this process was held up and has not read what arrived."""
        now = self._clock()
        self._progress_at = self._profile_at = self._planning_at = self._recorded_at = now

    def check(self, silence_timeout: float) -> None:
        """Fail if a node has owed an answer for too long [s], or if torque has ended."""
        if self.conductor is None or self.over:
            return
        now, stopped_at = self._clock(), self.stopped_at
        if stopped_at is not None and (self.trouble or now > stopped_at + REASON_TIMEOUT):
            self.fail(self.trouble_error())
            return
        owed_since, silent = min(self._debts()) if self._real_time else next(self._debts())
        if owed_since < now - silence_timeout:
            what = f"{silent} has been silent"
            if silent == self.walker and self._progress is not None:
                total = self._progress.events
                what = f"{silent}: {total - self._events} of {total} gait events missing"
            why = self._held_up()
            self.fail(ExperimentError(f"{what} for {silence_timeout:g} s{why}", silent))

    def _debts(self) -> Iterator[tuple[float, str]]:
        """
        Yield since when an answer has been owed, on steady time [s], and by which node.

        In lock-step each of these nodes but the first rightly waits for the one before it.
        """
        if self._planning:
            yield self._planning_at, PERTURBATOR
        if self._covered_until < self.promised_until:
            yield self._profile_at, PERTURBATOR
        if self._recorded and self._recorded_until < self._reported:
            yield self._recorded_at, RECORDER
        since = self._progress_at
        yield since if self._real_time else max(since, self._profile_at), self.walker

    # Reports of the perturbator

    def fail_if_troubled(self) -> None:
        """Raise ExperimentError if the perturbator has reported trouble or ended the torque."""
        if self.trouble or self.stopped_at is not None:
            raise self.trouble_error()

    def trouble_error(self, what: str = "") -> ExperimentError:
        """Return the error that explains ``what`` the perturbator did."""
        reason = self.trouble or "it ended or refused torque and gave no reason"
        blamed = "" if self.trouble else PERTURBATOR
        return ExperimentError(f"{PERTURBATOR}{what}: {reason}", blamed)
