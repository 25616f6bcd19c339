# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
gait_analyzer: stride periods, pulse phases and the entrainment verdict, online, from stamps.

A listener: nothing waits for it. What it publishes is a pure function of the events and the
onsets, promised or measured, in whatever order their messages arrive.
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
from gait_entrainment.messages import nanoseconds_of
from gait_entrainment.settings import setting
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.nodes.gait_analyzer_run import RESULTS, Run
from gait_entrainment_nodes.nodes.loop import run_node
from gait_entrainment_nodes.nodes.participant import Participant


@dataclass(frozen=True)
class Settings:
    """Parameters of the node, beside those of the verdict."""

    side: Side = setting(Side.RIGHT, "the perturbed leg: left or right")
    onset: str = setting(
        "commanded",
        "where a pulse begins: commanded, or measured where the robot's torque rises",
        choices=("commanded", "measured"),
    )


class GaitAnalyzerNode(Participant):
    """ROS side of the analyzer."""

    settings: Settings
    verdict: VerdictSettings
    run: Run | None

    def __init__(self) -> None:
        super().__init__("gait_analyzer")
        verdict = (VerdictSettings, "verdict.")
        self.begin_participation(settings=Settings, verdict=verdict, fixed=("onset",))
        for topic in RESULTS.values():
            self.offer(topic)
        self._latest_run = 0  # number of the latest run
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

    def run_of(self, message: Any) -> Run | None:
        """Return the run of a message if it is analyzed; a newer run begins anew."""
        if message.run > self._latest_run:
            self._latest_run = message.run
            side, measured = self.settings.side, self.settings.onset == "measured"
            self.run = Run(message.run, side, self.verdict, measured=measured)
            self.note_state(DiagnosticStatus.OK, f"run {message.run} goes on")
        return self.run if message.run == self._latest_run else None

    def _add(self, add: Callable[[Run, Any], list[Result]], run: Run, message: Any) -> None:
        """Hand a message to the run; publish what it allows, and the rest once all is here."""
        self._publish_results(run, add(run, message))
        if doubts := run.new_doubts():
            what = "gait events are not as they should be"
            stamp = nanoseconds_of(message.header.stamp)
            self.diagnose(stamp, DiagnosticStatus.WARN, what, **doubts)
        if run.complete:
            assert run.end is not None
            self._finish(run, run.end)

    def _on_finish(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Finish a run whose end was not recorded, or of which events are missing."""
        if self.run is not None:
            self._finish(self.run, self.run.promised_until)
        elif not self._latest_run:
            self.publish_counts(0, 0)  # for whoever waits for them: no run was heard
        response.success = True
        return response

    def _finish(self, run: Run, end: int) -> None:
        """Publish what was waiting: nothing more of this run will come."""
        self.run = None
        self._publish_results(run, run.finish(end))
        self.publish_counts(run.number, end)

    def _publish_results(self, run: Run, results: list[Result]) -> None:
        for result in results:
            self.publish(RESULTS[type(result)], run.message_of(result))


def main() -> int:
    """Run the node."""
    return run_node(GaitAnalyzerNode)
