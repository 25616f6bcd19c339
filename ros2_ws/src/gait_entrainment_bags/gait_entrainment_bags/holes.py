# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Holes in the record of a run, found by counts, revisions and step numbers."""

from collections import Counter
from typing import Any

from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.metadata import TopicInfo

_COUNTS = "gait_entrainment_msgs/msg/PublishedCounts"
_PROFILE = "gait_entrainment_msgs/msg/TorqueProfile"
_EVENT = "gait_entrainment_msgs/msg/GaitEvent"
_NAMES = {_PROFILE: "torque profiles", _EVENT: "gait events"}


class RunRecord:
    """
    Follows the messages of a bag; a bag without a run has no holes.

    Every node reports at the end how many messages it has published. Torque profiles count their
    revisions from 0 and mark the last one. Gait events are numbered by steps, so events that a
    sensor missed are also found here.
    """

    def __init__(self) -> None:
        self._recorded: Counter[str] = Counter()  # messages by topic, for all announced topics
        self._published: dict[str, int] = {}  # the same, as reported by the nodes
        # Numbers from 0, by topic, run, and (for a profile) ankle.
        self._numbers: dict[tuple[TopicInfo, int, int], set[int]] = {}
        self._ended: set[tuple[TopicInfo, int, int]] = set()
        # Of profiles: the latest revision, and how many come after a later one.
        self._latest: dict[tuple[TopicInfo, int, int], int] = {}
        self._misplaced: Counter[tuple[TopicInfo, int, int]] = Counter()

    def announce(self, *topics: str) -> None:
        """Add the names of topics that are in the bag, with or without messages."""
        self._recorded.update(dict.fromkeys(topics, 0))

    def add(self, topic: TopicInfo, data: bytes) -> None:
        """Add a message; it is ignored if it cannot be decoded."""
        self._recorded[topic.name] += 1
        if topic.type not in (_COUNTS, *_NAMES):
            return
        try:
            message: Any = decoder_for(topic)(data)
            if topic.type == _COUNTS:
                self._published |= dict(zip(message.topics, message.counts, strict=False))
                return
            place = topic, message.run, message.side if topic.type == _PROFILE else 0
            numbers = self._numbers.setdefault(place, set())
            if topic.type == _EVENT:  # heel strike n ends step n, toe-off n begins its swing
                numbers.add(max(2 * message.step - message.kind, 0))  # strike 0 is the first
                return
            numbers.add(message.revision)
            self._misplaced[place] += message.revision < self._latest.get(place, 0)
            self._latest[place] = message.revision
            if message.last or message.stop:
                self._ended.add(place)
        except (BagError, AttributeError):
            return

    def holes(self) -> list[str]:
        """Return a line for each topic, or topic and run, that has holes."""
        holes = [
            f"{topic}: {count - self._recorded[topic]} of {count} messages"
            for topic, count in self._published.items()
            if topic in self._recorded and self._recorded[topic] < count
        ]
        for place, numbers in self._numbers.items():
            topic, run, _ = place
            if missing := max(numbers) + 1 - len(numbers):
                holes.append(f"{topic.name}: {missing} {_NAMES[topic.type]} of run {run}")
            if topic.type == _PROFILE and place not in self._ended:
                holes.append(f"{topic.name}: the end of run {run}")
            if misplaced := self._misplaced[place]:
                holes.append(
                    f"{topic.name}: the order of {misplaced} torque profiles of run {run}"
                )
        return holes
