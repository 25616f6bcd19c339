# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A linter for bags: which of rosbag2's rules a bag breaks, and who stumbles over that.

The rules are those of rosbag2's Jazzy branch, of the MCAP specification and registry, and of the
readers that are in use; docs/bags.md lists them.
"""

import enum
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from mcap.opcode import Opcode
from mcap.records import DataEnd

from gait_entrainment_bags.decoding import CDR_HEADER_SIZE, decoder_for
from gait_entrainment_bags.definitions import is_type_name, missing_definitions
from gait_entrainment_bags.errors import BagError, UnreadableBagError
from gait_entrainment_bags.mcap_file import BagMessage, Chunk, Contents, McapFile
from gait_entrainment_bags.metadata import (
    METADATA_FILE,
    METADATA_VERSION,
    RECORD_NAME,
    TopicInfo,
    load_yaml,
    parse_qos_profiles,
)
from gait_entrainment_bags.reader import (
    bag_files,
    differing_types,
    read_metadata_file,
    recorded_description,
    topic_of,
)


class Severity(enum.Enum):
    """How much a broken rule matters."""

    ERROR = "error"  # a reader fails, or data is lost or wrong
    WARNING = "warning"  # readers manage, with less


@dataclass(frozen=True)
class Finding:
    """A broken rule: where and how (`detail`), and which reader fails in what way."""

    rule: str
    severity: Severity
    detail: str
    consequence: str

    def __str__(self) -> str:
        return f"{self.severity.value}: {self.rule}: {self.detail}: {self.consequence}"


_TYPE_HASH = re.compile("RIHS01_[0-9a-f]{64}")
_ERROR, _WARNING = Severity.ERROR, Severity.WARNING

RULES: dict[str, tuple[Severity, str]] = {
    "mcap": (_ERROR, "no reader opens it"),
    "closed": (
        _ERROR,
        "rosbags refuses it, rosbag2 has to scan it; `entrain bag recover` makes it whole",
    ),
    "intact": (
        _ERROR,
        "readers stop there or give wrong data; `entrain bag recover` saves the rest",
    ),
    "summary": (
        _WARNING,
        "a reader has to go through the whole file to know what is in it, or falls back to the "
        "order of the file",
    ),
    "profile": (_ERROR, "rosbags rejects the file"),
    "schema": (_ERROR, "rosbag2 throws when it opens the file"),
    "schema-name": (_ERROR, "rosbag2 finds no message package for it and skips the topic"),
    "schema-encoding": (_ERROR, "viewers and decoders without the message package skip the topic"),
    "schema-text": (_ERROR, "viewers and decoders without the message package skip the topic"),
    "message-encoding": (_ERROR, "rosbag2 and rosbags cannot read the topic"),
    "offered-qos": (
        _WARNING,
        "players publish with default QoS, so that late or reliable subscribers may get nothing",
    ),
    "qos-version": (_ERROR, "rosbag2 throws when it opens the file"),
    "type-hash": (_WARNING, "nobody can tell whether an installed definition is the recorded one"),
    "one-type": (_ERROR, "readers decode one part of the topic by the wrong definition"),
    "cdr-header": (_ERROR, "the message cannot be deserialized"),
    "message": (_ERROR, "viewers and decoders fail on the topic"),
    "chunk-index": (_WARNING, "readers fall back to the order of the file"),
    "message-index": (_WARNING, "readers fall back to the order of the file, or miss messages"),
    "statistics": (_ERROR, "numbers and times that readers show or seek by are wrong"),
    "rosbag2-record": (_WARNING, "custom data and QoS are lost with metadata.yaml"),
    "metadata-file": (
        _ERROR,
        "rosbag2 does not open the folder; `ros2 bag reindex` makes it anew",
    ),
    "metadata-key": (_ERROR, "rosbag2 throws when it opens the folder"),
    "metadata-version": (_ERROR, "rosbag2 of Jazzy does not read it"),
    "metadata-qos": (_ERROR, "rosbag2 throws when it opens the folder"),
    "metadata-files": (_ERROR, "rosbag2 does not open the bag, or leaves a file out"),
    "metadata-topics": (_ERROR, "rosbag2 does not play the topic, or shows wrong numbers"),
    "metadata-times": (_ERROR, "`ros2 bag info` shows wrong times, start offsets go astray"),
}
"""Severity and consequence by rule."""


def check(path: Path | str) -> list[Finding]:
    """
    Hold a bag, a folder or an ``.mcap`` file, against rosbag2's rules.

    Never raises for what is wrong with the bag: that is what the findings are for. A rule that
    is broken many times gives one finding, with the first place and the number of places. Bags
    of this project's writer give none.
    """
    path = Path(path)
    report = _Report()
    try:
        files = bag_files(path)
    except UnreadableBagError as error:
        report.add("mcap", str(error))
        return report.findings()
    stocks = {file.name: stock for file in files if (stock := _check_file(file, report))}
    if path.is_dir():
        _check_metadata_file(path, stocks, report)
    return report.findings()


class _Report:
    """Gathers findings, one for each rule."""

    def __init__(self) -> None:
        self._places: dict[str, list[str]] = {}

    def add(self, rule: str, detail: str) -> None:
        self._places.setdefault(rule, []).append(detail)

    def findings(self) -> list[Finding]:
        found = []
        for rule, (severity, consequence) in RULES.items():
            if places := self._places.get(rule):
                more = f" (and {len(places) - 1} more)" if len(places) > 1 else ""
                found.append(Finding(rule, severity, places[0] + more, consequence))
        return found


def _check_file(path: Path, report: _Report) -> Contents | None:
    """Check one MCAP file; give what it really holds."""
    try:
        file = McapFile(path)
    except UnreadableBagError as error:
        report.add("mcap", str(error))
        return None
    try:
        if file.header.profile != "ros2":
            report.add("profile", f"{path}: profile {file.header.profile!r} instead of 'ros2'")
        summary: Contents | None = None
        closed = True
        try:
            file.read_footer()
        except UnreadableBagError as error:
            closed = False
            report.add("closed", str(error))
        if closed:
            try:
                summary = file.read_summary()
                if summary is None:
                    report.add("summary", f"{path}: no summary of channels, statistics and chunks")
            except UnreadableBagError as error:
                report.add("intact", str(error))
        messages = _MessageCheck(file, summary, report)
        stock = file.scan(messages.keep, summary)
        if closed:
            for damage in stock.damages:
                report.add("intact", damage.text)
            _check_data_checksum(file, report)
        if summary is not None:
            _check_summary(path, summary, stock, report)
        _check_channels(path, stock, report)
        if not recorded_description(stock):
            report.add("rosbag2-record", f"{path}: no metadata record {RECORD_NAME!r}")
        elif summary is not None and not recorded_description(summary):
            report.add("rosbag2-record", f"{path}: the summary does not list it")
        return stock
    finally:
        file.close()


class _MessageCheck:
    """Checks the messages of a file chunk by chunk, as they are read."""

    def __init__(self, file: McapFile, summary: Contents | None, report: _Report) -> None:
        self._file = file
        self._listed = {chunk.offset: chunk for chunk in summary.chunks} if summary else {}
        self._has_summary = summary is not None
        self._report = report
        self._decoded: set[str] = set()

    def keep(self, contents: Contents, chunk: Chunk, messages: list[BagMessage]) -> None:
        for message in messages:
            if message.data[:2] not in (b"\0\0", b"\0\1") or len(message.data) < CDR_HEADER_SIZE:
                self._report.add(
                    "cdr-header",
                    f"{self._file.path}: {message.topic}: begins with "
                    f"{message.data[:CDR_HEADER_SIZE].hex(' ') or 'nothing'}",
                )
            elif message.topic not in self._decoded:
                self._decoded.add(message.topic)
                self._check_decoding(contents, message)
        if self._has_summary:
            self._check_index(contents, chunk, messages)

    def _check_decoding(self, contents: Contents, message: BagMessage) -> None:
        """Decode the first message of a topic, as a viewer would."""
        for channel in contents.channels.values():
            topic = topic_of(channel, contents.schemas)
            if topic.name != message.topic or not is_type_name(topic.type):
                continue
            # A type without fields is serialized as one byte, which is padded to four.
            if not topic.schema_text.strip() and len(message.data) > CDR_HEADER_SIZE + 4:
                self._report.add("schema-text", f"{self._file.path}: {topic.type}: is empty")
                return
            try:
                decoder_for(topic)(message.data)
            except UnreadableBagError as error:
                self._report.add("message", f"{self._file.path}: {error}")
            except BagError as error:
                self._report.add("schema-text", f"{self._file.path}: {error}")
            return

    def _check_index(self, contents: Contents, chunk: Chunk, messages: list[BagMessage]) -> None:
        where = f"{self._file.path}: at byte {chunk.offset}"
        listed = self._listed.get(chunk.offset)
        if listed is None:
            self._report.add("chunk-index", f"{where}: messages that no chunk index lists")
            return
        if (listed.start, listed.end) != (chunk.start, chunk.end):
            self._report.add("chunk-index", f"{where}: the times of the index are wrong")
        indexed = set()
        try:
            for channel, offset in listed.index_offsets.items():
                topic = contents.topics.get(channel, "")
                for log_time, _ in self._file.message_index(offset, channel):
                    indexed.add((topic, log_time))
            read = self._file.messages(listed, 0, contents.topics)
        except UnreadableBagError as error:
            self._report.add("message-index", str(error))
            return
        if indexed != {(message.topic, message.log_time) for message in messages} or len(
            read
        ) != len(messages):
            self._report.add("message-index", f"{where}: the index does not list every message")


def _check_data_checksum(file: McapFile, report: _Report) -> None:
    """Hold the data section against the checksum at its end, if the writer left one."""
    checksum = 0
    offset = 0
    try:
        for opcode, start, length in file.records():
            if opcode == Opcode.DATA_END:
                if length != 4:
                    raise file.damage(start, "broken end of the data section")
                expected = file.parse(DataEnd.read, start, length).data_section_crc
                while offset < start:
                    piece = file.read(offset, min(2**20, start - offset))
                    checksum = zlib.crc32(piece, checksum)
                    offset += len(piece)
                if expected and checksum != expected:
                    raise file.damage(start, "the data section does not match its checksum")
                return
    except UnreadableBagError as error:
        report.add("intact", str(error))
        return
    report.add("intact", f"{file.path}: the end of the data section is not marked")


def _check_summary(path: Path, summary: Contents, stock: Contents, report: _Report) -> None:
    statistics = summary.statistics
    if (
        (summary.start, summary.end) != (stock.start, stock.end)
        or {name: n for name, n in summary.counts.items() if n} != stock.counts
        or (statistics and statistics.message_count != stock.message_count)
    ):
        report.add(
            "statistics",
            f"{path}: {summary.message_count} messages from {summary.start} to {summary.end} ns "
            f"announced, {stock.message_count} from {stock.start} to {stock.end} ns found",
        )


def _check_channels(path: Path, stock: Contents, report: _Report) -> None:
    known: dict[str, TopicInfo] = {}
    version = recorded_description(stock).get("version", METADATA_VERSION)
    for schema in stock.schemas.values():
        where = f"{path}: {schema.name}"
        if not is_type_name(schema.name):
            report.add("schema-name", f"{where}: a type reads package/msg/Type")
        elif schema.encoding != "ros2msg":
            report.add("schema-encoding", f"{where}: {schema.encoding!r} instead of 'ros2msg'")
        elif missing := missing_definitions(schema.name, schema.data.decode(errors="replace")):
            report.add("schema-text", f"{where}: lacks the definition of {', '.join(missing)}")
    for channel in stock.channels.values():
        where = f"{path}: {channel.topic}"
        if channel.schema_id not in stock.schemas:
            report.add("schema", f"{where}: schema {channel.schema_id} is not in the file")
        else:
            topic = topic_of(channel, stock.schemas)
            if difference := differing_types(known.setdefault(topic.name, topic), topic):
                report.add("one-type", f"{where}: has {difference}")
        if channel.message_encoding != "cdr":
            report.add("message-encoding", f"{where}: {channel.message_encoding!r}, not 'cdr'")
        qos = channel.metadata.get("offered_qos_profiles")
        try:
            if qos is None:
                raise UnreadableBagError(f"{channel.topic}: no offered_qos_profiles")
            parse_qos_profiles(qos, f"{channel.topic}: offered_qos_profiles")
            _check_qos_spelling(where, qos, version, report)
        except UnreadableBagError as error:
            report.add("offered-qos", f"{path}: {error}")
        if not _TYPE_HASH.fullmatch(channel.metadata.get("topic_type_hash", "")):
            report.add("type-hash", f"{where}: no topic_type_hash RIHS01_ and 64 hex digits")


def _check_qos_spelling(where: str, qos: str, version: Any, report: _Report) -> None:
    """Hold the spelling of a channel's policies against the version that the file names."""
    if not isinstance(version, int):
        return
    spelled = {
        isinstance(profile[policy], str)
        for profile in load_yaml(qos, where) or []
        for policy in ("reliability", "durability", "liveliness")
    }
    if version < METADATA_VERSION and True in spelled:
        report.add(
            "qos-version",
            f"{where}: policies are words, but the record {RECORD_NAME!r} is of version "
            f"{version}, which has numbers",
        )
    elif version >= METADATA_VERSION and False in spelled:
        report.add(
            "offered-qos",
            f"{where}: policies are numbers, which rosbag2 takes for unknown in version {version}",
        )


def _check_metadata_file(path: Path, stocks: dict[str, Contents], report: _Report) -> None:
    file = path / METADATA_FILE
    try:
        found = read_metadata_file(path)
    except UnreadableBagError as error:
        report.add("metadata-file", str(error))
        return
    missing = list(_missing_keys(found))
    for key in missing:
        report.add("metadata-key", f"{file}: {key} is missing or of the wrong kind")
    version = found.get("version")
    if not isinstance(version, int) or not 1 <= version <= METADATA_VERSION:
        report.add("metadata-version", f"{file}: version {version!r}, 1 to 9 are known")
        return
    if missing:
        return
    names = [PurePath(str(name)).name for name in found["relative_file_paths"]]
    if set(names) != set(stocks) | {name for name in names if (path / name).is_file()}:
        report.add("metadata-files", f"{file}: lists {', '.join(names)}")
    for stray in sorted({file.name for file in path.glob("*.mcap")} - set(names)):
        report.add("metadata-files", f"{file}: does not list {stray}")
    _check_metadata_topics(file, found, version, stocks, report)
    filled = [stock for stock in stocks.values() if stock.message_count]
    start = min((stock.start for stock in filled), default=None)
    end = max((stock.end for stock in filled), default=0)
    said = found["starting_time"]["nanoseconds_since_epoch"], found["duration"]["nanoseconds"]
    if start is not None and said != (start, end - start):
        report.add(
            "metadata-times",
            f"{file}: starts at {said[0]} ns and lasts {said[1]} ns, "
            f"but the messages start at {start} ns and last {end - start} ns",
        )


def _check_metadata_topics(
    file: Path, found: dict[str, Any], version: int, stocks: dict[str, Contents], report: _Report
) -> None:
    counts: dict[str, int] = {}
    types: dict[str, str] = {}
    for stock in stocks.values():
        for channel in stock.channels.values():
            topic = topic_of(channel, stock.schemas)
            types[topic.name] = topic.type
            counts.setdefault(topic.name, 0)
        for name, count in stock.counts.items():
            counts[name] = counts.get(name, 0) + count
    said: dict[str, tuple[str, int]] = {}
    for entry in found["topics_with_message_count"]:
        topic = entry["topic_metadata"]
        said[str(topic["name"])] = str(topic["type"]), entry["message_count"]
        where = f"{file}: {topic['name']}: offered_qos_profiles"
        qos = topic.get("offered_qos_profiles", [])
        if isinstance(qos, str) is (version >= METADATA_VERSION):
            kind = "a sequence" if version >= METADATA_VERSION else "text"
            report.add("metadata-qos", f"{where}: version {version} wants {kind}")
            continue
        try:
            parse_qos_profiles(qos, where)
        except UnreadableBagError as error:
            report.add("metadata-qos", str(error))
    true = {name: (types.get(name, ""), count) for name, count in counts.items()}
    for name in sorted(said.keys() | true.keys()):
        if said.get(name) != true.get(name):
            report.add(
                "metadata-topics",
                f"{file}: {name}: {_told(said, name)} announced, {_told(true, name)} in the files",
            )
    if found["message_count"] != sum(counts.values()):
        report.add(
            "metadata-topics",
            f"{file}: {found['message_count']} messages announced, {sum(counts.values())} found",
        )


def _told(topics: dict[str, tuple[str, int]], name: str) -> str:
    if name not in topics:
        return "nothing"
    return f"{topics[name][1]} of {topics[name][0]}"


_TIMES = {"duration": {"nanoseconds": int}}
_START = {"starting_time": {"nanoseconds_since_epoch": int}}
_FORM: dict[str, Any] = {
    "version": int,
    "storage_identifier": str,
    **_TIMES,
    **_START,
    "message_count": int,
    "topics_with_message_count": [
        {
            "topic_metadata": {"name": str, "type": str, "serialization_format": str},
            "message_count": int,
        }
    ],
    "compression_format": str,
    "compression_mode": str,
    "relative_file_paths": [str],
}
# Keys that versions of metadata.yaml have added.
_ADDED: dict[int, dict[str, Any]] = {
    5: {"files": [{"path": str, **_START, **_TIMES, "message_count": int}]},
    6: {"custom_data": object},
    8: {"ros_distro": str},
}
_ADDED_TO_TOPICS = {4: "offered_qos_profiles", 7: "type_description_hash"}


def _missing_keys(found: dict[str, Any]) -> Iterator[str]:
    """Name the keys that the version of a ``metadata.yaml`` must have, and has not."""
    yield from _misfits(found, _FORM, "")
    version = found.get("version")
    if not isinstance(version, int):
        return
    for since, form in _ADDED.items():
        if version >= since:
            yield from _misfits(found, form, "")
    topics = found.get("topics_with_message_count")
    for entry in topics if isinstance(topics, list) else []:
        topic = entry.get("topic_metadata") if isinstance(entry, dict) else None
        for since, key in _ADDED_TO_TOPICS.items():
            if version >= since and isinstance(topic, dict) and key not in topic:
                yield f"topic_metadata.{key}"


def _misfits(value: Any, form: Any, where: str) -> Iterator[str]:
    """Name the places where a value is not of a form made of types, maps and sequences."""
    if isinstance(form, dict):
        if not isinstance(value, dict):
            yield where
            return
        for key, inner in form.items():
            place = f"{where}.{key}".lstrip(".")
            if key not in value:
                yield place
            else:
                yield from _misfits(value[key], inner, place)
    elif isinstance(form, list):
        if not isinstance(value, list):
            yield where
            return
        for number, entry in enumerate(value):
            yield from _misfits(entry, form[0], f"{where}[{number}]")
    elif not isinstance(value, form) or isinstance(value, bool):
        yield where
