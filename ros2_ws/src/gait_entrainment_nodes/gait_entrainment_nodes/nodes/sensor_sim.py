# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
sensor_sim: the simulated walker as sensors see it, for the rehearsal of an experiment on a person.

The walker is that of walker_sim, without its step numbers: the node publishes what emulated
sensors on both feet measure as a person's sensors would, one device buffer at a time. The exact
events go to `truth/gait_events`. The walk starts when the first torque profile of a run arrives,
as a person starts when asked to.
"""

from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.gait import GaitEvent
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.sensors import SensorWriter
from gait_entrainment_nodes.nodes.walker_run import Stretch, WalkerRun
from gait_entrainment_nodes.nodes.walker_sim import WalkerSim
from gait_entrainment_nodes.nodes.walker_sim_run import Run
from gait_entrainment_sensors.emulated import KINDS, EmulatedSensor, find_sensor
from gait_entrainment_sensors.sources import source_of


@dataclass(frozen=True)
class SensorSettings:
    """Which sensors the walker wears."""

    sensor: str = setting(
        "treadmill_force",
        "emulated sensor on both feet, KIND or KIND:OPTION=VALUE,...; kinds: " + ", ".join(KINDS),
    )
    buffer: float = setting(
        0.002, "real time: how long the device holds back samples", "s", (5e-4, 0.1)
    )


@dataclass(frozen=True)
class Measured(Stretch):
    """A stretch, and what the sensors measured in it: (stamp [ns], values), by sensor."""

    measured: list[list[tuple[int, tuple[float, ...]]]]


class SensedWalk(WalkerRun):
    """A walk with sensors on both feet."""

    def __init__(
        self, *of_walk: Any, both_ankles: bool, sensors: list[EmulatedSensor], buffer: float
    ) -> None:
        super().__init__(*of_walk, both_ankles=both_ankles)
        self._sensors, self._buffer = sensors, nanoseconds(buffer)
        self.readings = 0  # of all sensors together, so far

    @property
    def next_sample(self) -> int:
        """When the next sample of the walker is due or the device sends its buffer [ns]."""
        return min(super().next_sample, (self.reached // self._buffer + 1) * self._buffer)

    def advance(self, until: int, last: bool = False) -> Measured:
        """See `WalkerRun`; the stretch also holds what the sensors measured."""
        stretch = super().advance(until, last)
        events = [GaitEvent(t.stamp, t.kind, t.side, t.step) for t in stretch.transitions]
        measured = []
        for sensor in self._sensors:
            times = sensor.due(self.reached)
            found = sensor.measure(times, self._walker.sample(times), events)
            measured.append([(nanoseconds(stamp), values) for stamp, values in found])
        self.readings += sum(map(len, measured))
        return Measured(stretch.transitions, stretch.sample_times, stretch.samples, measured)


class SensorSim(WalkerSim):
    """ROS side of the sensed walker."""

    sensors: SensorSettings
    events_topic, progress_topic = topics.TRUE_EVENTS, topics.TRUE_PROGRESS

    def __init__(self) -> None:
        super().__init__("sensor_sim", sensors=SensorSettings)
        self._kind, self._quality = find_sensor(self.sensors.sensor)
        signals = KINDS[self._kind][0]
        source = source_of(self._kind, signals)
        self._writers = [SensorWriter(source, side, signals) for side in Side]
        self._sampled += [self.offer(topic) for topic in topics.sensor_topics(source)]

    def offer_start(self) -> None:
        """Offer nothing: the request to start goes to gait_detector."""

    def new_walk(self, kind: type[WalkerRun] = SensedWalk, **more: Any) -> WalkerRun:
        """Return a walk with sensors."""
        seed = self.settings.seed
        sensors = [EmulatedSensor(self._kind, side, self._quality, seed) for side in Side]
        return super().new_walk(kind, sensors=sensors, buffer=self.sensors.buffer, **more)

    def run_of(self, message: Any) -> Run | None:
        """Return the run of a message; the first torque profile of a run starts it."""
        begins = isinstance(message, msg.TorqueProfile) and not (message.revision or message.stop)
        if begins and self.run is None and (self._walked is None or self.settings.real_time):
            self.run = self.new_run(message.run, nanoseconds_of(message.header.stamp))
        return super().run_of(message)  # type: ignore[no-any-return]

    def serialized(self, run: Run, stretch: Stretch) -> list[list[bytes]]:
        """Return the messages of the walker, followed by those of the sensors."""
        assert isinstance(stretch, Measured)
        walkers = len(self._sampled) - len(self._writers)
        messages = super().serialized(run, stretch) or [[] for _ in range(walkers)]
        for writer, measured in zip(self._writers, stretch.measured, strict=True):
            messages.append(writer.write([(run.start + t, values) for t, values in measured]))
        return messages

    def send_progress(self, run: Run, progress: msg.Progress) -> None:
        """Publish progress; ``samples`` counts the sensors' messages on all topics together."""
        assert isinstance(run.walker, SensedWalk)
        progress.samples = run.walker.readings
        super().send_progress(run, progress)


main = SensorSim.main
