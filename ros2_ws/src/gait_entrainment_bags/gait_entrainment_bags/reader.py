# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Reading a bag: what is in it through its index, and its messages in the order of log time."""

import contextlib
import math
from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from mcap.records import Channel, Schema

from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.definitions import definition_lines
from gait_entrainment_bags.errors import BagError, UnreadableBagError
from gait_entrainment_bags.mcap_file import BagMessage, Chunk, Contents, McapFile
from gait_entrainment_bags.metadata import (
    METADATA_FILE,
    RECORD_KEY,
    RECORD_NAME,
    ROOT_KEY,
    QosProfile,
    TopicInfo,
    load_yaml,
    parse_qos_profiles,
)


class BagReader:
    """
    A bag opened for reading: a folder, or a single ``.mcap`` file.

    Raises
    ------
    UnreadableBagError
        It is not a bag, or damaged, or was never closed.

    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.topics: dict[str, TopicInfo] = {}
        self.counts: dict[str, int] = {}
        """Messages in the bag, by topic."""
        self.start = 0
        """First log time [ns since the epoch]; 0 without messages."""
        self.end = 0
        """Last log time [ns since the epoch]."""
        self.custom_data: dict[str, str] = {}
        self.ros_distro = ""
        self.size = 0
        """Bytes of all files."""

        self._files: list[tuple[McapFile, Contents]] = []
        try:
            for file_path in bag_files(self.path):
                self._add_file(file_path)
        except UnreadableBagError:
            self.close()
            raise

    def __enter__(self) -> "BagReader":
        return self

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
    def message_count(self) -> int:
        """Messages in the bag."""
        return sum(self.counts.values())

    def _add_file(self, path: Path) -> None:
        file = McapFile(path)
        contents = Contents()
        self._files.append((file, contents))
        summary = file.read_summary()
        if summary is None:
            summary = file.scan()
            if summary.damages:
                raise UnreadableBagError(summary.damages[0].text)
        self._files[-1] = (file, summary)
        if summary.message_count:
            self.start = min(self.start, summary.start) if self.message_count else summary.start
            self.end = max(self.end, summary.end)
        self.size += file.size
        for channel in summary.channels.values():
            topic = topic_of(channel, summary.schemas)
            known = self.topics.setdefault(topic.name, topic)
            if difference := differing_types(known, topic):
                raise UnreadableBagError(f"{path}: {topic.name} has {difference}")
            self.counts.setdefault(topic.name, 0)
        for name, count in summary.counts.items():
            self.counts[name] += count
        description = recorded_description(summary)
        if isinstance(custom_data := description.get("custom_data"), dict):
            self.custom_data = {str(key): str(value) for key, value in custom_data.items()}
        self.ros_distro = str(description.get("ros_distro", self.ros_distro))

    def messages(
        self,
        topics: Collection[str] | None = None,
        start: int = 0,
        end: float = math.inf,
    ) -> Iterator[BagMessage]:
        """
        Give messages in the order of log time; those of one instant in the order of the file.

        Held in memory at once are the chunks whose spans of time overlap.

        Parameters
        ----------
        topics
            Names of topics, or None for all of them.
        start, end
            First log time to give, and the log time to stop before [ns since the epoch].

        Raises
        ------
        BagError
            A topic is not in the bag.
        UnreadableBagError
            What is read turns out to be damaged, or does not add up.

        """
        wanted = set(self.topics if topics is None else topics)
        if missing := wanted - self.topics.keys():
            raise BagError(f"{self.path}: no topic {', '.join(sorted(missing))} in the bag")
        given = 0
        pending: list[BagMessage] = []  # sorted
        plan = self._plan(wanted, start, end)
        for number, (rank, file, chunk, names) in enumerate(plan):
            found = file.messages(chunk, rank, names)
            if any(message.log_time < chunk.start for message in found):
                raise file.damage(chunk.offset, "the chunk does not match its index")
            given += len(found)
            pending += found
            pending.sort()
            if number + 1 < len(plan):
                settled = bisect_left(pending, (plan[number + 1][2].start,))
            else:
                settled = len(pending)
            for message in pending[:settled]:
                if start <= message.log_time < end:
                    yield message
            del pending[:settled]
        expected = sum(self.counts[name] for name in wanted)
        if start <= self.start and end > self.end and given != expected:
            raise UnreadableBagError(
                f"{self.path}: {given} messages found, but {expected} expected by its index"
            )

    def _plan(
        self, wanted: set[str], start: int, end: float
    ) -> list[tuple[int, McapFile, Chunk, dict[int, str]]]:
        """List the chunks to read, in the order of time, each with its rank in the bag."""
        plan = []
        rank = 0
        for file, contents in self._files:
            names = {channel: name for channel, name in contents.topics.items() if name in wanted}
            for chunk in sorted(contents.chunks, key=lambda chunk: chunk.offset):
                rank += 1
                holds = not chunk.index_offsets or not names.keys().isdisjoint(chunk.index_offsets)
                if names and holds and chunk.start < end and chunk.end >= start:
                    plan.append((rank, file, chunk, names))
        plan.sort(key=lambda entry: (entry[2].start, entry[0]))
        return plan

    def decoder(self, topic: str) -> Callable[[bytes], Any]:
        """Give the decoder of a topic's messages, as `decoding.decoder_for` makes it."""
        return decoder_for(self.topics[topic])

    def decoded(
        self,
        topics: Collection[str] | None = None,
        start: int = 0,
        end: float = math.inf,
    ) -> Iterator[tuple[BagMessage, Any]]:
        """
        Give messages as `messages` does, each with its decoded form.

        Raises
        ------
        BagError
            As `messages`; or the definition of a topic cannot be used.

        """
        decoders = {
            name: self.decoder(name) for name in self.topics if topics is None or name in topics
        }
        for message in self.messages(topics, start, end):
            yield message, decoders[message.topic](message.data)


@dataclass(frozen=True)
class BagInfo:
    """What is in a bag; times in nanoseconds."""

    path: str
    files: tuple[str, ...]
    size: int
    start: int
    duration: int
    message_count: int
    topics: tuple[tuple[str, str, int], ...]  # name, type, messages
    custom_data: dict[str, str]
    ros_distro: str


def info(path: Path | str) -> BagInfo:
    """
    Say what is in a bag, from its index alone.

    Raises
    ------
    UnreadableBagError
        It is not a bag, or damaged, or was never closed.

    """
    with BagReader(path) as reader:
        return BagInfo(
            path=str(reader.path),
            files=tuple(str(file.path) for file, _ in reader._files),
            size=reader.size,
            start=reader.start,
            duration=reader.duration,
            message_count=reader.message_count,
            topics=tuple(
                (name, topic.type, reader.counts[name])
                for name, topic in sorted(reader.topics.items())
            ),
            custom_data=reader.custom_data,
            ros_distro=reader.ros_distro,
        )


def topic_of(channel: Channel, schemas: dict[int, Schema]) -> TopicInfo:
    """Describe the topic of a channel; what is damaged in its description is left out."""
    schema = schemas.get(channel.schema_id)
    qos: tuple[QosProfile, ...] = ()
    with contextlib.suppress(UnreadableBagError):  # the messages can be read all the same
        qos = parse_qos_profiles(channel.metadata.get("offered_qos_profiles", ""), channel.topic)
    return TopicInfo(
        name=channel.topic,
        type=schema.name if schema else "",
        schema_text=schema.data.decode(errors="replace") if schema else "",
        type_hash=channel.metadata.get("topic_type_hash", ""),
        qos_profiles=qos,
    )


def differing_types(one: TopicInfo, other: TopicInfo) -> str:
    """Say how the types of two channels of a topic differ; an empty text where they do not."""
    if one.type != other.type:
        return f"two types, {one.type} and {other.type}"
    if definition_lines(one.schema_text) != definition_lines(other.schema_text):
        return f"two definitions of {one.type}"
    return ""


def recorded_description(contents: Contents) -> dict[str, Any]:
    """Give rosbag2's description from the last metadata record of that name, {} without one."""
    for record in reversed(contents.metadata):
        if record.name == RECORD_NAME:
            try:
                found = load_yaml(record.metadata.get(RECORD_KEY, ""), RECORD_NAME)
            except UnreadableBagError:
                continue
            if isinstance(found, dict):
                return found
    return {}


def read_metadata_file(folder: Path) -> dict[str, Any]:
    """
    Read ``metadata.yaml``, without its root key.

    Raises
    ------
    UnreadableBagError
        It is missing, or not what rosbag2 writes.

    """
    path = folder / METADATA_FILE
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UnreadableBagError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise UnreadableBagError(f"{path}: cannot be read: {error}") from None
    content = load_yaml(text, str(path))
    description = content.get(ROOT_KEY) if isinstance(content, dict) else None
    if not isinstance(description, dict):
        raise UnreadableBagError(f"{path}: no {ROOT_KEY} in it")
    return description


def bag_files(path: Path) -> list[Path]:
    """
    List the files of a bag: as ``metadata.yaml`` does, or without one all MCAP files in order.

    Raises
    ------
    UnreadableBagError
        There is no bag, or it is stored in another way than MCAP.

    """
    if not path.is_dir():
        return [path]
    try:
        description = read_metadata_file(path)
    except UnreadableBagError:
        description = {}
    storage = description.get("storage_identifier", "mcap")
    if storage != "mcap":
        raise UnreadableBagError(
            f"{path}: stored as {storage}, not as MCAP; `ros2 bag convert` makes it one"
        )
    listed = description.get("relative_file_paths")
    if isinstance(listed, list) and listed:
        # Only the names count: what lies outside of its folder is no part of a bag.
        files = [path / PurePath(str(name)).name for name in listed]
        if compressed := [file.name for file in files if file.suffix == ".zstd"]:
            raise UnreadableBagError(
                f"{path}: {compressed[0]} is compressed as a whole; decompress it first"
            )
        return files
    files = sorted(path.glob("*.mcap"), key=_file_order)
    if not files:
        raise UnreadableBagError(f"{path}: no MCAP file in this folder")
    return files


def _file_order(path: Path) -> tuple[int, str]:
    number = path.stem.rpartition("_")[2]
    return (int(number) if number.isdecimal() else -1, path.name)
