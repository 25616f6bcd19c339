# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
gait_analyzer: stride periods, pulse phases and the entrainment verdict, online, from stamps.

A listener: nothing waits for it. What it publishes is a pure function of the events and the
onsets, promised or measured, in whatever order their messages arrive.
"""

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.gait import VerdictSettings
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.messages import (
    event_of,
    nanoseconds_of,
    profile_of,
    pulse_of,
    state_of,
    stop_of,
)
from gait_entrainment.settings import setting
from gait_entrainment_msgs import msg
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
        self.subscribe_to_run(topics.GAIT_EVENTS, self._on_event)
        self.subscribe_to_run(topics.TORQUE_PROFILE, self._on_profile)
        self.subscribe_to_run(topics.WALKER_PROGRESS, self._on_progress)
        if self.settings.onset == "measured":
            self.subscribe_to_run(topics.PULSES, self._on_pulse)
            self.subscribe_to_run(topics.ROBOT_STATE, self._on_state)
        self.create_service(Trigger, "~/finish", self._on_finish)

    def run_of(self, message: Any) -> Run | None:
        """Return the run of a message if it is analyzed; a newer run begins anew."""
        if message.run > self._latest_run:
            self._latest_run = message.run
            side, measured = self.settings.side, self.settings.onset == "measured"
            self.run = Run(message.run, side, self.verdict, measured=measured)
            self.note_state(DiagnosticStatus.OK, f"run {message.run} goes on")
        return self.run if message.run == self._latest_run else None

    def _on_event(self, run: Run, event: msg.GaitEvent) -> None:
        results = run.add_event(event_of(event))
        if doubts := run.new_doubts():
            what = "gait events are not as they should be"
            stamp = nanoseconds_of(event.header.stamp)
            self.diagnose(stamp, DiagnosticStatus.WARN, what, **doubts)
        self._take(run, results)

    def _on_profile(self, run: Run, profile: msg.TorqueProfile) -> None:
        """Take the onsets that are promised, or a stop."""
        stop = stop_of(profile)
        if stop is not None:
            run.stop(stop)
        else:
            self._take(run, run.add_profile(profile_of(profile)))

    def _on_pulse(self, run: Run, pulse: msg.TorquePulse) -> None:
        self._take(run, run.add_pulse(*pulse_of(pulse)))

    def _on_state(self, run: Run, state: msg.AnkleRobotState) -> None:
        self._take(run, run.add_state(state_of(state)))

    def _on_progress(self, run: Run, progress: msg.Progress) -> None:
        if progress.state != msg.Progress.WALKING:
            run.end_at(nanoseconds_of(progress.header.stamp), progress.events)
            self._take(run, [])

    def _on_finish(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Finish a run whose end was not recorded, or of which events are missing."""
        if self.run is not None:
            self._finish(self.run, self.run.promised_until)
        elif not self._latest_run:
            self.publish_counts(0, 0)  # for whoever waits for them: no run was heard
        response.success = True
        return response

    def _take(self, run: Run, results: list[Result]) -> None:
        """Publish results, and the rest once all of the run is here."""
        self._publish_results(run, results)
        if run.complete:
            assert run.end is not None
            self._finish(run, run.end)

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
