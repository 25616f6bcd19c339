# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
gait_detector: takes the walker's role for a person, from the signals of sensors on both feet.

gait_entrainment_sensors decides what an event is and when it is known, and numbers it. In real
time the node promises that events are known once their latency has passed on the wall clock. In
lock-step simulated sensors report how far they are, and nothing depends on when a message arrives.
"""

import math
import time
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.stamps import (
    LOCK_STEP_START,
    PROGRESS_PERIOD,
    START_DELAY,
    to_time,
)
from gait_entrainment_nodes.nodes.gait_detector_run import Run
from gait_entrainment_nodes.nodes.participant import STATE_PERIOD, Participant
from gait_entrainment_sensors import Detection, find_detector
from gait_entrainment_sensors.sources import source_of

# A sensor that has been silent for this long counts as absent [s].
_ABSENT = 1.0


@dataclass(frozen=True)
class Settings:
    """Parameters of the node; its subscriptions are fixed when it starts."""

    detector: str = setting(
        "vertical_force", "detector of both feet, NAME or NAME:OPTION=VALUE,OPTION=VALUE"
    )
    left: str = setting("", "detector of the left foot, if different")
    right: str = setting("", "detector of the right foot, if different")
    left_topic: str = setting("", "topic of the left sensor; empty: as in docs/person.md")
    right_topic: str = setting("", "topic of the right sensor; empty: as in docs/person.md")
    first_heel_strike: str = setting(
        "", "foot whose heel strikes have even numbers; empty: the first to strike",
        choices=("", "left", "right"),
    )  # fmt: skip
    delivery: float = setting(
        0.03, "longest time from sample to arrival, plus one sample period", "s", (0.0, 1.0)
    )
    longest_age: float = setting(
        0.5, "older samples, or ones ahead by over a tenth of it, are ignored", "s", (0.01, 10.0)
    )
    simulated: bool = setting(False, "sensor_sim replaces the person")


class GaitDetector(Participant):
    """ROS side of the detectors: converts samples, publishes events and progress."""

    settings: Settings
    run: Run | None

    def __init__(self) -> None:
        fixed = ("detector", "left", "right", "left_topic", "right_topic", "simulated")
        super().__init__("gait_detector", settings=Settings, fixed=fixed)
        self._events = self.offer(topics.GAIT_EVENTS)
        self.offer(topics.WALKER_PROGRESS)
        self._epoch = time.time_ns() if self.real_time else LOCK_STEP_START
        self._detectors = [find_detector(self._text_of(side)).make(side) for side in Side]
        self._topics = [self._listen(side) for side in Side]
        if len({*map(self.resolve_topic_name, (topic.name for topic in self._topics))}) < 2:
            raise ValueError(f"left_topic, right_topic: both are {self._topics[0].name}")
        self._heard = [0, 0]  # samples of each foot
        self._left_out = [0, 0]  # of these, those with implausible stamps
        self._age = [0.0, 0.0]  # of the latest such sample [s]
        self._heard_at = [-1e9, -1e9]  # on steady time [s]
        self._jumped = [False, False]  # whether the sensor's clock has, in this run
        self._found: list[Detection] = []  # lock-step: not numbered yet
        self._truth: msg.Progress | None = None  # lock-step: not answered yet
        self._readings = 0  # lock-step: samples of this run
        self._walked = False
        self._latest = ""  # latest event, for the diagnostics
        self._progress_at = self._state_at = 0.0
        self._counted = (0, 0)  # samples up to the latest state report
        self.subscribe_to_run(topics.HORIZON, self._on_horizon)
        if not self.real_time:
            self.subscribe_to_run(topics.TRUE_PROGRESS, self._on_truth)
        self.create_service(StartRun, "walker/start", self._on_start)
        self.create_service(Trigger, "walker/reset", self._on_reset)

    @property
    def latency(self) -> float:
        """Longest time from an event to its message [s]."""
        return max(d.latency for d in self._detectors) + self.settings.delivery

    def _text_of(self, side: Side) -> str:
        return getattr(self.settings, side.name.lower()) or self.settings.detector

    def _listen(self, side: Side) -> topics.Topic:
        """Subscribe to the sensor of one foot; return its topic."""
        detector = self._detectors[side]
        source = source_of(detector.name, detector.signals)
        topic = topics.sensor_topics(source)[side]
        if given := getattr(self.settings, f"{side.name.lower()}_topic"):
            topic = topic._replace(name=given)
        if not self.settings.simulated:  # from a driver, whatever it offers
            topic = topic._replace(qos=topics.FROM_A_DRIVER)
        read = source.reader(detector.signals)
        self.subscribe(topic, partial(self._on_sample, side, read))
        return topic

    # Samples

    def _on_sample(self, side: Side, read: Any, message: Any) -> None:
        stamp = nanoseconds_of(message.header.stamp)
        self._heard[side] += 1
        self._heard_at[side] = time.monotonic()
        if not self.real_time:
            self._readings += 1
        elif self._jumped[side] or not self._timely(side, stamp):
            return
        try:
            values = read(message)
        except IndexError:  # a joint state without positions
            values = (math.nan,)
        seconds = (stamp - self._epoch) / NANOSECONDS_PER_SECOND
        detector = self._detectors[side]
        jumps = detector.counts.clock_jumps
        self._found += detector.add(seconds, values)
        # The times of its events are no longer known: treat the sensor as silent.
        self._jumped[side] = self.run is not None and detector.counts.clock_jumps > jumps
        if self.real_time and self._found:
            self._publish_found()
        elif self._truth is not None:
            self._answer_truth()

    def _timely(self, side: Side, stamp: int) -> bool:
        """Whether a sample's stamp is plausible: neither old nor ahead of this host's clock."""
        age = (time.time_ns() - stamp) / NANOSECONDS_PER_SECOND
        longest = self.settings.longest_age
        if -0.1 * longest <= age <= longest:
            return True
        self._left_out[side] += 1
        self._age[side] = age
        return False

    def _publish_found(self) -> None:
        """Number and publish detections; between runs they only show that the sensors work."""
        found, self._found = self._found, []
        if found:
            latest = max(found, key=lambda detection: detection.detected_at)
            kind, side = latest.kind.name.lower(), latest.side.name.lower()
            self._latest = f"{kind} {side}".replace("_", " ")
        if self.run is None:
            return
        for event in self.run.events_of(found, [detector.name for detector in self._detectors]):
            self._events.publish(event)

    # The role of the walker

    def _on_start(self, request: StartRun.Request, response: StartRun.Response) -> Any:
        if self.run is not None or (self._walked and not self.real_time):
            response.message = (
                "a run is in progress, or a lock-step run is over: restart this node"
            )
        elif waiting := self.not_ready():
            response.message = f"gait_detector waits for {waiting}"
        else:
            start = time.time_ns() + START_DELAY if self.real_time else LOCK_STEP_START
            first = self.settings.first_heel_strike
            side = Side[first.upper()] if first else None
            self.run = Run(request.run, start, self.latency, self._epoch, side)
            self._readings, self._walked, self._jumped = 0, True, [False, False]
            self._progress_at = time.monotonic() + START_DELAY / NANOSECONDS_PER_SECOND
            self.note_state(DiagnosticStatus.OK, f"run {request.run} is in progress")
            response.success, response.start = True, to_time(start)
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        response.success = self.run is None
        response.message = "" if response.success else "a run is in progress"
        return response

    def _on_horizon(self, run: Run, horizon: msg.Horizon) -> None:
        if horizon.last and run.end is None:
            run.end = nanoseconds_of(horizon.until)

    def _on_truth(self, _: Run, truth: msg.Progress) -> None:
        self._truth = truth
        self._answer_truth()

    def _answer_truth(self) -> None:
        """Continue once all samples that a simulated walk has sent have arrived."""
        truth, run = self._truth, self.run
        if truth is None or run is None or self._readings < truth.samples:
            return
        self._truth = None
        self._publish_found()
        self._send_progress(run.progress_behind(truth, nanoseconds_of(truth.header.stamp)))

    def _send_progress(self, progress: msg.Progress) -> None:
        self.publish(topics.WALKER_PROGRESS, progress)
        if progress.state == msg.Progress.WALKING:
            return
        run, self.run = self.run, None
        assert run is not None
        stamp = nanoseconds_of(progress.header.stamp)
        level, troubles = self._condition(run)
        what = progress.message or troubles or "finished"
        self.diagnose(stamp, level, what, events=run.events, late_events=run.late)
        self.publish_counts(progress.run, stamp)

    # Readiness and state

    def not_ready(self) -> str:
        """Return what the node waits for: a sensor that is absent or of the wrong type."""
        for side, topic in zip(Side, self._topics, strict=True):
            wanted = f"{topic.type.__module__.split('.')[0]}/msg/{topic.type.__name__}"
            found = {i.topic_type for i in self.get_publishers_info_by_topic(topic.name)}
            if wanted not in found:
                what = f"published as {', '.join(sorted(found))}" if found else "not published"
                return f"{topic.name} [{wanted}]: {what}"
            if self.settings.simulated:
                continue
            if time.monotonic() - self._heard_at[side] > _ABSENT:
                return f"the sensor of the {side.name.lower()} foot: silent on {topic.name}"
            if self._left_out[side] == self._heard[side]:
                return f"the clock of the {side.name.lower()} sensor: {self._clock_of(side)}"
        return super().not_ready()

    def _clock_of(self, side: Side) -> str:
        age = self._age[side]
        way = "behind" if age > 0 else "ahead of"
        return (
            f"its stamps are {abs(age):.3g} s {way} this host's; allowed: "
            f"{self.settings.longest_age:g} s: synchronize the clocks (docs/hosts.md)"
        )

    def _condition(self, run: Run | None) -> tuple[bytes, str]:
        """Return level and text of this node's state."""
        now = None
        if self.real_time:
            now = (time.time_ns() - self._epoch) / NANOSECONDS_PER_SECOND
        troubles = [line for detector in self._detectors for line in detector.troubles(now)]
        troubles += [
            f"{side.name.lower()}: {self._left_out[side]} samples ignored: {self._clock_of(side)}"
            for side in Side
            if self._left_out[side]
        ]
        troubles += [
            f"{side.name.lower()}: the sensor's clock jumped back: the sensor is ignored for the "
            "rest of this run; synchronize its clock"
            for side in Side
            if self._jumped[side]
        ]
        if run is not None:
            troubles += run.numbering.troubles()
            if run.late:
                troubles.append(f"{run.late} events arrived later than promised: raise delivery")
        return (DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK), "; ".join(troubles)

    def next_deadline(self) -> float:
        """Return when to report progress or the state of the sensors."""
        due = [self._state_at]
        if self.run is not None and self.real_time:
            due.append(self._progress_at)
        return min(due)

    def on_deadline(self) -> None:
        """Report what is due."""
        now = time.monotonic()
        if self.run is not None and self.real_time and now >= self._progress_at:
            self._progress_at = max(self._progress_at + PROGRESS_PERIOD / 1e9, now)
            self._send_progress(self.run.progress_at(time.time_ns()))
        if now >= self._state_at:
            self._state_at = now + STATE_PERIOD
            level, troubles = self._condition(self.run)
            rates = {
                f"{side.name.lower()}_samples_per_second": self._heard[side] - self._counted[side]
                for side in Side
            }
            self._counted = (self._heard[0], self._heard[1])
            values = {"latest": self._latest, "samples": sum(self._heard), **rates}
            self.note_state(level, troubles or "receiving both sensors", **values)

    def on_stop(self) -> None:
        """Report the end of the process if a run is in progress."""
        if self.run is not None:
            self._send_progress(self.run.aborted())


main = GaitDetector.main
