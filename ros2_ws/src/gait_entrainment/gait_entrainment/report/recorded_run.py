# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A run as its bag tells it, without ROS: what happened, and the analysis made anew from it."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.analysis import Analysis, VerdictSettings, analyze
from gait_entrainment.bags import BagError, BagReader
from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.events import GaitEvent
from gait_entrainment.experiment import Conductor
from gait_entrainment.protocol import Protocol, read_protocol


@dataclass(frozen=True)
class AnkleTorques:
    """Sampled ankle torque of the perturbed leg, plantarflexion positive."""

    stamps: NDArray[np.int64]  # [ns], shape (n,)
    intrinsic: NDArray[np.float64]  # of the leg's own spring [N m], shape (n,)
    delivered: NDArray[np.float64]  # by the robot, whatever the phase [N m], shape (n,)
    effective: NDArray[np.float64]  # the part of it that acts on the walker [N m], shape (n,)


@dataclass(frozen=True)
class RecordedRun:
    """What a bag holds of one run; stamps are nanoseconds since 1970, as recorded."""

    protocol: Protocol
    events: tuple[GaitEvent, ...]
    onsets: tuple[int, ...]  # of the pulses [ns]
    measured_period: float  # mean stride period over the baseline [s]; NaN without a plan
    pulse_period: float  # as planned from it [s]; NaN without a plan
    analysis: Analysis
    torques: AnkleTorques
    messages: int  # in the bag, on all topics
    lost: int | None  # published but not recorded; None where no publisher gave a count
    real_time_factor: float  # walked time over wall time, first to last /clock; NaN without


def read_run(path: Path | str, settings: VerdictSettings | None = None) -> RecordedRun:
    """
    Read a bag of this project and analyze it anew.

    Raises
    ------
    BagError
        where it is no bag, is damaged, or lacks the protocol or the topics that are needed.

    """
    with BagReader(path) as bag:
        try:
            protocol = read_protocol(bag.custom_data["protocol"])
        except KeyError:
            raise BagError(f"{path}: holds no protocol: not a run of this project") from None
        names = {
            suffix: next((topic for topic in bag.topics if topic.endswith(suffix)), None)
            for suffix in ("/gait_events", "/perturbation/torque_profile", "/ankle_torque")
        }
        missing = [suffix for suffix, name in names.items() if name is None]
        if missing:
            raise BagError(f"{path}: lacks the topics {', '.join(missing)}")
        events, onsets, samples = [], [], []
        for raw, message in bag.decoded([name for name in names.values() if name is not None]):
            if raw.topic == names["/gait_events"]:
                events.append(
                    GaitEvent(
                        _nanoseconds(message.header.stamp),
                        EventKind(message.kind),
                        Side(message.side),
                        message.step,
                    )
                )
            elif raw.topic == names["/ankle_torque"]:
                side = protocol.side
                samples.append(
                    (
                        _nanoseconds(message.header.stamp),
                        message.intrinsic[side],
                        message.delivered[side],
                        message.effective_perturbation[side],
                    )
                )
            elif not message.stop:
                onsets += [_nanoseconds(onset) for onset in message.onsets]
        conductor = Conductor(protocol)
        for event in events:
            conductor.add_event(event)
        lost = json.loads(bag.custom_data.get("messages_lost", "null"))
        return RecordedRun(
            protocol=protocol,
            events=tuple(events),
            onsets=tuple(onsets),
            measured_period=conductor.measured_period,
            pulse_period=conductor.train.period if conductor.train else math.nan,
            analysis=analyze(events, onsets, protocol.side, settings),
            torques=AnkleTorques(
                np.array([s[0] for s in samples], np.int64),
                *(np.array([s[i] for s in samples], float) for i in (1, 2, 3)),
            ),
            messages=bag.message_count,
            lost=None if lost is None else sum(lost.values()),
            real_time_factor=_real_time_factor(bag),
        )


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)


def _real_time_factor(bag: BagReader) -> float:
    """Return simulated over wall time from the first to the last /clock; NaN without two."""
    if bag.counts.get("/clock", 0) < 2:
        return math.nan
    clocks = list(bag.messages(["/clock"]))
    wall = clocks[-1].publish_time - clocks[0].publish_time
    return (clocks[-1].log_time - clocks[0].log_time) / wall
