# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Rescuing into a new bag what can be read from a bag that is damaged or was never closed."""

from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_entrainment_bags.errors import UnreadableBagError, noting
from gait_entrainment_bags.holes import RunRecord
from gait_entrainment_bags.mcap_file import McapFile
from gait_entrainment_bags.mcap_records import Contents
from gait_entrainment_bags.metadata import (
    TopicInfo,
    custom_data_of,
    described_beside,
    recorded_description,
)
from gait_entrainment_bags.reader import bag_files, differing_types
from gait_entrainment_bags.writer import BagWriter

RECOVERY_KEY = "recovery"
"""Key in a rescued bag's custom data for a text on its origin and on what is missing."""


@dataclass(frozen=True)
class Recovery:
    """What was rescued, and what was not."""

    folder: Path
    counts: dict[str, int]  # messages rescued, by topic
    last: int  # log time of the latest of them [ns since the epoch]; 0 without messages
    losses: tuple[str, ...]  # a line for each place where something is missing


def recover(path: Path | str, out: Path | str) -> Recovery:
    """
    Write all that can be read from a bag, a folder or an ``.mcap`` file, into a new folder.

    Raises BagExistsError if the folder already exists, UnreadableBagError if none of the files
    is a readable MCAP file, BagWriteError if the new bag cannot be written.
    """
    path = Path(path)
    losses: list[str] = []
    files = []
    with ExitStack() as opened:
        for file_path in bag_files(path):
            with noting(losses.append):
                files.append(opened.enter_context(closing(McapFile(file_path))))
        if not files:
            raise UnreadableBagError(losses[0])
        writer = opened.enter_context(BagWriter(out, ros_distro=""))
        rescue = _Rescue(writer)
        for file in files:
            losses += rescue.take(file)
        losses += rescue.refused.values()
        losses += rescue.record.holes()
        missing = "; ".join(losses) or "nothing is missing"
        description = rescue.description or described_beside(path)
        writer.custom_data |= custom_data_of(description)
        writer.custom_data[RECOVERY_KEY] = f"made of {path.name}; {missing}"
        writer.ros_distro = str(description.get("ros_distro", ""))
    return Recovery(Path(out), dict(writer.counts), rescue.last, tuple(losses))


class _Rescue:
    """Copies messages into the new bag, and remembers the topics that it cannot store."""

    def __init__(self, writer: BagWriter) -> None:
        self.writer = writer
        self.last = 0
        self.description: dict[str, Any] = {}
        self.refused: dict[str, str] = {}  # reason by topic
        self.record = RunRecord()
        self._topics: dict[str, TopicInfo] = {}
        self._announced: object = None

    def take(self, file: McapFile) -> list[str]:
        """Copy the messages of a file; return a line for each loss."""
        losses: list[str] = []
        summary: Contents | None = None
        with noting(losses.append):
            summary = file.read_summary()
        contents = Contents()
        for _, messages in file.walk(contents, summary):
            self._announce(contents)
            for message in messages:
                if message.topic not in self.refused:
                    self.writer.write(
                        message.topic, message.data, message.log_time, message.publish_time
                    )
                    self.last = max(self.last, message.log_time)
                    self.record.add(self._topics[message.topic], message.data)
        self._announce(contents)
        self.description = recorded_description(contents.metadata) or self.description
        losses += contents.damages
        expected = 0 if summary is None else summary.counts.total()
        if (missing := expected - contents.counts.total()) > 0:
            losses.append(f"{file.path}: {missing} of {expected} messages are lost")
        return losses

    def _announce(self, contents: Contents) -> None:
        """Announce the topics found since the last call."""
        present = [*contents.schemas], [*contents.channels]
        if present == self._announced:
            return
        self._announced = present
        self.record.announce(*contents.names.values())
        for topic in contents.topics:
            known = self._topics.setdefault(topic.name, topic)
            if difference := differing_types(known, topic):
                self.refused[topic.name] = f"{topic.name} has {difference}: the rest of it is lost"
            if topic.name in self.writer.counts or topic.name in self.refused:
                continue
            if topic.is_storable:
                self.writer.add_topic(topic)
            else:
                self.refused[topic.name] = (
                    f"{topic.name}: lost: its type {topic.type!r} does not read package/msg/Type"
                )
