# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from gait_entrainment.gait import Verdict
from gait_entrainment_bags import (
    BagExistsError,
    BagReader,
    BagWriter,
    QosProfile,
    TopicInfo,
    UnreadableBagError,
    check,
    recover,
)
from gait_entrainment_bags.mcap_file import McapFile
from gait_entrainment_bags.mcap_records import Chunk
from gait_entrainment_bags.recorded_run import read_run, recorded_outcome

PAPER_EXAMPLE = Path(__file__).parents[4] / "bags" / "paper_example"

NOISE = TopicInfo("/noise", "p/msg/Noise", "uint8[] bytes\n", "RIHS01_" + "1" * 64)

RECORDER = """
import os, sys
from gait_entrainment_bags import BagWriter, TopicInfo

folder, chunk_size = sys.argv[1], int(sys.argv[2])
writer = BagWriter(folder, ros_distro="jazzy", custom_data={"seed": "3"}, chunk_size=chunk_size)
writer.add_topic(TopicInfo("/noise", "p/msg/Noise", "uint8[] bytes", "RIHS01_" + "1" * 64))
print("ready", flush=True)
number = 0
while True:
    for _ in range(50):
        number += 1
        writer.write("/noise", bytes([0, 1, 0, 0]) + os.urandom(40), number, number)
    writer.flush()
    os.write(1, b"%d\\n" % number)
"""


@pytest.mark.parametrize("chunk_size", [500, 2**20])
def test_killed_recording_loses_nothing_that_was_flushed(tmp_path: Path, chunk_size: int) -> None:
    draw = random.Random(chunk_size)
    for trial in range(8):
        folder = tmp_path / f"walk{trial}"
        with subprocess.Popen(
            [sys.executable, "-c", RECORDER, folder, str(chunk_size)], stdout=subprocess.PIPE
        ) as recorder:
            assert recorder.stdout is not None
            assert recorder.stdout.readline() == b"ready\n"
            flushed = 0
            for _ in range(draw.randrange(60)):
                flushed = int(recorder.stdout.readline())
            recorder.kill()
            last_words = recorder.stdout.read().split()
        flushed = max([flushed, *(int(word) for word in last_words[:-1])])

        with pytest.raises(UnreadableBagError, match="entrain bag recover"):
            BagReader(folder)
        rescued = recover(folder, tmp_path / f"rescued{trial}")

        assert rescued.losses
        assert check(rescued.folder) == []
        with BagReader(rescued.folder) as reader:
            found = [message.log_time for message in reader.messages()]
            assert reader.custom_data["seed"] == "3"
            assert "never closed" in reader.custom_data["recovery"]
            assert reader.ros_distro == "jazzy"
        assert found == list(range(1, len(found) + 1))
        assert len(found) >= flushed
        assert rescued.last == len(found)
        # Only the bag itself is left behind.
        assert sorted(path.name for path in folder.iterdir() if path.suffix != ".tmp") == [
            "metadata.yaml",
            f"walk{trial}_0.mcap",
        ]


def record_chunks(folder: Path, compression: str) -> tuple[Path, list[Chunk], list[int]]:
    """Record small chunks; return the file, its chunks, and the messages in each."""
    with BagWriter(folder, ros_distro="jazzy", chunk_size=300, compression=compression) as writer:
        writer.add_topic(NOISE)
        for number in range(40):
            writer.write("/noise", bytes(40), number, number)
    path = folder / "walk_0.mcap"
    file = McapFile(path)
    chunks = file.scan().chunks
    counts = [len(file.messages(chunk, 0, {1: "/noise"})) for chunk in chunks]
    file.close()
    return path, chunks, counts


def test_every_complete_chunk_of_a_truncated_recording_is_rescued(tmp_path: Path) -> None:
    path, chunks, counts = record_chunks(tmp_path / "walk", "zstd")
    assert len(chunks) > 5
    for number in reversed(range(len(chunks))):
        end = chunks[number].offset + chunks[number].length
        for length, complete in ((end + 1, number + 1), (end, number + 1), (end - 1, number)):
            with path.open("r+b") as stream:
                stream.truncate(length)
            out = tmp_path / f"rescued{length}"
            found = recover(path, out)
            assert sum(found.counts.values()) == sum(counts[:complete])
            assert found.losses
            shutil.rmtree(out)


def test_intact_bag_loses_nothing(small_bag: Path, tmp_path: Path) -> None:
    found = recover(small_bag, tmp_path / "copy")
    assert found.counts == {"/a": 3, "/b": 1}
    assert (found.losses, found.last) == ((), 4)
    with BagReader(small_bag) as before, BagReader(tmp_path / "copy") as after:
        assert [m[0:1] + m[2:] for m in before.messages()] == [
            m[0:1] + m[2:] for m in after.messages()
        ]
        assert after.topics == before.topics
        assert after.custom_data == {
            "key": "value",
            "recovery": "made of small; nothing is missing",
        }
    assert check(tmp_path / "copy") == []


def test_damage_loses_only_the_damaged_chunk(small_bag: Path, tmp_path: Path) -> None:
    file = McapFile(small_bag / "small_0.mcap")
    first, second = file.scan().chunks
    data = bytearray((small_bag / "small_0.mcap").read_bytes())
    file.close()
    path = tmp_path / "damaged.mcap"
    for chunk, place, left in (
        (first, chunk_middle(first), [3, 4]),  # the first chunk announces the topics
        (second, chunk_middle(second), [1, 2]),
        (first, first.offset + 5, [3, 4]),  # its length points beyond the end of the file
    ):
        data[place] ^= 0xFF
        path.write_bytes(data)
        data[place] ^= 0xFF
        out = tmp_path / f"rescued{place}"
        found = recover(path, out)
        assert any(f"at byte {chunk.offset}" in loss for loss in found.losses)
        assert "2 of 4 messages are lost" in found.losses[-1]
        with BagReader(out) as reader:
            assert [message.log_time for message in reader.messages()] == left


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_broken_length_in_an_unfinished_file_loses_one_chunk(
    tmp_path: Path, compression: str
) -> None:
    path, chunks, counts = record_chunks(tmp_path / "walk", compression)
    unfinished = path.read_bytes()[: chunks[-1].offset + chunks[-1].length]  # as after a crash
    for place in (3, 8):  # in the length, which then points far beyond the end of the file
        data = bytearray(unfinished)
        data[chunks[2].offset + place] ^= 0x41
        path.write_bytes(data)
        out = tmp_path / f"rescued{place}"
        found = recover(path, out)
        assert any(f"at byte {chunks[2].offset}" in loss for loss in found.losses)
        assert sum(found.counts.values()) == sum(counts) - counts[2]


def chunk_middle(chunk: object) -> int:
    return int(chunk.offset + chunk.length - 10)  # type: ignore[attr-defined]


def test_files_of_a_split_recording_are_joined(tmp_path: Path) -> None:
    folder = tmp_path / "walk"
    with BagWriter(folder, ros_distro="jazzy", chunk_size=100, max_duration=10e-9) as writer:
        writer.add_topic(NOISE)
        for number in range(40):
            writer.write("/noise", bytes(40), number, number)
    (folder / "walk_1.mcap").write_bytes(b"")
    found = recover(folder, tmp_path / "rescued")
    assert any("walk_1.mcap: is empty" in loss for loss in found.losses)
    assert found.counts == {"/noise": 29}
    assert check(tmp_path / "rescued") == []


def test_rescue_overwrites_nothing_and_reports_what_is_not_a_bag(
    small_bag: Path, tmp_path: Path
) -> None:
    with pytest.raises(BagExistsError):
        recover(small_bag, small_bag)
    named = tmp_path / "\udcff"  # a name that is not UTF-8
    named.symlink_to(small_bag)
    recover(named, tmp_path / "renamed")
    with BagReader(tmp_path / "renamed") as bag:
        assert bag.custom_data["recovery"] == r"made of \udcff; nothing is missing"
    (tmp_path / "text.mcap").write_text("no bag")
    with pytest.raises(UnreadableBagError, match="not an MCAP file"):
        recover(tmp_path / "text.mcap", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_topic_without_a_valid_type_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        for name in ("/nameless", "/noise"):
            schema = writer.register_schema(name.replace("/noise", NOISE.type), "ros2msg", b"")
            writer.add_message(writer.register_channel(name, "cdr", schema), 1, b"", 1)
        writer.finish()
    found = recover(path, tmp_path / "rescued")
    assert found.counts == {"/noise": 1}
    (loss,) = found.losses
    assert loss == "/nameless: lost: its type '/nameless' does not read package/msg/Type"


def test_topics_of_one_type_keep_their_own_definitions(tmp_path: Path) -> None:
    texts = {"/old": "int32 x\n", "/new": "float32 x\n"}
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        for name, text in texts.items():
            writer.add_topic(TopicInfo(name, "p/msg/T", text))
    recover(tmp_path / "walk", tmp_path / "rescued")
    with BagReader(tmp_path / "rescued") as reader:
        assert {name: topic.schema_text for name, topic in reader.topics.items()} == texts


def test_qos_and_hash_survive(tmp_path: Path, topic: Callable[..., TopicInfo]) -> None:
    odd = QosProfile(history="keep_all", durability="transient_local", lifespan=5)
    before = topic("/clock", "rosgraph_msgs/msg/Clock", odd, QosProfile())
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(before)
    recover(tmp_path / "walk", tmp_path / "rescued")
    with BagReader(tmp_path / "rescued") as reader:
        assert reader.topics == {"/clock": before}


def write_foreign(path: Path) -> None:
    """Write a file with a JSON topic, one without a definition, and a binary definition."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "test")
        for topic, encoding, schema in (
            ("/json", "json", ("Cadence", "jsonschema", b'{"type": "object"}')),
            ("/plain", "json", None),
            ("/binary", "protobuf", ("a.B", "protobuf", bytes(range(256)))),
            ("/ros", "cdr", ("p/msg/Good", "ros2msg", b"uint8 x\n")),
        ):
            number = writer.register_schema(*schema) if schema else 0
            channel = writer.register_channel(topic, encoding, number)
            writer.add_message(channel, 5, b"{}", 5)
        writer.finish()


def test_encodings_and_definitions_stay_as_they_are(tmp_path: Path) -> None:
    write_foreign(tmp_path / "foreign.mcap")
    rescued = recover(tmp_path / "foreign.mcap", tmp_path / "rescued")
    assert rescued.losses == ()
    (file,) = rescued.folder.glob("*.mcap")
    found = []
    for path in (tmp_path / "foreign.mcap", file):
        with path.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        assert summary is not None
        schemas = {s.id: (s.name, s.encoding, s.data) for s in summary.schemas.values()}
        found.append(
            {
                c.topic: (c.message_encoding, schemas.get(c.schema_id))
                for c in summary.channels.values()
            }
        )
    assert found[0] == found[1]


def without(bag: Path, out: Path, begin: float, end: float) -> Path:
    """Copy a bag without the messages logged between two times [s since its start]."""
    with BagReader(bag) as reader, BagWriter(out, ros_distro="") as writer:
        writer.custom_data |= reader.custom_data
        for topic in reader.topics.values():
            writer.add_topic(topic)
        for message in reader.messages():
            if not begin <= (message.log_time - reader.start) / 1e9 < end:
                writer.write(message.topic, message.data, message.log_time, message.publish_time)
    return out


@pytest.mark.parametrize(
    ("begin", "end", "missing"),
    [
        (80.0, 82.0, "4 gait events"),
        (80.0, 82.0, "/joint_states: "),
        (0.0, 40.0, "torque profiles"),
        (100.0, 1000.0, "the end of run"),
    ],
)
def test_what_the_run_lacks_is_reported(
    tmp_path: Path, begin: float, end: float, missing: str
) -> None:
    cut = without(PAPER_EXAMPLE, tmp_path / "cut", begin, end)
    rescued = recover(cut, tmp_path / "rescued")
    assert missing in "; ".join(rescued.losses)
    assert [finding.rule for finding in check(cut)] == ["record"]
    run = read_run(cut)
    outcome = recorded_outcome(run, cut)
    assert outcome["holes"]
    assert outcome["lost"] != 0 or end > 200, "the counts at the end of the run show it"
    assert recorded_outcome(read_run(rescued.folder), cut)["lost"] != 0
    assert run.analysis.entrainments[-1].verdict not in (Verdict.LOST, Verdict.DRIFTING)
