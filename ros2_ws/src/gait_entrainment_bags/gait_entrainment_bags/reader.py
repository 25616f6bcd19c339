# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Reading a bag: its contents through its index, and its messages in the order of log time."""

import math
from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path, PurePath
from typing import Any

from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.definitions import definition_lines
from gait_entrainment_bags.errors import BagError, NoBagError, UnreadableBagError
from gait_entrainment_bags.mcap_file import McapFile
from gait_entrainment_bags.mcap_records import BagMessage, Chunk, Contents
from gait_entrainment_bags.metadata import (
    TopicInfo,
    custom_data_of,
    described_beside,
    recorded_description,
)


class BagReader(AbstractContextManager["BagReader"]):
    """
    A bag opened for reading: a folder, or a single ``.mcap`` file.

    ``counts`` are message counts by topic, ``start`` and ``end`` the first and the last log time
    [ns since the epoch; 0 without messages], ``size`` is the size of all its files in bytes.
    Raises UnreadableBagError if it is not a bag, is damaged, or was never closed; NoBagError if
    the path does not exist.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.topics: dict[str, TopicInfo] = {}
        self.counts: dict[str, int] = {}
        self.start = self.end = self.size = 0
        self.custom_data: dict[str, str] = {}
        self.ros_distro = ""
        self._files: list[tuple[McapFile, Contents]] = []
        try:
            for file_path in bag_files(self.path):
                self._add_file(McapFile(file_path))
        except UnreadableBagError:
            self.close()
            raise

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        for file, _ in self._files:
            file.close()

    @property
    def duration(self) -> int:
        """Nanoseconds from the first log time to the last."""
        return self.end - self.start

    @property
    def files(self) -> list[Path]:
        """Files of the bag."""
        return [file.path for file, _ in self._files]

    @property
    def message_count(self) -> int:
        """Messages in the bag."""
        return sum(self.counts.values())

    def _add_file(self, file: McapFile) -> None:
        self._files.append((file, Contents()))
        contents = file.read_summary()
        if contents is None:
            contents = file.scan()
            if contents.damages:
                raise UnreadableBagError(contents.damages[0])
        self._files[-1] = (file, contents)
        if contents.counts.total():
            self.start = min(self.start, contents.start) if self.message_count else contents.start
            self.end = max(self.end, contents.end)
        self.size += file.size
        for topic in contents.topics:
            known = self.topics.setdefault(topic.name, topic)
            if difference := differing_types(known, topic):
                raise UnreadableBagError(f"{file.path}: {topic.name} has {difference}")
            self.counts.setdefault(topic.name, 0)
        for name, count in contents.counts.items():
            self.counts[name] += count
        description = recorded_description(contents.metadata)
        _require_plain_messages(file.path, description)
        self.custom_data = custom_data_of(description) or self.custom_data
        self.ros_distro = str(description.get("ros_distro", self.ros_distro))

    def messages(
        self, topics: Collection[str] | None = None, start: int = 0, end: float = math.inf
    ) -> Iterator[BagMessage]:
        """
        Yield messages in the order of log time; with equal log times, in the order of the file.

        They are the messages of the named topics (None: all) with log times from ``start`` up to,
        but not including, ``end`` [ns since the epoch]. Only chunks whose time spans overlap are
        in memory together. Raises BagError if a topic is not in the bag, UnreadableBagError if
        the data is damaged or does not match the index.
        """
        wanted = set(self.topics if topics is None else self.require_topics(topics))
        given = 0
        pending: list[BagMessage] = []  # sorted
        plan = self._plan(wanted, start, end)
        for number, (rank, file, chunk, names) in enumerate(plan):
            found = file.messages(chunk, rank, names, start, end)
            if any(message.log_time < chunk.start for message in found):
                raise file.damage(chunk.offset, "the chunk does not match its index")
            given += len(found)
            pending += found
            pending.sort()
            following = plan[number + 1][2].start if number + 1 < len(plan) else math.inf
            settled = bisect_left(pending, (following,))
            for message in pending[:settled]:
                if start <= message.log_time < end:
                    yield message
            del pending[:settled]
        expected = sum(self.counts[name] for name in wanted)
        if start <= self.start and end > self.end and given != expected:
            raise UnreadableBagError(
                f"{self.path}: {given} messages found, but {expected} expected from its index"
            )

    def require_topics(self, topics: Collection[str]) -> Collection[str]:
        """Return topics if all of them are in the bag; otherwise raise BagError."""
        if missing := sorted(set(topics) - self.topics.keys()):
            raise BagError(f"{self.path}: no topic {', '.join(missing)} in the bag")
        return topics

    def find_topic(
        self, relative: str, type_name: str = "", *, filled: bool = False
    ) -> str | None:
        """
        Return the topic with this relative name in any namespace; None if there is none.

        Returns the shortest match, since a bag may hold both /gait_events and /truth/gait_events.
        It must be of the given type, if any, and have messages if ``filled``.
        """
        names = [
            name
            for name, topic in self.topics.items()
            if f"/{name}".endswith(f"/{relative}")
            and type_name in ("", topic.type)
            and (self.counts[name] or not filled)
        ]
        return min(names, key=len, default=None)

    def messages_of(self, relative: str, type_name: str = "") -> Iterator[Any]:
        """Yield the decoded messages of the topic that `find_topic` finds, if there is one."""
        name = self.find_topic(relative, type_name)
        for _, message in self.decoded([name] if name else []):
            yield message

    def _plan(
        self, wanted: set[str], start: int, end: float
    ) -> list[tuple[int, McapFile, Chunk, dict[int, str]]]:
        """List the chunks to read, in the order of time, each with its rank in the bag."""
        plan = []
        rank = 0
        for file, contents in self._files:
            names = {channel: name for channel, name in contents.names.items() if name in wanted}
            for chunk in sorted(contents.chunks, key=lambda chunk: chunk.offset):
                rank += 1
                holds = not chunk.index_offsets or not names.keys().isdisjoint(chunk.index_offsets)
                if names and holds and chunk.start < end and chunk.end >= start:
                    plan.append((rank, file, chunk, names))
        plan.sort(key=lambda entry: (entry[2].start, entry[0]))
        return plan

    def decoded(
        self, topics: Collection[str] | None = None, start: int = 0, end: float = math.inf
    ) -> Iterator[tuple[BagMessage, Any]]:
        """Yield messages as `messages` does, decoded; BagError also if a definition is broken."""
        names = self.topics if topics is None else self.require_topics(topics)
        decoders = {name: decoder_for(self.topics[name]) for name in names}
        for message in self.messages(topics, start, end):
            yield message, decoders[message.topic](message.data)


def differing_types(one: TopicInfo, other: TopicInfo) -> str:
    """Describe how the types of two channels of a topic differ; "" if they do not."""
    if one.type != other.type:
        return f"two types, {one.type} and {other.type}"
    if definition_lines(one.schema_text) != definition_lines(other.schema_text):
        return f"two definitions of {one.type}"
    return ""


def require_bag(path: Path) -> None:
    """Raise NoBagError if there is nothing at a path."""
    if not path.exists():
        raise NoBagError(f"{path}: no such file or folder")


def bag_files(path: Path) -> list[Path]:
    """
    List the files of a bag as in ``metadata.yaml``, or without one all MCAP files in order.

    Raises UnreadableBagError if there is no bag, or it is not stored as MCAP.
    """
    require_bag(path)
    if not path.is_dir():
        return [path]
    description = described_beside(path)
    sqlite = any(path.glob("*.db3")) and not any(path.glob("*.mcap"))
    storage = description.get("storage_identifier", "sqlite3" if sqlite else "mcap")
    if storage != "mcap":
        raise _convertible(path, f"stored as {storage}, not as MCAP")
    _require_plain_messages(path, description)
    listed = description.get("relative_file_paths")
    if isinstance(listed, list) and listed:
        # Only the names count: files outside of its folder are not part of a bag.
        files = [path / name for name in dict.fromkeys(PurePath(str(n)).name for n in listed)]
        if compressed := [file.name for file in files if file.suffix == ".zstd"]:
            raise UnreadableBagError(
                f"{path}: {compressed[0]} is compressed as a whole; decompress it first"
            )
        return files
    files = sorted(path.glob("*.mcap"), key=_file_order)
    if not files:
        bags = sorted({file.parent.name for file in path.glob("*/*.mcap")})
        within = f", but it contains bags: {', '.join(bags[:5])}" if bags else ""
        raise UnreadableBagError(f"{path}: no MCAP file in this folder{within}")
    return files


def _require_plain_messages(path: Path, description: Mapping[str, Any]) -> None:
    """Raise UnreadableBagError if rosbag2 has compressed each message separately."""
    if str(description.get("compression_mode", "")).upper() == "MESSAGE":
        raise _convertible(path, "compressed message by message, which is not supported")


def _convertible(path: Path, what: str) -> UnreadableBagError:
    """Return the error that explains why a bag cannot be read, and how to convert it."""
    return UnreadableBagError(
        f"{path}: {what}; convert it with `ros2 bag convert -i {path} -o FILE`, where FILE holds "
        "{output_bags: [{uri: NEW, storage_id: mcap, all_topics: true}]}"
    )


def _file_order(path: Path) -> tuple[int, str]:
    number = path.stem.rpartition("_")[2]
    return (int(number) if number.isdecimal() else -1, path.name)
