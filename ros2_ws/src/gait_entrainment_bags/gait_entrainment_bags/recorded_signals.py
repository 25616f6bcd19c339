# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Sensor signals in a bag from any recorder, in the form that detectors take."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds_of
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_sensors.detection import ChosenDetector
from gait_entrainment_sensors.recording import Stream
from gait_entrainment_sensors.sources import Source, source_of


def read_signals(
    path: Path, detectors: Iterable[ChosenDetector]
) -> tuple[ChosenDetector, list[Stream]]:
    """
    Return the first detector whose topics a bag has, and each foot's signals for it.

    Topics are found in any namespace; times are stamps [s since 1970].
    Raises BagError if the bag cannot be read or lacks the topics, or a message lacks a field.
    """
    lacking: list[str] = []
    with BagReader(path) as bag:
        for chosen in detectors:
            signals = chosen.detector.signals
            source = source_of(chosen.name, signals)
            found = {
                side: full
                for side, topic in zip(Side, source.topics, strict=True)
                if (full := bag.find_topic(topic, filled=True))
            }
            if found:
                return chosen, [
                    _stream(bag, s, full, source, signals) for s, full in found.items()
                ]
            lacking += source.topics
    raise BagError(f"{path}: lacks sensor topics: {', '.join(lacking)}")


def _stream(
    bag: BagReader, side: Side, topic: str, source: Source, signals: Sequence[str]
) -> Stream:
    times, values = [], []
    read = source.reader(signals)
    for _, message in bag.decoded([topic]):
        try:
            values.append(read(message))
            times.append(nanoseconds_of(message.header.stamp) / NANOSECONDS_PER_SECOND)
        except (AttributeError, IndexError) as error:
            kind = bag.topics[topic].type
            raise BagError(f"{bag.path}: {topic}: a {kind} has no such field: {error}") from None
    return Stream(side, times, values)
