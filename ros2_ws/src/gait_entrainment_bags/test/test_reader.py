# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import Writer as RosbagsWriter

from gait_entrainment_bags import (
    BagError,
    BagReader,
    BagWriter,
    QosProfile,
    TopicInfo,
    UnreadableBagError,
    check,
    recover,
)
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.mcap_file import McapFile

TOPICS = ("/a", "/b/c", "/d")
times = st.integers(0, 12) | st.integers(0, 2**64 - 1)
recordings = st.lists(
    st.tuples(st.sampled_from(TOPICS), times, times, st.binary(max_size=60), st.booleans()),
    max_size=40,
)


def topic_named(name: str) -> TopicInfo:
    return TopicInfo(name, "p/msg/Noise", "uint8[] bytes\n", "RIHS01_" + "1" * 64)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    recordings,
    st.sampled_from(["zstd", "lz4", "none"]),
    st.sets(st.sampled_from(TOPICS)),
    times,
    times,
)
def test_what_goes_in_comes_out_in_order(
    tmp_path_factory: pytest.TempPathFactory,
    recording: list[tuple[str, int, int, bytes, bool]],
    compression: str,
    wanted: set[str],
    start: int,
    end: int,
) -> None:
    folder = tmp_path_factory.mktemp("bag") / "walk"
    with BagWriter(folder, ros_distro="jazzy", compression=compression, chunk_size=200) as writer:
        for name in TOPICS:
            writer.add_topic(topic_named(name))
        for name, log_time, publish_time, data, flush in recording:
            writer.write(name, data, log_time, publish_time)
            if flush:
                writer.flush()
    # Python's sort is stable: messages with the same log time stay in file order.
    expected = sorted(
        ((name, log, publish, data) for name, log, publish, data, _ in recording),
        key=lambda entry: entry[1],
    )
    with BagReader(folder) as reader:

        def read(*args: object) -> list[tuple[str, int, int, bytes]]:
            found = reader.messages(*args)  # type: ignore[arg-type]
            return [(m.topic, m.log_time, m.publish_time, m.data) for m in found]

        assert read() == expected
        assert read(wanted) == [entry for entry in expected if entry[0] in wanted]
        assert read(None, start, end) == [e for e in expected if start <= e[1] < end]
        assert reader.counts == {
            name: sum(entry[0] == name for entry in expected) for name in TOPICS
        }
        if expected:
            assert (reader.start, reader.end) == (expected[0][1], expected[-1][1])


def write_with_mcap_library(path: Path, compression: CompressionType, **options: object) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=300, compression=compression, **options)  # type: ignore[arg-type]
        writer.start("ros2")
        schema = writer.register_schema("p/msg/Noise", "ros2msg", b"uint8[] bytes\n")
        channels = [writer.register_channel(name, "cdr", schema) for name in TOPICS]
        for number in range(60):
            data = bytes([0, 1, 0, 0, number])
            writer.add_message(channels[number % 3], (number * 7) % 60, data, number)
        writer.finish()


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.CHUNK},
        {"use_chunking": False},
        {"use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"repeat_schemas": False},
        {"enable_crcs": False},
        {
            "index_types": IndexType.NONE,
            "use_statistics": False,
            "repeat_channels": False,
            "repeat_schemas": False,
            "use_summary_offsets": False,
        },
    ],
)
def test_files_of_other_writers_are_read_with_whatever_index_they_have(
    tmp_path: Path, options: dict[str, object]
) -> None:
    path = tmp_path / "other.mcap"
    write_with_mcap_library(path, CompressionType.LZ4, **options)
    with BagReader(path) as reader:
        assert [message.log_time for message in reader.messages()] == list(range(60))
        some = list(reader.messages(["/b/c"], 10, 40))
        assert [m.log_time for m in some] == [n for n in range(10, 40) if n * 43 % 60 % 3 == 1]
        assert reader.counts == dict.fromkeys(TOPICS, 20)
        assert reader.topics["/d"].schema_text == "uint8[] bytes\n"


def test_bag_written_by_rosbags_is_read(
    tmp_path: Path,
    typestore: object,
    joint_state: Callable[[int, list[float]], bytes],
) -> None:
    from rosbags.rosbag2 import StoragePlugin

    with RosbagsWriter(tmp_path / "other", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            "/joint_states", "sensor_msgs/msg/JointState", typestore=typestore
        )
        writer.write(connection, 5, joint_state(5, [0.25]))
    with BagReader(tmp_path / "other") as reader:
        ((message, decoded),) = reader.decoded()
        assert message.log_time == 5
        assert decoded.position == [0.25]


def test_messages_are_decoded_with_the_definitions_in_the_bag(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
    clock: Callable[[int], bytes],
) -> None:
    qos = QosProfile(reliability="best_effort")
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(topic("/joint_states", "sensor_msgs/msg/JointState", qos))
        writer.add_topic(topic("/clock", "rosgraph_msgs/msg/Clock"))
        writer.write("/joint_states", joint_state(7, [0.5, -1]), 7, 7)
        writer.write("/clock", clock(9_000_000_001), 8, 8)
        writer.write("/clock", b"\0\1\0\0\1", 9, 9)
    with BagReader(tmp_path / "walk") as reader:
        assert reader.topics["/joint_states"].qos_profiles == (qos,)
        found = reader.decoded()
        state = next(found)[1]
        assert (state.name, state.position) == (["l_hip", "r_hip"], [0.5, -1])
        assert next(found)[1].clock.sec == 9
        with pytest.raises(UnreadableBagError, match="/clock: not a rosgraph_msgs/msg/Clock"):
            next(found)


def test_a_reader_knows_what_is_in_the_bag(small_bag: Path) -> None:
    with BagReader(small_bag) as bag:
        assert {name: topic.type for name, topic in bag.topics.items()} == {
            "/a": "p/msg/C",
            "/b": "p/msg/C",
        }
        assert bag.counts == {"/a": 3, "/b": 1}
        assert (bag.start, bag.end, bag.message_count) == (1, 4, 4)
        assert bag.custom_data == {"key": "value"}
        assert bag.ros_distro == "jazzy"
        assert bag.size == (small_bag / "small_0.mcap").stat().st_size


def test_counts_and_single_topics_read_no_unneeded_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with BagWriter(tmp_path / "walk", ros_distro="jazzy", chunk_size=1000) as writer:
        writer.add_topic(topic_named("/a"))
        writer.add_topic(topic_named("/d"))
        for number in range(1000):
            writer.write("/a", bytes(100), number, number)
        writer.flush()
        writer.write("/d", b"rare", 2000, 2000)
    opened = []
    read_chunk = McapFile.chunk_data

    def count(file: McapFile, chunk: object) -> bytes:
        opened.append(chunk)
        return read_chunk(file, chunk)  # type: ignore[arg-type]

    monkeypatch.setattr(McapFile, "chunk_data", count)
    with BagReader(tmp_path / "walk") as reader:
        assert reader.message_count == 1001
        assert opened == []
        assert [message.data for message in reader.messages(["/d"])] == [b"rare"]
    assert len(opened) == 1


def test_chunks_are_read_as_they_are_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with BagWriter(tmp_path / "walk", ros_distro="jazzy", chunk_size=1000) as writer:
        writer.add_topic(topic_named("/a"))
        for number in range(1000):
            writer.write("/a", bytes(100), number ^ 1, number)  # chunks overlap a little
    opened = 0
    read_chunk = McapFile.chunk_data

    def count(file: McapFile, chunk: object) -> bytes:
        nonlocal opened
        opened += 1
        return read_chunk(file, chunk)  # type: ignore[arg-type]

    monkeypatch.setattr(McapFile, "chunk_data", count)
    ahead = 0
    with BagReader(tmp_path / "walk") as reader:
        for number, message in enumerate(reader.messages()):
            assert message.log_time == number
            ahead = max(ahead, opened - number * 131 // 1000)
    assert opened > 100
    assert ahead <= 4


def test_missing_topics_are_named(small_bag: Path) -> None:
    with BagReader(small_bag) as reader, pytest.raises(BagError, match="no topic /x, /y"):
        list(reader.messages(["/a", "/y", "/x"]))


def not_a_bag(tmp_path: Path, kind: str) -> Path:
    path = tmp_path / kind
    if kind == "empty file":
        path.write_bytes(b"")
    elif kind == "text":
        path.write_text("stride,period\n1,1.9\n" * 100)
    elif kind == "magic only":
        path.write_bytes(b"\x89MCAP0\r\n")
    elif kind == "zeros":
        path.write_bytes(bytes(10_000))
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "empty folder":
        path.mkdir()
    elif kind == "sqlite":
        path.mkdir()
        (path / "metadata.yaml").write_text(
            "rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n"
        )
    elif kind == "sqlite alone":
        path.mkdir()
        (path / "a_0.db3").touch()
    elif kind == "folder of bags":
        for name in ("b", "a"):
            (path / name).mkdir(parents=True)
            (path / name / f"{name}_0.mcap").touch()
    elif kind == "file compressed":
        path.mkdir()
        (path / "metadata.yaml").write_text(
            "rosbag2_bagfile_information:\n  relative_file_paths: [a_0.mcap.zstd]\n"
        )
    elif kind == "messages compressed":
        path.mkdir()
        (path / "metadata.yaml").write_text(
            "rosbag2_bagfile_information:\n  relative_file_paths: [a_0.mcap]\n"
            "  compression_mode: message\n"
        )
    elif kind == "file missing":
        path.mkdir()
        (path / "metadata.yaml").write_text(
            "rosbag2_bagfile_information:\n  relative_file_paths: [../../a_0.mcap]\n"
        )
    return path


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("nothing", "no such file"),
        ("empty file", "is empty"),
        ("text", "is not an MCAP file"),
        ("magic only", "at byte 8"),
        ("zeros", "is not an MCAP file"),
        ("pipe", "no such file"),
        ("empty folder", "no MCAP file"),
        ("sqlite", "stored as sqlite3"),
        ("sqlite alone", "stored as sqlite3"),
        ("folder of bags", "no MCAP file in this folder, but it contains bags: a, b"),
        ("file compressed", "compressed as a whole"),
        ("messages compressed", "compressed message by message.*ros2 bag convert"),
        ("file missing", "file missing/a_0.mcap: no such file"),
    ],
)
def test_a_path_that_is_not_a_bag_is_reported(tmp_path: Path, kind: str, reason: str) -> None:
    path = not_a_bag(tmp_path, kind)
    with pytest.raises(UnreadableBagError, match=reason) as caught:
        BagReader(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("other", "refused"), [("int32 x # [m]\n\n", False), ("float32 x\n", True)]
)
def test_a_topic_with_two_conflicting_definitions_is_refused(
    tmp_path: Path, other: str, refused: bool
) -> None:
    path = tmp_path / "merged.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        for number, text in enumerate(("int32 x\n", other)):
            schema = writer.register_schema("p/msg/T", "ros2msg", text.encode())
            channel = writer.register_channel("/a", "cdr", schema, {"number": str(number)})
            writer.add_message(channel, number, bytes([0, 1, 0, 0, number, 0, 0, 0]), number)
        writer.finish()
    if refused:
        with pytest.raises(UnreadableBagError, match="/a has two definitions of p/msg/T"):
            BagReader(path)
        assert "one-type" in [finding.rule for finding in check(path)]
        assert "/a has two definitions" in recover(path, tmp_path / "rescued").losses[0]
    else:
        with BagReader(path) as reader:
            assert [message.x for _, message in reader.decoded()] == [0, 1]


def test_a_definition_that_contains_itself_is_reported(
    capfd: pytest.CaptureFixture[str],
) -> None:
    decode = decoder_for(TopicInfo("/a", "p/msg/T", "T again\n"))
    with pytest.raises(UnreadableBagError, match="/a: not a p/msg/T in CDR"):
        decode(bytes([0, 1, 0, 0]))
    with pytest.raises(BagError, match="/a: the definition of p/msg/T cannot be used"):
        decoder_for(TopicInfo("/a", "p/msg/T", "int32 x y z\n"))
    assert capfd.readouterr().err == ""


def test_a_file_listed_twice_is_read_once(small_bag: Path, tmp_path: Path) -> None:
    (tmp_path / "small_0.mcap").write_bytes((small_bag / "small_0.mcap").read_bytes())
    listed = "{relative_file_paths: [small_0.mcap, small_0.mcap]}"
    (tmp_path / "metadata.yaml").write_text(f"rosbag2_bagfile_information: {listed}\n")
    with BagReader(tmp_path) as reader:
        assert len([*reader.messages()]) == reader.message_count == 4


def test_bag_with_a_broken_metadata_file_can_be_read(small_bag: Path, tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in (0, 10, 2):
        data = (small_bag / "small_0.mcap").read_bytes()
        (folder / f"bag_{number}.mcap").write_bytes(data)
    (folder / "metadata.yaml").write_text(": [")
    with BagReader(folder) as reader:
        assert reader.message_count == 12
        assert [path.name for path in reader.files] == [
            "bag_0.mcap",
            "bag_2.mcap",
            "bag_10.mcap",
        ]
