# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The two places where rosbag2 keeps its description of a bag, in the form of version 9.

They are ``metadata.yaml`` in the bag's folder and the MCAP metadata record named ``rosbag2``,
which holds the same map without its root key. The form is that of rosbag2's Jazzy branch
(``rosbag2_storage/yaml.hpp`` and ``qos.cpp``).
"""

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml
from mcap.records import Channel, Metadata, Schema

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.definitions import is_type_name
from gait_entrainment_bags.errors import UnreadableBagError

METADATA_VERSION = 9
METADATA_FILE = "metadata.yaml"
RECORD_NAME = "rosbag2"  # of the MCAP metadata record
_ROOT_KEY = "rosbag2_bagfile_information"
_RECORD_KEY = "serialized_metadata"

INFINITE = 2**63 - 1
"""Duration [ns] that means "no limit" in DDS: 9223372036 s and 854775807 ns."""

# The spellings of rosbag2's version 9, by the integers that earlier versions used.
QOS_POLICIES = {
    policy: {number: word for number, word in enumerate(words.split()) if word != "-"}
    for policy, words in {
        "history": "system_default keep_last keep_all unknown",
        "reliability": "system_default reliable best_effort unknown best_available",
        "durability": "system_default transient_local volatile unknown best_available",
        "liveliness": "system_default automatic - manual_by_topic unknown best_available",
    }.items()
}
_QOS_DURATIONS = ("deadline", "lifespan", "liveliness_lease_duration")

# Keys that are not in version 1, with the version that added them.
_ADDED = {
    "offered_qos_profiles": 4,
    "files": 5,
    "custom_data": 6,
    "type_description_hash": 7,
    "ros_distro": 8,
}
# Keys whose type depends on the version, or does not matter.
_OF_ANY_KIND = ("offered_qos_profiles", "custom_data", "type_description_hash")


@dataclass(frozen=True)
class QosProfile:
    """
    Quality of service offered by a publisher, in rosbag2's terms; durations in nanoseconds.

    Raises ValueError if a policy is not spelled as in rosbag2.
    """

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = "automatic"
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False

    def __post_init__(self) -> None:
        for policy, spellings in QOS_POLICIES.items():
            if (value := getattr(self, policy)) not in spellings.values():
                allowed = ", ".join(spellings.values())
                raise ValueError(f"{policy} {value!r}; allowed: {allowed}")

    def as_map(self) -> dict[str, Any]:
        """Return the map of nine keys that rosbag2 writes."""
        values = asdict(self)
        for name in _QOS_DURATIONS:
            seconds, rest = divmod(values[name], NANOSECONDS_PER_SECOND)
            values[name] = {"sec": seconds, "nsec": rest}
        return values


@dataclass(frozen=True)
class TopicInfo:
    """
    A topic as announced in a bag.

    ``type`` reads ``package/msg/Type``, ``type_hash`` is ``RIHS01_`` and 64 hex digits,
    ``schema_text`` the message definition with all its dependencies; bytes in it that are not
    valid text are surrogates. Topics of ROS 2 have the default encodings.
    """

    name: str
    type: str
    schema_text: str
    type_hash: str = ""
    qos_profiles: tuple[QosProfile, ...] = ()
    message_encoding: str = "cdr"
    schema_encoding: str = "ros2msg"

    @property
    def is_storable(self) -> bool:
        """Whether the type's name is valid for the encoding of the messages."""
        return self.message_encoding != "cdr" or is_type_name(self.type)


@dataclass
class FileInformation:
    """One file of a bag; times in nanoseconds, 0 if it holds no message."""

    path: str
    start: int = 0
    end: int = 0
    message_count: int = 0


@dataclass(frozen=True)
class BagDescription:
    """The content of a bag's ``metadata.yaml``."""

    topics: Sequence[tuple[TopicInfo, int]]  # each with its number of messages
    files: Sequence[FileInformation]
    custom_data: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ""

    def as_map(self) -> dict[str, Any]:
        """Return rosbag2's map of version 9, without the root key."""
        filled = [file for file in self.files if file.message_count]
        start = min((file.start for file in filled), default=0)
        end = max((file.end for file in filled), default=0)
        return {
            "version": METADATA_VERSION,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": end - start},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": sum(file.message_count for file in self.files),
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type,
                        "serialization_format": topic.message_encoding,
                        "offered_qos_profiles": [qos.as_map() for qos in topic.qos_profiles],
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": count,
                }
                for topic, count in self.topics
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file.path for file in self.files],
            "files": [
                {
                    "path": file.path,
                    "starting_time": {"nanoseconds_since_epoch": file.start},
                    "duration": {"nanoseconds": file.end - file.start},
                    "message_count": file.message_count,
                }
                for file in self.files
            ],
            # They may contain a name that is not UTF-8, which YAML cannot hold.
            "custom_data": {
                key: text.encode(errors="backslashreplace").decode()
                for key, text in self.custom_data.items()
            },
            "ros_distro": self.ros_distro,
        }

    def as_record(self) -> dict[str, str]:
        """Return the content of the MCAP metadata record ``rosbag2``."""
        return {_RECORD_KEY: _dump_yaml(self.as_map())}

    def write(self, folder: Path) -> None:
        """Write ``metadata.yaml``; a reader finds the old file or the new one, never a part."""
        unfinished = folder / (METADATA_FILE + ".tmp")
        with unfinished.open("w", encoding="utf-8") as stream:
            stream.write(_dump_yaml({_ROOT_KEY: self.as_map()}))
            stream.flush()
            os.fsync(stream.fileno())
        unfinished.replace(folder / METADATA_FILE)


# Every key, with a value of its type.
_EXAMPLE = BagDescription([(TopicInfo("", "", ""), 0)], [FileInformation("")]).as_map()


def read_metadata_file(folder: Path) -> dict[str, Any]:
    """Read ``metadata.yaml`` without its root key; raises UnreadableBagError if it has none."""
    path = folder / METADATA_FILE
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UnreadableBagError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise UnreadableBagError(f"{path}: cannot be read: {error}") from None
    content = load_yaml(text, str(path))
    description = content.get(_ROOT_KEY) if isinstance(content, dict) else None
    if not isinstance(description, dict):
        raise UnreadableBagError(f"{path}: no {_ROOT_KEY} in it")
    return description


def described_beside(path: Path) -> dict[str, Any]:
    """Return the content of a folder's ``metadata.yaml``, or {} if it cannot be read."""
    with contextlib.suppress(UnreadableBagError):
        return read_metadata_file(path)
    return {}


def recorded_description(records: Sequence[Metadata]) -> dict[str, Any]:
    """Return rosbag2's description from the last record of that name, {} without one."""
    for record in reversed(records):
        if record.name == RECORD_NAME:
            with contextlib.suppress(UnreadableBagError):
                found = load_yaml(record.metadata.get(_RECORD_KEY, ""), RECORD_NAME)
                if isinstance(found, dict):
                    return found
    return {}


def custom_data_of(description: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data in a description, {} if there is none."""
    found = description.get("custom_data")
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}


def missing_keys(description: Mapping[str, Any]) -> Iterator[str]:
    """Yield required keys of a description's version that are missing or of the wrong type."""
    version = description.get("version")
    return _misfits(description, _EXAMPLE, "", version if isinstance(version, int) else 1)


def _misfits(found: Any, example: Any, place: str, version: int) -> Iterator[str]:
    if isinstance(example, dict) and isinstance(found, dict):
        for key, inner in example.items():
            where = f"{place}.{key}".lstrip(".")
            if version < _ADDED.get(key, 1):
                continue
            if key not in found:
                yield where
            elif key not in _OF_ANY_KIND:
                yield from _misfits(found[key], inner, where, version)
    elif isinstance(example, list) and isinstance(found, list):
        for number, entry in enumerate(found):
            yield from _misfits(entry, example[0], f"{place}[{number}]", version)
    elif type(found) is not type(example):
        yield place


def topic_of(channel: Channel, schema: Schema | None) -> TopicInfo:
    """Describe the topic of a channel; damaged parts of its description are left out."""
    qos: tuple[QosProfile, ...] = ()
    with contextlib.suppress(UnreadableBagError):  # messages can be read without it
        qos = parse_qos_profiles(channel.metadata.get("offered_qos_profiles", ""), channel.topic)
    type_hash = channel.metadata.get("topic_type_hash", "")
    if schema is None:
        return TopicInfo(channel.topic, "", "", type_hash, qos, channel.message_encoding, "")
    text = schema.data.decode(errors="surrogateescape")
    encodings = channel.message_encoding, schema.encoding
    return TopicInfo(channel.topic, schema.name, text, type_hash, qos, *encodings)


def offered_qos_text(profiles: Iterable[QosProfile]) -> str:
    """Return the text of a channel's ``offered_qos_profiles``: a YAML sequence of maps."""
    return _dump_yaml([profile.as_map() for profile in profiles])


def parse_qos_profiles(value: object, where: str) -> tuple[QosProfile, ...]:
    """
    Parse offered QoS profiles: a sequence of maps, or text that holds one.

    Policies may be spelled as in version 9, or given as the integers of earlier versions. Raises
    UnreadableBagError if the value has another form; the message names the wrong key.
    """
    if isinstance(value, str):
        value = load_yaml(value, where) or []
    if not isinstance(value, list):
        raise UnreadableBagError(f"{where}: not a YAML sequence")
    return tuple(_parse_qos_profile(entry, where) for entry in value)


def _parse_qos_profile(entry: object, where: str) -> QosProfile:
    if not isinstance(entry, dict):
        raise UnreadableBagError(f"{where}: a profile is not a map")
    values: dict[str, Any] = {}
    try:
        for name in QosProfile.__dataclass_fields__:
            value = entry[name]
            if name in QOS_POLICIES and isinstance(value, int):
                value = QOS_POLICIES[name].get(value, value)
            elif name in _QOS_DURATIONS:
                value = int(value["sec"]) * NANOSECONDS_PER_SECOND + int(value["nsec"])
            values[name] = value
        return QosProfile(**values)
    except KeyError as error:
        raise UnreadableBagError(f"{where}: key {error} is missing") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise UnreadableBagError(f"{where}: {error}") from None


def _dump_yaml(value: object) -> str:
    """Write YAML with the keys in the order given."""
    return str(yaml.dump(value, Dumper=_DUMPER, sort_keys=False, allow_unicode=True))


def load_yaml(text: str, where: str) -> Any:
    """Parse untrusted YAML; raises UnreadableBagError if it is invalid or nested too deeply."""
    try:
        depth = 0
        for event in yaml.parse(text, Loader=_LOADER):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise RecursionError(f"nested more than {_DEEPEST} deep")
        return yaml.load(text, Loader=_LOADER)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise UnreadableBagError(f"{where}: not valid YAML: {first_line(error)}") from None


def first_line(error: Exception) -> str:
    """Return an error's message on one line."""
    return " ".join(str(error).split()) or type(error).__name__


# PyYAML's C parser, ten times faster, is absent only if PyYAML was built without libyaml.
# Its loader recurses once per level, and 30,000 levels crash the process.
_DEEPEST = 100
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
