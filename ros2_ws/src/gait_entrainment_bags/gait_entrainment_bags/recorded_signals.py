# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The signals of sensors in a bag, whoever recorded it, as detectors take them."""

from operator import attrgetter
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds_of
from gait_entrainment_bags import topic_names
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_sensors.recording import Stream

_RATES = ("angular_velocity.x", "angular_velocity.y", "angular_velocity.z")
# Topics [left, right] that a detector reads, and the field of each of its signals.
SOURCES: dict[str, tuple[tuple[str, str], tuple[str, ...]]] = {
    "vertical_force": (topic_names.GROUND_REACTION, ("wrench.force.z",)),
    "foot_switch": (topic_names.FOOT_SWITCH, ("heel", "toe")),
    "foot_gyroscope": (topic_names.FOOT_IMU, _RATES),
    "shank_gyroscope": (topic_names.SHANK_IMU, _RATES),
    "ankle_encoder": (topic_names.ANKLE_ENCODER, ("position", "effort")),
}


def read_signals(path: Path, detector: str | None = None) -> tuple[str, list[Stream]]:
    """
    Return the detector whose topics a bag has, the first if none is chosen, and what it reads.

    Topics are found in whatever namespace; times are stamps [s since 1970].
    Raises BagError if the bag cannot be read or lacks the topics, or a message has other fields.
    """
    wanted = SOURCES if detector is None else {d: s for d, s in SOURCES.items() if d == detector}
    with BagReader(path) as bag:
        for name, (topics, fields) in wanted.items():
            found = {
                side: full
                for side, topic in zip(Side, topics, strict=True)
                if (full := bag.find_topic(topic, filled=True))
            }
            if found:
                return name, [_stream(bag, side, full, fields) for side, full in found.items()]
    lacking = ", ".join(topic for topics, _ in wanted.values() for topic in topics)
    raise BagError(f"{path}: lacks topics of sensors: {lacking or f'none is for {detector}'}")


def _stream(bag: BagReader, side: Side, topic: str, fields: tuple[str, ...]) -> Stream:
    times, values = [], []
    read: Any = attrgetter(*fields, "header.stamp")
    for _, message in bag.decoded([topic]):
        try:
            *signals, stamp = read(message)
        except AttributeError as error:
            kind = bag.topics[topic].type
            raise BagError(f"{bag.path}: {topic}: a {kind} has no such field: {error}") from None
        times.append(nanoseconds_of(stamp) / NANOSECONDS_PER_SECOND)
        # A joint state has lists; of one joint here.
        values.append(tuple(float(v[0] if isinstance(v, list | tuple) else v) for v in signals))
    return Stream(side, times, values)
