# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the gait detector: detections in, events and progress out, without a node."""

from collections.abc import Sequence

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment_msgs.msg import GaitEvent, Progress
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_sensors import Detection, Numbering


class Run:
    """
    One run; all times are [ns since 1970].

    Detections count time from ``epoch``. An event is detected at most ``latency`` [s] after it
    happens, so progress covers everything older than that: nothing is added to it later.
    """

    def __init__(
        self, number: int, start: int, latency: float, epoch: int, first_side: Side | None = None
    ) -> None:
        self.number, self.start = number, start
        self.events = 0  # published
        self.late = 0  # of these, those that an earlier progress had covered
        self.grant = 0  # number of the next progress report
        self.covered = start  # everything up to here has been published
        self.end: int | None = None  # of the run, once the experiment has announced it
        self.numbering = Numbering(first_side)
        self._latency, self._epoch = nanoseconds(latency), epoch

    def events_of(self, found: Sequence[Detection], detectors: Sequence[str]) -> list[GaitEvent]:
        """Return messages of what the detectors, [left, right], found, in order of detection."""
        messages = []
        for detection in sorted(found, key=lambda d: d.detected_at):
            if self._stamp(detection.time) < self.start:
                continue  # a step before the start of the run
            if (event := self.numbering.add(detection)) is None:
                continue
            stamp = self._stamp(detection.time)
            self.late += stamp <= self.covered and self.grant > 0
            messages.append(
                GaitEvent(
                    header=header(stamp),
                    run=self.number,
                    kind=event.kind,
                    side=event.side,
                    step=event.step,
                    source="gait_detector",
                    detected_at=to_time(self._stamp(detection.detected_at)),
                    uncertainty=detection.uncertainty,
                    detector=detectors[event.side],
                )
            )
        self.events += len(messages)
        return messages

    def progress_at(self, now: int) -> Progress:
        """Report how far all events have been published at a time of the sensors' clock."""
        ended = self.end is not None and now >= self.end + self._latency
        reached = self.end if ended and self.end is not None else now - self._latency
        return self._progress(reached, Progress.FINISHED if ended else Progress.WALKING)

    def progress_behind(self, truth: Progress, reached: int) -> Progress:
        """Report the same for a simulated walk, received completely up to ``reached``."""
        walking = truth.state == Progress.WALKING
        known = reached - self._latency if walking else reached
        return self._progress(known, truth.state, truth.message, truth.reproducible)

    def aborted(self) -> Progress:
        """Report that the node is being stopped."""
        return self._progress(self.covered, Progress.ABORTED, "gait_detector was shut down")

    def _progress(
        self, reached: int, state: int, message: str = "", reproducible: bool = True
    ) -> Progress:
        self.covered = max(reached, self.covered)
        self.grant += 1
        return Progress(
            header=header(self.covered),
            run=self.number,
            grant=self.grant - 1,
            events=self.events,
            reproducible=reproducible,
            state=state,
            message=message,
        )

    def _stamp(self, time: float) -> int:
        return self._epoch + round(time * NANOSECONDS_PER_SECOND)
