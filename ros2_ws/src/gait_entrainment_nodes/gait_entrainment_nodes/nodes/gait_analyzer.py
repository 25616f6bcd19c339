# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
gait_analyzer: stride periods, pulse phases and the entrainment verdict, online, from stamps.

It only listens, and nothing waits for it. What it publishes is a pure function of the events and
the onsets, promised or measured, whatever the order in which their messages arrive.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.gait import VerdictSettings
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import MessageError, nanoseconds_of
from gait_entrainment_bags.truth import TOE_OFF_BIAS
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.nodes.gait_analyzer_run import RESULTS, Run
from gait_entrainment_nodes.nodes.participant import Participant


@dataclass(frozen=True)
class Settings:
    """Parameters of the node, in addition to those of the verdict."""

    side: Side = setting(Side.RIGHT, "the perturbed leg: left or right")
    both_ankles: bool = setting(
        False, "whether the other ankle gets pulses too; that leg is analyzed separately"
    )
    onset: str = setting(
        "commanded",
        "onset of a pulse: as commanded, or as measured when the robot's torque rises",
        choices=("commanded", "measured"),
    )
    toe_off_bias: float = setting(
        0.0, TOE_OFF_BIAS.meaning, "s", (TOE_OFF_BIAS.least, TOE_OFF_BIAS.most)
    )


class Legs(tuple[Run, ...]):
    """One run: that of each leg that is analyzed."""

    @property
    def number(self) -> int:
        """Number of the run."""
        return self[0].number


class GaitAnalyzerNode(Participant):
    """ROS side of the analyzer."""

    settings: Settings
    verdict: VerdictSettings
    run: Legs | None

    def __init__(self) -> None:
        verdict = (VerdictSettings, "verdict.")
        super().__init__("gait_analyzer", settings=Settings, verdict=verdict, fixed=("onset",))
        for topic in RESULTS.values():
            self.offer(topic)
        self._latest_run = 0  # number of the latest run
        self._first_event: msg.GaitEvent | None = None  # of a run other than the current one
        heard: list[tuple[topics.Topic, Any]] = [
            (topics.GAIT_EVENTS, Run.add_event),
            (topics.TORQUE_PROFILE, Run.add_profile),
            (topics.WALKER_PROGRESS, Run.add_progress),
        ]
        if self.settings.onset == "measured":
            heard += [(topics.PULSES, Run.add_pulse), (topics.ROBOT_STATE, Run.add_state)]
        for topic, add in heard:
            self.subscribe_to_run(topic, partial(self._add, add))
        self.create_service(Trigger, "~/finish", self._on_finish)

    def run_of(self, message: Any) -> Legs | None:
        """
        Return the run of a message if it is analyzed; a newer run replaces it.

        During a run, only the first torque profile of another run starts that run: a message with
        a wrong number must not end the analysis.
        """
        begins = isinstance(message, msg.TorqueProfile) and not message.revision
        if message.run != self._latest_run and (
            begins or (self.run is None and message.run > self._latest_run)
        ):
            self._latest_run = message.run
            side, measured = self.settings.side, self.settings.onset == "measured"
            bias, number = self.settings.toe_off_bias, message.run
            self.run = Legs(
                Run(number, leg, self.verdict, bias, measured=measured)
                for leg in (side, side.other)[: 1 + self.settings.both_ankles]
            )
            self.note_state(DiagnosticStatus.OK, f"run {message.run} is in progress")
            first, self._first_event = self._first_event, None
            if first is not None and first.run == message.run:
                self._add(Run.add_event, self.run, first)
        if message.run == self._latest_run:
            return self.run
        if isinstance(message, msg.GaitEvent) and not message.step:
            self._first_event = message  # it precedes the first torque profile
        self._warn(message, "messages of another run are not analyzed", run=message.run)
        return None

    def _add(self, add: Callable[[Run, Any], list[Result]], runs: Legs, message: Any) -> None:
        """Pass a message to the run; publish what it completes, and the rest after the last."""
        of_ankle = not isinstance(message, (msg.GaitEvent, msg.Progress)) and len(runs) > 1
        for run in runs:
            if of_ankle and message.side != run.side:
                continue
            try:
                self._publish_results(run, add(run, message))
            except MessageError as error:
                self._warn(message, f"an invalid message is dropped: {error}")
            if doubts := run.new_doubts():
                self._warn(message, "doubtful gait events", **doubts)
        if all(run.complete for run in runs):
            assert runs[0].end is not None
            self._finish(runs, runs[0].end)

    def _warn(self, message: Any, what: str, **values: Any) -> None:
        stamp = nanoseconds_of(message.header.stamp)
        self.diagnose(stamp, DiagnosticStatus.WARN, what, **values)

    def _on_finish(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Finish a run whose end was not recorded, or whose events are incomplete."""
        if self.run is not None:
            self._finish(self.run, min(run.promised_until for run in self.run))
        elif not self._latest_run:
            self.publish_counts(0, 0)  # for nodes that wait for them: there was no run
        response.success = True
        return response

    def _finish(self, runs: Legs, end: int) -> None:
        """Publish the remaining results: nothing more of this run will arrive."""
        self.run = None
        for run in runs:
            self._publish_results(run, run.finish(end))
        self.publish_counts(runs.number, end)

    def _publish_results(self, run: Run, results: list[Result]) -> None:
        for result in results:
            self.publish(RESULTS[type(result)], run.message_of(result))


main = GaitAnalyzerNode.main
