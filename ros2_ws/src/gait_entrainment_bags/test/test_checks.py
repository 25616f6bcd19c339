# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Each rule, with a bag that breaks it and, if possible, no other rule."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.writer import CompressionType, IndexType, Writer

from gait_entrainment_bags import (
    BagReader,
    BagWriter,
    QosProfile,
    Severity,
    TopicInfo,
    UnreadableBagError,
    check,
)
from gait_entrainment_bags.checks import RULES
from gait_entrainment_bags.metadata import offered_qos_text

HASH = "RIHS01_" + "0" * 64
# The same profile as written by versions before 9.
NUMBERS = (
    offered_qos_text([QosProfile()])
    .replace("keep_last", "1")
    .replace("reliable", "1")
    .replace("volatile", "2")
    .replace("automatic", "1")
)
STAMP = (
    "builtin_interfaces/Time stamp\n\n"
    + "=" * 80
    + ("\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")
)
DATA = b"\0\1\0\0" + bytes(8)


def write_file(path: Path, options: dict[str, Any]) -> None:
    """Write an MCAP file that follows every rule except those that the options break."""
    with path.open("wb") as stream:
        writer = Writer(
            stream,
            compression=CompressionType.ZSTD,
            **{key: value for key, value in options.items() if key in WRITER_OPTIONS},
        )
        writer.start(options.get("profile", "ros2"))
        schema = writer.register_schema(
            options.get("type", "p/msg/Stamp"),
            options.get("schema_encoding", "ros2msg"),
            options.get("text", STAMP).encode(),
        )
        metadata = {
            "offered_qos_profiles": options.get("qos", offered_qos_text([QosProfile()])),
            "topic_type_hash": options.get("hash", HASH),
        }
        for key in options.get("without", ()):
            del metadata[key]
        channel = writer.register_channel(
            "/stamp",
            options.get("message_encoding", "cdr"),
            options.get("schema_id", schema),
            metadata,
        )
        if "second_type" in options:
            other = writer.register_schema("p/msg/Other", "ros2msg", STAMP.encode())
            writer.register_channel("/stamp", "cdr", other, metadata)
        for number in range(3):
            writer.add_message(channel, number, options.get("data", DATA), number)
        if options.get("record", True):
            version = options.get("version", 9)
            writer.add_metadata("rosbag2", {"serialized_metadata": f"version: {version}\n"})
        writer.finish()


WRITER_OPTIONS = ("index_types", "use_statistics", "use_chunking", "repeat_channels")


@pytest.mark.parametrize(
    ("rules", "options"),
    [
        ([], {}),
        (["profile"], {"profile": ""}),
        (["schema"], {"schema_id": 0}),
        (["schema"], {"schema_id": 9}),
        (["schema-name"], {"type": "p/Stamp"}),
        (["schema-encoding"], {"schema_encoding": "ros2idl"}),
        (["schema-text"], {"text": ""}),
        (["schema-text", "message"], {"text": "Other other\n"}),
        (["schema-text"], {"text": "uint8 1\n"}),
        (["message-encoding"], {"message_encoding": "json"}),
        (["offered-qos"], {"without": ["offered_qos_profiles"]}),
        (["offered-qos"], {"qos": "history: keep_last"}),
        (["qos-version"], {"version": 8}),
        ([], {"version": 8, "qos": NUMBERS}),
        (["offered-qos"], {"version": 9, "qos": NUMBERS}),
        (["type-hash"], {"without": ["topic_type_hash"]}),
        (["type-hash"], {"hash": "RIHS01_12"}),
        (["one-type"], {"second_type": True}),
        (["cdr-header"], {"data": b"\1\2\0\0" + bytes(8)}),
        (["cdr-header"], {"data": b""}),
        (["message"], {"data": DATA[:-1]}),
        (["summary"], {"index_types": IndexType.METADATA | IndexType.MESSAGE}),
        (["message-index"], {"index_types": IndexType.METADATA | IndexType.CHUNK}),
        (["summary"], {"use_statistics": False}),
        (["summary"], {"use_statistics": False, "repeat_channels": False}),
        (["summary"], {"use_chunking": False}),
        (["rosbag2-record"], {"record": False}),
        (["rosbag2-record"], {"index_types": IndexType.CHUNK | IndexType.MESSAGE}),
    ],
)
def test_rules_of_the_file(tmp_path: Path, rules: list[str], options: dict[str, Any]) -> None:
    path = tmp_path / "bag.mcap"
    write_file(path, options)
    found = check(path)
    assert [finding.rule for finding in found] == rules
    for finding in found:
        assert str(path) in finding.detail
        assert (finding.severity, finding.consequence) == RULES[finding.rule]
        assert "\n" not in str(finding)


def test_statistics_that_do_not_add_up(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    write_file(path, {})
    data = bytearray(path.read_bytes())
    (summary_start,) = struct.unpack_from("<Q", data, len(data) - 28)
    # The statistics record: opcode 11, then its length, then the number of messages.
    place = data.index(b"\x0b" + struct.pack("<Q", 56), summary_start)
    struct.pack_into("<Q", data, place + 9, 4)
    struct.pack_into("<Q", data, place + 9 + 46 + 2, 4)
    write_checksum(data, summary_start)
    path.write_bytes(data)
    assert [finding.rule for finding in check(path)] == ["statistics"]
    with (
        BagReader(path) as reader,
        pytest.raises(UnreadableBagError, match=r"3 .* but 4 expected"),
    ):
        list(reader.messages())


def test_chunk_index_with_wrong_times(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    write_file(path, {})
    data = bytearray(path.read_bytes())
    (summary_start,) = struct.unpack_from("<Q", data, len(data) - 28)
    place = data.index(struct.pack("<QQ", 0, 2), data.index(b"\x08", summary_start))
    struct.pack_into("<Q", data, place + 8, 3)
    write_checksum(data, summary_start)
    path.write_bytes(data)
    assert [finding.rule for finding in check(path)] == ["chunk-index"]


def write_checksum(data: bytearray, summary_start: int) -> None:
    struct.pack_into("<I", data, len(data) - 12, zlib.crc32(data[summary_start:-12]))


def test_unclosed_and_damaged_files(small_bag: Path, tmp_path: Path) -> None:
    data = (small_bag / "small_0.mcap").read_bytes()
    path = tmp_path / "bag.mcap"
    path.write_bytes(data[:-50])
    assert [finding.rule for finding in check(path)] == ["closed"]
    path.write_bytes(data.replace(b"gait_entrainment", b"g-it_entrainment"))
    assert [finding.rule for finding in check(path)] == ["intact"]
    assert [finding.rule for finding in check(tmp_path / "nothing")] == ["mcap"]


def edit_metadata(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        path = folder / "metadata.yaml"
        content = yaml.safe_load(path.read_text())
        change(content["rosbag2_bagfile_information"])
        path.write_text(yaml.safe_dump(content))

    return edit


def topic_metadata(content: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = content["topics_with_message_count"][0]["topic_metadata"]
    return found


@pytest.mark.parametrize(
    ("rule", "damage"),
    [
        ("metadata-file", lambda folder: (folder / "metadata.yaml").unlink()),
        ("metadata-file", lambda folder: (folder / "metadata.yaml").write_text("")),
        ("metadata-file", lambda folder: (folder / "metadata.yaml").write_text("a: 1")),
        ("metadata-key", edit_metadata(lambda content: content.pop("custom_data"))),
        ("metadata-key", edit_metadata(lambda content: content.pop("ros_distro"))),
        ("metadata-key", edit_metadata(lambda content: content.update(message_count="many"))),
        ("metadata-key", edit_metadata(lambda content: content["files"][0].pop("duration"))),
        (
            "metadata-key",
            edit_metadata(lambda content: topic_metadata(content).pop("type_description_hash")),
        ),
        ("metadata-version", edit_metadata(lambda content: content.update(version=10))),
        (
            "metadata-qos",
            edit_metadata(lambda content: topic_metadata(content).update(offered_qos_profiles="")),
        ),
        ("metadata-qos", edit_metadata(lambda content: content.update(version=8))),
        (
            "metadata-qos",
            edit_metadata(
                lambda content: topic_metadata(content)["offered_qos_profiles"][0].pop("depth")
            ),
        ),
        ("metadata-files", lambda folder: (folder / "stray.mcap").write_bytes(b"")),
        ("metadata-topics", edit_metadata(lambda content: content.update(message_count=7))),
        (
            "metadata-topics",
            edit_metadata(lambda content: topic_metadata(content).update(type="p/msg/Other")),
        ),
        (
            "metadata-topics",
            edit_metadata(lambda content: content["topics_with_message_count"].clear()),
        ),
        ("metadata-key", edit_metadata(lambda content: content["duration"].clear())),
        (
            "metadata-times",
            edit_metadata(lambda content: content.update(duration={"nanoseconds": 7})),
        ),
    ],
)
def test_rules_of_the_metadata_file(
    tmp_path: Path, rule: str, damage: Callable[[Path], object]
) -> None:
    folder = tmp_path / "bag"
    with BagWriter(folder, ros_distro="jazzy") as writer:
        writer.add_topic(TopicInfo("/stamp", "p/msg/Stamp", STAMP, HASH, (QosProfile(),)))
        writer.write("/stamp", DATA, 5, 5)
    assert check(folder) == []
    damage(folder)
    found = check(folder)
    assert [finding.rule for finding in found] == [rule]
    assert str(folder) in found[0].detail


def test_missing_file(small_bag: Path, tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_bytes((small_bag / "metadata.yaml").read_bytes())
    rules = [finding.rule for finding in check(tmp_path)]
    assert rules == ["mcap", "metadata-files", "metadata-topics"]


def test_message_without_fields_follows_the_rules(
    tmp_path: Path, topic: Callable[..., TopicInfo]
) -> None:
    with BagWriter(tmp_path / "bag", ros_distro="jazzy") as writer:
        writer.add_topic(topic("/empty", "std_msgs/msg/Empty"))
        writer.write("/empty", b"\0\1\0\0\0", 1, 1)
    assert check(tmp_path / "bag") == []


def test_many_violations_of_a_rule_give_one_line(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    write_file(path, {"data": b""})
    (finding,) = check(path)
    assert "(and 2 more)" in finding.detail
    assert finding.severity is Severity.ERROR
    assert str(finding).startswith(f"error: cdr-header: {path}: /stamp: begins with nothing")
