# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the record of a run lacks: counts, revisions and places of the gait tell."""

from collections import Counter
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.gait import StrideTracker
from gait_entrainment.messages import MessageError, event_of
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.metadata import TopicInfo

_PROFILE = "gait_entrainment_msgs/msg/TorqueProfile"
_EVENT = "gait_entrainment_msgs/msg/GaitEvent"
_COUNTS = "gait_entrainment_msgs/msg/PublishedCounts"


class RunRecord:
    """
    Follows the messages of a bag, in their order; knows nothing of a bag without a run.

    Every node says at the end how many messages it has published; torque profiles count their
    revisions from 0 and say which is the last; gait events are numbered by steps, so that what a
    sensor never saw shows here too.
    """

    def __init__(self) -> None:
        self._recorded: Counter[str] = Counter()  # messages by topic
        self._published: dict[str, int] = {}  # the same, as the nodes say
        self._revisions: dict[tuple[str, int], set[int]] = {}  # by topic and run
        self._ended: set[tuple[str, int]] = set()
        self._gaits: dict[tuple[str, int], StrideTracker] = {}

    def add(self, topic: TopicInfo, data: bytes) -> None:
        """Take a message; one that cannot be decoded says nothing."""
        self._recorded[topic.name] += 1
        if topic.type not in (_PROFILE, _EVENT, _COUNTS):
            return
        try:
            message: Any = decoder_for(topic)(data)
            if topic.type == _COUNTS:
                self._published |= dict(zip(message.topics, message.counts, strict=True))
                return
            run = topic.name, message.run
            if topic.type == _PROFILE:
                self._revisions.setdefault(run, set()).add(message.revision)
                if message.last or message.stop:
                    self._ended.add(run)
            else:
                self._gaits.setdefault(run, StrideTracker(Side.RIGHT)).add(event_of(message))
        except (BagError, MessageError, AttributeError):
            return

    def holes(self) -> list[str]:
        """Return a line for each topic and run of which something is missing."""
        holes = [
            f"{topic}: {count - self._recorded[topic]} of {count} messages"
            for topic, count in self._published.items()
            if 0 < self._recorded[topic] < count
        ]
        for (topic, run), revisions in self._revisions.items():
            if missing := max(revisions) + 1 - len(revisions):
                holes.append(
                    f"{topic}: {missing} of {max(revisions) + 1} torque profiles of run {run}"
                )
            if (topic, run) not in self._ended:
                holes.append(f"{topic}: the end of run {run}")
        for (topic, run), gait in self._gaits.items():
            if gait.counts.missing:
                holes.append(f"{topic}: {gait.counts.missing} gait events of run {run}")
        return holes
