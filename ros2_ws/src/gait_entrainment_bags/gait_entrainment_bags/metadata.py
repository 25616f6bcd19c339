# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The two places where rosbag2 keeps its description of a bag, in the form of version 9.

They are ``metadata.yaml`` in the bag's folder and the MCAP metadata record named ``rosbag2``,
which holds the same map without its root key. The form is that of rosbag2's Jazzy branch
(``rosbag2_storage/yaml.hpp`` and ``qos.cpp``).
"""

import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.errors import UnreadableBagError

METADATA_VERSION = 9
METADATA_FILE = "metadata.yaml"
ROOT_KEY = "rosbag2_bagfile_information"
RECORD_NAME = "rosbag2"  # of the MCAP metadata record
RECORD_KEY = "serialized_metadata"

INFINITE = 2**63 - 1
"""Duration [ns] by which DDS says "no limit": 9223372036 s and 854775807 ns."""

# The spelling of rosbag2's version 9 by the integers that earlier versions used.
QOS_POLICIES: dict[str, dict[int, str]] = {
    "history": {0: "system_default", 1: "keep_last", 2: "keep_all", 3: "unknown"},
    "reliability": {
        0: "system_default",
        1: "reliable",
        2: "best_effort",
        3: "unknown",
        4: "best_available",
    },
    "durability": {
        0: "system_default",
        1: "transient_local",
        2: "volatile",
        3: "unknown",
        4: "best_available",
    },
    "liveliness": {
        0: "system_default",
        1: "automatic",
        3: "manual_by_topic",
        4: "unknown",
        5: "best_available",
    },
}
_QOS_DURATIONS = ("deadline", "lifespan", "liveliness_lease_duration")


@dataclass(frozen=True)
class QosProfile:
    """
    Quality of service that a publisher offered, in rosbag2's terms; durations in nanoseconds.

    Raises
    ------
    ValueError
        A policy is not spelled as rosbag2 spells it.

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
                raise ValueError(f"{policy} {value!r}: one of {allowed} is allowed")

    def as_map(self) -> dict[str, Any]:
        """Give the map of nine keys that rosbag2 writes."""
        durations = {name: _duration(getattr(self, name)) for name in _QOS_DURATIONS}
        return asdict(self) | durations


def _duration(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    return {"sec": seconds, "nsec": rest}


@dataclass(frozen=True)
class TopicInfo:
    """
    A topic as it is announced in a bag.

    ``type`` reads ``package/msg/Type``, ``type_hash`` is ``RIHS01_`` and 64 hex digits,
    ``schema_text`` the definition of the message with all that it depends on.
    """

    name: str
    type: str
    schema_text: str
    type_hash: str = ""
    qos_profiles: tuple[QosProfile, ...] = ()


@dataclass(frozen=True)
class FileInformation:
    """One file of a bag; times in nanoseconds, 0 where it holds no message."""

    path: str
    start: int = 0
    end: int = 0
    message_count: int = 0


@dataclass(frozen=True)
class BagDescription:
    """All that ``metadata.yaml`` says about a bag."""

    topics: tuple[tuple[TopicInfo, int], ...]  # each with its number of messages
    files: tuple[FileInformation, ...]
    custom_data: Mapping[str, str] = field(default_factory=dict)
    ros_distro: str = ""

    def as_map(self) -> dict[str, Any]:
        """Give rosbag2's map of version 9, without the root key."""
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
                        "serialization_format": "cdr",
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
            "custom_data": dict(self.custom_data),
            "ros_distro": self.ros_distro,
        }

    def as_record(self) -> dict[str, str]:
        """Give the content of the MCAP metadata record ``rosbag2``."""
        return {RECORD_KEY: dump_yaml(self.as_map())}

    def write(self, folder: Path) -> None:
        """Write ``metadata.yaml`` so that a reader finds the old file or the new, never half."""
        unfinished = folder / (METADATA_FILE + ".tmp")
        with unfinished.open("w", encoding="utf-8") as stream:
            stream.write(dump_yaml({ROOT_KEY: self.as_map()}))
            stream.flush()
            os.fsync(stream.fileno())
        unfinished.replace(folder / METADATA_FILE)


def offered_qos_text(profiles: Iterable[QosProfile]) -> str:
    """Give the text of a channel's ``offered_qos_profiles``: a YAML sequence of maps."""
    return dump_yaml([profile.as_map() for profile in profiles])


def parse_qos_profiles(value: object, where: str) -> tuple[QosProfile, ...]:
    """
    Read offered QoS profiles: a sequence of maps, or text that holds one.

    Policies may be spelled as in version 9, or as the integers of earlier versions.

    Raises
    ------
    UnreadableBagError
        It is not of that form; the text says which key is wrong.

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


def dump_yaml(value: object) -> str:
    """Write YAML with the keys in the order given."""
    return str(yaml.dump(value, Dumper=_DUMPER, sort_keys=False, allow_unicode=True))


def load_yaml(text: str, where: str) -> Any:
    """
    Read YAML that somebody else wrote.

    Raises
    ------
    UnreadableBagError
        It is not YAML, or nested too deeply to be read.

    """
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
    """Give what an error says, on one line."""
    return " ".join(str(error).split()) or type(error).__name__


# PyYAML's own C parser, ten times faster, is absent only where PyYAML was built without libyaml.
# Its loader calls itself for each level, and 30,000 of them end the process.
_DEEPEST = 100
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
