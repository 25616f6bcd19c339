# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A linter for bags: which of rosbag2's rules a bag breaks, and which readers that affects.

The rules come from rosbag2's Jazzy branch, the MCAP specification and registry, and the readers
in use; docs/bags.md lists them.
"""

import enum
import re
from collections import Counter
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath
from typing import Any

from mcap.records import Channel

from gait_entrainment_bags.decoding import CDR_HEADER_SIZE, decoder_for
from gait_entrainment_bags.definitions import is_type_name, missing_definitions
from gait_entrainment_bags.errors import BagError, UnreadableBagError, noting
from gait_entrainment_bags.holes import RunRecord
from gait_entrainment_bags.mcap_file import McapFile
from gait_entrainment_bags.mcap_records import BagMessage, Chunk, Contents
from gait_entrainment_bags.metadata import (
    METADATA_FILE,
    METADATA_VERSION,
    RECORD_NAME,
    BagDescription,
    FileInformation,
    TopicInfo,
    load_yaml,
    missing_keys,
    parse_qos_profiles,
    read_metadata_file,
    recorded_description,
)
from gait_entrainment_bags.reader import bag_files, differing_types

_TYPE_HASH = re.compile("RIHS01_[0-9a-f]{64}")


class Severity(enum.Enum):
    """How much a broken rule matters."""

    ERROR = "error"  # a reader fails, or data is lost or wrong
    WARNING = "warning"  # readers work, with restrictions


_CONSEQUENCES = {
    "mcap": "no reader opens it",
    "closed": "rosbags refuses it, rosbag2 has to scan it; `entrain bag recover` rescues it",
    "intact": "readers stop there or give wrong data; `entrain bag recover` saves the rest",
    "summary": "a reader has to go through the whole file to know what is in it, or falls back to "
    "the order of the file",
    "profile": "rosbags rejects the file",
    "schema": "rosbag2 throws when it opens the file",
    "schema-name": "rosbag2 finds no message package for it and skips the topic",
    "schema-encoding": "viewers and decoders without the message package skip the topic",
    "schema-text": "viewers and decoders without the message package skip the topic",
    "message-encoding": "rosbag2 and rosbags cannot read the topic",
    "offered-qos": "players publish with default QoS, so late or reliable subscribers may get "
    "nothing",
    "qos-version": "rosbag2 throws when it opens the file",
    "type-hash": "readers cannot tell whether an installed definition matches the recorded one",
    "one-type": "readers decode part of the topic with the wrong definition",
    "cdr-header": "the message cannot be deserialized",
    "message": "viewers and decoders fail on the topic",
    "chunk-index": "readers fall back to the order of the file",
    "message-index": "readers fall back to the order of the file, or miss messages",
    "statistics": "numbers and times that readers show or seek by are wrong",
    "rosbag2-record": "custom data and QoS are lost if metadata.yaml is lost",
    "metadata-file": "rosbag2 does not open the folder; `ros2 bag reindex` writes a new one",
    "metadata-key": "rosbag2 throws when it opens the folder",
    "metadata-version": "rosbag2 in Jazzy does not read it",
    "metadata-qos": "rosbag2 throws when it opens the folder",
    "metadata-files": "rosbag2 does not open the bag, or leaves a file out",
    "metadata-topics": "rosbag2 does not play the topic, or shows wrong numbers",
    "metadata-times": "`ros2 bag info` shows wrong times, and start offsets are wrong",
    "record": "an analysis stops at the hole, and starts again after it",
}
_MINOR = {
    "record",
    "summary",
    "offered-qos",
    "type-hash",
    "chunk-index",
    "message-index",
    "rosbag2-record",
}
RULES = {
    rule: (Severity.WARNING if rule in _MINOR else Severity.ERROR, consequence)
    for rule, consequence in _CONSEQUENCES.items()
}
"""Severity and consequence by rule."""


@dataclass(frozen=True)
class Finding:
    """A broken rule: where and how (`detail`), and which readers it affects in what way."""

    rule: str
    severity: Severity
    detail: str
    consequence: str

    def __str__(self) -> str:
        return f"{self.severity.value}: {self.rule}: {self.detail}: {self.consequence}"


class _Report:
    """Collects the places where rules are broken."""

    def __init__(self) -> None:
        self._places: dict[str, list[str]] = {}

    def add(self, rule: str, detail: str) -> None:
        """Note a place where a rule is broken."""
        self._places.setdefault(rule, []).append(detail)

    def adding(self, rule: str) -> AbstractContextManager[None]:
        """Note anything unreadable as a violation of this rule."""
        return noting(partial(self.add, rule))

    def findings(self) -> list[Finding]:
        """Return a finding for each broken rule: the first place, and how many more there are."""
        found = []
        for rule, (severity, consequence) in RULES.items():
            if places := self._places.get(rule):
                more = f" (and {len(places) - 1} more)" if len(places) > 1 else ""
                found.append(Finding(rule, severity, places[0] + more, consequence))
        return found


def check(path: Path | str) -> list[Finding]:
    """
    Check a bag, a folder or an ``.mcap`` file, against rosbag2's rules.

    Never raises for anything wrong with the bag: the findings report it. A rule that is broken
    many times gives one finding, with the first place and the number of places. Bags of this
    project's writer give none.
    """
    path = Path(path)
    report = _Report()
    with report.adding("mcap"):
        contents, record = {}, RunRecord()
        for file in bag_files(path):
            with report.adding("mcap"), closing(McapFile(file)) as opened:
                contents[file.name] = _FileCheck(opened, report, record).run()
        for hole in record.holes():
            report.add("record", f"{path}: lacks {hole}")
        if path.is_dir():
            with report.adding("metadata-file"):
                _check_metadata_file(path, contents, report)
    return report.findings()


class _FileCheck:
    """Checks one MCAP file."""

    def __init__(self, file: McapFile, report: _Report, record: RunRecord) -> None:
        self._file = file
        self._report = report
        self._record = record
        self._found = Contents()
        self._topics: dict[str, TopicInfo] = {}  # as first announced
        self._decoded: set[str] = set()  # topics of which a message was decoded

    def _add(self, rule: str, detail: str) -> None:
        self._report.add(rule, f"{self._file.path}: {detail}")

    def run(self) -> Contents:
        """Check all of the file; return what it really holds."""
        if self._file.header.profile != "ros2":
            self._add("profile", f"profile {self._file.header.profile!r} instead of 'ros2'")
        closed = False
        summary: Contents | None = None
        with self._report.adding("closed"):
            self._file.read_footer()
            closed = True
        if closed:
            with self._report.adding("intact"):
                summary = self._file.read_summary()
                if summary is None:
                    self._add("summary", "no summary of channels, statistics and chunks")
        listed = {chunk.offset: chunk for chunk in summary.chunks} if summary else {}
        for chunk, messages in self._file.walk(self._found, summary):
            for message in messages:
                self._check_message(message)
            if summary is not None:
                self._check_index(chunk, listed.get(chunk.offset), messages)
        if closed:
            for damage in self._found.damages:
                self._report.add("intact", damage)
            with self._report.adding("intact"):
                self._file.check_data()
        self._record.announce(*self._found.names.values())
        self._check_schemas()
        self._check_channels()
        recorded = bool(recorded_description(self._found.metadata))
        if not recorded:
            self._add("rosbag2-record", f"no metadata record {RECORD_NAME!r}")
        if summary is not None:
            self._check_statistics(summary)
            if recorded and not recorded_description(summary.metadata):
                self._add("rosbag2-record", "the summary does not list it")
        return self._found

    def _check_message(self, message: BagMessage) -> None:
        """Check the message's header; decode a topic's first message, as a viewer would."""
        if message.data[:2] not in (b"\0\0", b"\0\1") or len(message.data) < CDR_HEADER_SIZE:
            begin = message.data[:CDR_HEADER_SIZE].hex(" ") or "nothing"
            self._add("cdr-header", f"{message.topic}: begins with {begin}")
            return
        topic = self._topics.get(message.topic)
        if topic is None:
            topic = next(topic for topic in self._found.topics if topic.name == message.topic)
            self._topics[message.topic] = topic
        self._record.add(topic, message.data)
        if message.topic in self._decoded:
            return
        self._decoded.add(message.topic)
        decodable = (topic.message_encoding, topic.schema_encoding) == ("cdr", "ros2msg")
        if not (decodable and is_type_name(topic.type)):
            return  # the rules for schemas and channels report it
        # A type without fields is serialized as one byte, padded to four.
        if not topic.schema_text.strip() and len(message.data) > CDR_HEADER_SIZE + 4:
            self._add("schema-text", f"{topic.type}: is empty")
            return
        try:
            decoder_for(topic)(message.data)
        except UnreadableBagError as error:
            self._add("message", str(error))
        except BagError as error:
            self._add("schema-text", str(error))

    def _check_index(self, chunk: Chunk, listed: Chunk | None, messages: list[BagMessage]) -> None:
        """Compare a chunk and the messages found in it with the chunk listed in the summary."""
        where = f"at byte {chunk.offset}"
        if listed is None:
            self._add("chunk-index", f"{where}: no chunk index lists these messages")
            return
        if (listed.start, listed.end) != (chunk.start, chunk.end):
            self._add("chunk-index", f"{where}: the times of the index are wrong")
        names = self._found.names
        with self._report.adding("message-index"):
            indexed = {
                (names.get(channel), log_time, offset)
                for channel, index in listed.index_offsets.items()
                for log_time, offset in self._file.message_index(index, channel)
            }
            if indexed != {(m.topic, m.log_time, m.offset) for m in messages}:
                self._add("message-index", f"{where}: the index does not list every message")

    def _check_statistics(self, summary: Contents) -> None:
        announced, found = (
            f"{contents.counts.total()} messages from {contents.start} to {contents.end} ns"
            for contents in (summary, self._found)
        )
        if announced != found or +summary.counts != self._found.counts:
            self._add("statistics", f"{announced} announced, {found} found")

    def _check_schemas(self) -> None:
        for schema in self._found.schemas:
            text = schema.data.decode(errors="replace")
            if not is_type_name(schema.name):
                self._add("schema-name", f"{schema.name}: a type reads package/msg/Type")
            elif schema.encoding != "ros2msg":
                self._add("schema-encoding", f"{schema.name}: {schema.encoding!r}, not 'ros2msg'")
            elif missing := ", ".join(missing_definitions(schema.name, text)):
                self._add("schema-text", f"{schema.name}: lacks the definition of {missing}")

    def _check_channels(self) -> None:
        known: dict[str, TopicInfo] = {}
        version = recorded_description(self._found.metadata).get("version", METADATA_VERSION)
        schemas = {schema.id for schema in self._found.schemas}
        for channel, topic in zip(self._found.channels, self._found.topics, strict=True):
            name = channel.topic
            if channel.schema_id not in schemas:
                self._add("schema", f"{name}: schema {channel.schema_id} is not in the file")
            elif difference := differing_types(known.setdefault(name, topic), topic):
                self._add("one-type", f"{name}: has {difference}")
            if channel.message_encoding != "cdr":
                self._add("message-encoding", f"{name}: {channel.message_encoding!r}, not 'cdr'")
            with self._report.adding("offered-qos"):
                self._check_qos(channel, version)
            if not _TYPE_HASH.fullmatch(topic.type_hash):
                self._add("type-hash", f"{name}: no topic_type_hash of RIHS01_ and 64 hex digits")

    def _check_qos(self, channel: Channel, version: Any) -> None:
        """Check the form of the offered QoS, and that its spelling matches the file's version."""
        where = f"{self._file.path}: {channel.topic}: offered_qos_profiles"
        qos = channel.metadata.get("offered_qos_profiles")
        if qos is None:
            raise UnreadableBagError(f"{where}: is missing")
        parse_qos_profiles(qos, where)
        in_words = {
            isinstance(profile[policy], str)
            for profile in load_yaml(qos, where) or []
            for policy in ("reliability", "durability", "liveliness")
        }
        old = isinstance(version, int) and version < METADATA_VERSION
        if old and True in in_words:
            text = f"policies are words, but version {version} of the file has numbers"
            self._report.add("qos-version", f"{where}: {text}")
        elif isinstance(version, int) and not old and False in in_words:
            raise UnreadableBagError(f"{where}: policies are numbers, not words as in version 9")


def _check_metadata_file(folder: Path, contents: dict[str, Contents], report: _Report) -> None:
    """Check ``metadata.yaml`` by the rules of its version and against what the files hold."""
    file = folder / METADATA_FILE
    description = read_metadata_file(folder)
    missing = list(missing_keys(description))
    for key in missing:
        report.add("metadata-key", f"{file}: {key} is missing or has the wrong type")
    version = description.get("version")
    if not isinstance(version, int) or not 1 <= version <= METADATA_VERSION:
        report.add("metadata-version", f"{file}: version {version!r}; known: 1 to 9")
        return
    if missing:
        return
    names = {PurePath(name).name for name in description["relative_file_paths"]}
    for name in sorted(name for name in names if not (folder / name).is_file()):
        report.add("metadata-files", f"{file}: lists {name}, which is not there")
    for stray in sorted({path.name for path in folder.glob("*.mcap")} - names):
        report.add("metadata-files", f"{file}: does not list {stray}")
    for entry in description["topics_with_message_count"]:
        topic = entry["topic_metadata"]
        where = f"{file}: {topic['name']}: offered_qos_profiles"
        kind = "a sequence" if version >= METADATA_VERSION else "text"
        qos = topic.get("offered_qos_profiles", "")
        with report.adding("metadata-qos"):
            if isinstance(qos, str) is not (kind == "text"):
                raise UnreadableBagError(f"{where}: version {version} requires {kind}")
            parse_qos_profiles(qos, where)
    counts: Counter[str] = sum((held.counts for held in contents.values()), Counter())
    topics = {topic.name: topic for held in contents.values() for topic in held.topics}
    files = [
        FileInformation(name, held.start, held.end, held.counts.total())
        for name, held in contents.items()
    ]
    true = BagDescription([(topic, counts[name]) for name, topic in topics.items()], files)
    timed = bool(counts)  # the times of an empty bag mean nothing
    announced, found = _facts(description, timed), _facts(true.as_map(), timed)
    for rule, what in sorted(announced.keys() | found.keys()):
        stated, actual = (facts.get((rule, what), "nothing") for facts in (announced, found))
        if stated != actual:
            report.add(rule, f"{file}: {what}: {stated} announced, {actual} in the files")


def _facts(description: dict[str, Any], timed: bool) -> dict[tuple[str, str], object]:
    """Return what a description says about topics, counts and times, by rule and topic or key."""
    facts: dict[tuple[str, str], object] = {}
    for entry in description["topics_with_message_count"]:
        topic = entry["topic_metadata"]
        facts["metadata-topics", topic["name"]] = f"{entry['message_count']} of {topic['type']}"
    facts["metadata-topics", "message_count"] = description["message_count"]
    if timed:
        start, duration = description["starting_time"], description["duration"]
        facts["metadata-times", "starting_time"] = start["nanoseconds_since_epoch"]
        facts["metadata-times", "duration"] = duration["nanoseconds"]
    return facts
