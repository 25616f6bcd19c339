# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A simulated experiment that relies on events detected in emulated sensors: one process, no ROS.

The chain is that of an experiment with a person. The conductor receives the detected events, which
are complete up to the time reached minus the detector's latency; the walker responds to the
resulting torque. The exact events are kept as the truth.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.experiment import Conductor
from gait_entrainment.gait import Analysis, GaitEvent
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import PulseTrain
from gait_entrainment.run import analyze_blocks
from gait_entrainment.simulation import begun_robots
from gait_entrainment.walker import Ending, Walker
from gait_entrainment_sensors.detection import ChosenDetector, Detection
from gait_entrainment_sensors.emulated import EmulatedSensor, EmulatedSettings
from gait_entrainment_sensors.numbering import Numbering


@dataclass(frozen=True)
class Rehearsal:
    """The result of a rehearsal; stamps count from its start."""

    truth: tuple[GaitEvent, ...]  # the walker's exact events
    events: tuple[GaitEvent, ...]  # what was detected and numbered, in that order
    onsets: tuple[int, ...]  # of the pulses [ns]
    train: PulseTrain | None  # as requested in the last block
    analysis: Analysis  # of the detected events
    true_analysis: Analysis  # of the exact events, with the same pulses
    ending: Ending | None  # fall or fly-off
    troubles: tuple[str, ...]


class Sensors:
    """Emulated sensors on both feet, their detectors, and the numbering of what they find."""

    def __init__(
        self,
        kind: str,
        detector: ChosenDetector,
        first_side: Side,
        settings: EmulatedSettings | None = None,
        seed: int = 0,
    ) -> None:
        self.detectors = [detector.make(side) for side in Side]
        self.numbering = Numbering(first_side)
        self._sensors = [EmulatedSensor(kind, side, settings, seed) for side in Side]

    @property
    def latency(self) -> float:
        """Longest time from an event to its detection [s], two sample intervals included."""
        interval = 1.0 / self._sensors[0].settings.rate
        return max(detector.latency for detector in self.detectors) + 2 * interval

    def see(self, walker: Walker, events: Sequence[GaitEvent]) -> list[GaitEvent]:
        """Measure the walker's last stretch; return the events that are detected."""
        found: list[Detection] = []
        for sensor, detector in zip(self._sensors, self.detectors, strict=True):
            times = sensor.due(walker.time_reached)
            for stamp, values in sensor.measure(times, walker.sample(times), events):
                found += detector.add(stamp, values)
        found.sort(key=lambda detection: detection.detected_at)
        numbered = map(self.numbering.add, found)
        return [event for event in numbered if event is not None]

    def troubles(self) -> tuple[str, ...]:
        """Return what a person should know, one line each."""
        lines = [line for detector in self.detectors for line in detector.troubles()]
        return (*lines, *self.numbering.troubles())


def rehearse(protocol: Protocol, sensors: Sensors) -> Rehearsal:
    """
    Conduct a protocol on the simulated walker through emulated sensors.

    Raises the errors of `gait_entrainment.simulate`, and GaitError if torque must not follow the
    detected gait.
    """
    robots = begun_robots(protocol)
    conductor = Conductor(protocol)
    walker = Walker(protocol.walker, protocol.side, None, protocol.variation, protocol.seed)
    ended = False
    truth: list[GaitEvent] = []
    detected: list[GaitEvent] = []
    onsets: list[tuple[Side, int]] = []
    behind = nanoseconds(sensors.latency)
    while not ended:
        horizon = conductor.horizon(walker.time_reached - behind)
        for side, robot in robots.items():
            profile = robot.promise(horizon.until)
            onsets += ((side, onset) for onset in profile.onsets)
            walker.promise(profile)
        transitions = walker.advance(horizon.until)
        events = [GaitEvent(t.stamp, t.kind, t.side, t.step) for t in transitions]
        truth += events
        for event in sensors.see(walker, events):
            detected.append(event)
            conductor.add_event(event)
        while train := conductor.due(walker.time_reached - behind):
            robots[train.side].schedule(train)
        ended = horizon.last or walker.ending is not None
    return Rehearsal(
        truth=tuple(truth),
        events=tuple(detected),
        onsets=tuple(onset for _, onset in onsets),
        train=conductor.block.train,
        analysis=analyze_blocks(conductor.blocks, detected, onsets, protocol.side)[0],
        true_analysis=analyze_blocks(conductor.blocks, truth, onsets, protocol.side)[0],
        ending=walker.ending,
        troubles=sensors.troubles(),
    )
