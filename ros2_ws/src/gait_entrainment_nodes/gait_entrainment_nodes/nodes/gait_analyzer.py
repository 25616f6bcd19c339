# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
gait_analyzer: stride periods, pulse phases and the entrainment verdict, online, from stamps.

A listener: nothing waits for it. What it publishes is a pure function of the events and the
onsets, promised or measured, however their messages interleave.
"""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from std_srvs.srv import Trigger

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import (
    Entrainment,
    GaitAnalyzer,
    GaitEvent,
    PulsePhase,
    Stride,
    VerdictSettings,
    published_values,
)
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.robot import MeasuredOnsets, RobotState
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging.stamps import header, to_nanoseconds, to_time
from gait_entrainment_nodes.messaging.topics import (
    ENTRAINMENT,
    GAIT_EVENTS,
    PULSE_PHASES,
    PULSES,
    ROBOT_STATE,
    STRIDES,
    TORQUE_PROFILE,
    WALKER_PROGRESS,
    Topic,
)
from gait_entrainment_nodes.nodes.node import (
    Participant,
    declare,
    declare_fields,
    declare_side,
    fields_of,
    run_node,
    side_of,
)

ONSETS = ("commanded", "measured")
# Where each kind of result is published.
RESULTS: dict[type, Topic] = {
    Stride: STRIDES,
    PulsePhase: PULSE_PHASES,
    Entrainment: ENTRAINMENT,
}


class GaitAnalyzerNode(Participant, Node):
    """ROS side of the analyzer."""

    def __init__(self) -> None:
        super().__init__("gait_analyzer")
        declare_side(self, "side", "the perturbed leg: left or right")
        self.onset = declare(
            self,
            "onset",
            ONSETS[0],
            "where a pulse begins: commanded, or measured where the robot's torque rises",
            choices=ONSETS,
        )
        if self.onset not in ONSETS:
            raise ValueError(f"onset: {self.onset!r}; allowed: {', '.join(ONSETS)}")
        declare_fields(self, VerdictSettings, "verdict.")
        self.begin_participation()
        self.result_publishers = {kind: self.publisher(topic) for kind, topic in RESULTS.items()}
        self.begin_run(0)
        self.subscription(GAIT_EVENTS, self.on_event)
        self.subscription(TORQUE_PROFILE, self.on_profile)
        self.subscription(WALKER_PROGRESS, self.on_progress)
        if self.onset == "measured":
            self.subscription(PULSES, self.on_pulse)
            self.subscription(ROBOT_STATE, self.on_state)
        self.create_service(Trigger, "~/finish", self.on_finish)

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now: a run is analyzed with it."""
        del name
        going_on = self.run_number and not self.finished_run
        return f"run {self.run_number} goes on; change it between runs" if going_on else ""

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """Take what the next run is analyzed with."""
        side = side_of("side", value)
        self.settings = fields_of(VerdictSettings, value, "verdict.")
        self.side = side

    def begin_run(self, run: int) -> None:
        """Forget the run before: every message carries the number of its run."""
        self.run_number = run
        self.analyzer = GaitAnalyzer(self.side, self.settings)
        self.events = 0
        self.measured = MeasuredOnsets()
        self.promised_until = 0  # all pulses up to this instant are known [ns since 1970]
        self.closed = False  # nothing will be promised any more
        self.final: msg.Progress | None = None
        self.finished_run = False
        self.doubts: dict[str, int] = {}  # counts of suspicious events, as reported last
        if run:
            self.note_state(DiagnosticStatus.OK, f"run {run} goes on")

    def of_this_run(self, run: int) -> bool:
        """Whether a message belongs to the run that is analyzed; a newer run begins anew."""
        if run > self.run_number:
            self.begin_run(run)
        return run == self.run_number

    def on_event(self, event: msg.GaitEvent) -> None:
        """Take one gait event."""
        if not self.of_this_run(event.run):
            return
        self.events += 1
        stamp = to_nanoseconds(event.header.stamp)
        results = self.analyzer.add_event(
            GaitEvent(stamp, EventKind(event.kind), Side(event.side), event.step)
        )
        self.publish(results)
        self.report_doubts(stamp)
        self.finish_if_complete()

    def on_profile(self, profile: msg.TorqueProfile) -> None:
        """Take the onsets that are promised, or a stop."""
        if not self.of_this_run(profile.run):
            return
        if profile.stop:
            stamp = to_nanoseconds(profile.header.stamp)
            self.analyzer.stop(stamp)
            self.measured.stop(stamp)
            return
        onsets = [to_nanoseconds(onset) for onset in profile.onsets]
        self.promised_until = to_nanoseconds(profile.valid_until)
        self.closed = self.promised_until == to_nanoseconds(profile.header.stamp)
        known = onsets, self.promised_until
        if self.onset == "measured":
            known = self.measured.add_promise(*known)
        self.take_onsets(*known)

    def on_pulse(self, pulse: msg.TorquePulse) -> None:
        """Take height and width of a pulse, to know its measured onset by."""
        if self.of_this_run(pulse.run):
            onset = to_nanoseconds(pulse.header.stamp)
            self.take_onsets(*self.measured.add_pulse(onset, pulse.torque, pulse.duration))

    def on_state(self, state: msg.AnkleRobotState) -> None:
        """Take the torque that the robot measured."""
        if self.of_this_run(state.run):
            torques = state.commanded_torque, state.measured_torque
            sampled = RobotState(to_nanoseconds(state.header.stamp), *torques, state.angle)
            self.take_onsets(*self.measured.add_state(sampled))

    def take_onsets(self, onsets: list[int], until: int) -> None:
        """Hand onsets to the analyzer, with the promise that none before an instant follow."""
        if self.finished_run:
            return
        self.publish(self.analyzer.add_promise(onsets, until))
        self.finish_if_complete()

    def on_progress(self, progress: msg.Progress) -> None:
        """Learn of the end of the run."""
        if self.of_this_run(progress.run) and progress.state != msg.Progress.WALKING:
            self.final = progress
            self.finish_if_complete()

    def finish_if_complete(self) -> None:
        """Once the run has ended and all of it has arrived here, publish what was waiting."""
        final = self.final
        if final is None or self.events < final.events:
            return
        end = to_nanoseconds(final.header.stamp)
        if self.promised_until < end:
            return
        if self.onset == "measured" and not (
            self.closed and self.measured.states_until >= self.promised_until
        ):
            return  # the state at the closing instant is the last one
        self.finish(end)

    def finish(self, end: int) -> None:
        """Publish what was waiting: nothing more of this run will come."""
        self.final = None
        self.finished_run = True
        if self.onset == "measured":
            self.publish(self.analyzer.add_promise(self.measured.finish(), end))
        self.publish(self.analyzer.finish())
        self.publish_counts(self.run_number, end)

    def on_finish(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Finish a run whose end was not recorded, or of which events are missing."""
        if not self.finished_run:
            self.finish(self.promised_until)
        response.success = True
        return response

    def report_doubts(self, stamp: int) -> None:
        """Say on /diagnostics when events are missing, doubled, late or contradictory."""
        doubts = asdict(self.analyzer.event_counts)
        del doubts["accepted"]
        if any(doubts.values()) and doubts != self.doubts:
            self.doubts = doubts
            self.diagnose(
                stamp, DiagnosticStatus.WARN, "gait events are not as they should be", **doubts
            )

    def publish(self, results: list[Result]) -> None:
        """Publish results in the order in which the core gave them."""
        for result in results:
            self.result_publishers[type(result)].publish(self.message_of(result))

    def message_of(self, result: Result) -> Any:
        """Convert a result."""
        values = published_values(result, self.side) | {"run": self.run_number}
        values["header"] = header(values["header"])
        for name in values.keys() & {"start", "toe_off"}:
            values[name] = to_time(values[name])
        return RESULTS[type(result)].type(**values)


def main() -> int:
    """Run the node."""
    return run_node(GaitAnalyzerNode)
