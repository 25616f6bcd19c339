# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import errno
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import QosDurability, QosHistory, QosReliability
from rosbags.rosbag2 import Reader

from gait_entrainment_bags import (
    BagError,
    BagExistsError,
    BagReader,
    BagWriteError,
    BagWriter,
    DiskFullError,
    QosProfile,
    TopicInfo,
    check,
    recover,
)
from gait_entrainment_bags import writer as writer_module
from gait_entrainment_bags.chunk_writer import ChunkWriter

ODD_QOS = QosProfile(
    history="unknown",
    depth=0,
    reliability="best_effort",
    durability="transient_local",
    deadline=1_500_000_000,
)
NOISE = TopicInfo("/noise", "p/msg/Noise", "uint8[] bytes\n", "RIHS01_" + "1" * 64)


def write_joint_states(
    folder: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
    count: int = 50,
    **options: Any,
) -> list[bytes]:
    datas = [joint_state(10**18 + n, [n, n / 7, -n, 0.1]) for n in range(count)]
    with BagWriter(folder, ros_distro="jazzy", **options) as writer:
        writer.add_topic(topic("/joint_states", "sensor_msgs/msg/JointState", ODD_QOS))
        writer.add_topic(topic("/clock", "rosgraph_msgs/msg/Clock", QosProfile(), ODD_QOS))
        for number, data in enumerate(datas):
            writer.write("/joint_states", data, 10**18 + number, 10**18 + 2 * number)
    return datas


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_rosbags_reads_the_whole_bag(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
    typestore: Any,
    compression: str,
) -> None:
    folder = tmp_path / "walk"
    datas = write_joint_states(
        folder,
        topic,
        joint_state,
        compression=compression,
        chunk_size=1000,
        custom_data={"protocol": "name: 'walk'\n# ü\n", "seed": "007"},
    )
    assert sorted(path.name for path in folder.iterdir()) == ["metadata.yaml", "walk_0.mcap"]
    with Reader(folder) as reader:
        assert reader.storage.metadata.custom == {"protocol": "name: 'walk'\n# ü\n", "seed": "007"}
        assert reader.ros_distro == "jazzy"
        assert (reader.start_time, reader.duration) == (10**18, 50)
        connections = {connection.topic: connection for connection in reader.connections}
        assert connections["/clock"].msgcount == 0
        states = connections["/joint_states"]
        assert states.msgcount == 50
        assert states.digest == topic("/j", "sensor_msgs/msg/JointState").type_hash
        (qos,) = states.ext.offered_qos_profiles
        assert qos.history is QosHistory.UNKNOWN
        assert qos.reliability is QosReliability.BEST_EFFORT
        assert qos.durability is QosDurability.TRANSIENT_LOCAL
        assert (qos.deadline.sec, qos.deadline.nsec) == (1, 500_000_000)
        assert len(connections["/clock"].ext.offered_qos_profiles) == 2
        found = list(reader.messages())
    assert [data for _, _, data in found] == datas
    assert [time for _, time, _ in found] == [10**18 + n for n in range(50)]
    last = typestore.deserialize_cdr(datas[-1], "sensor_msgs/msg/JointState")
    assert list(last.position) == [49, 7, -49, 0.1]


def test_mcap_library_decodes_with_the_definitions_in_the_bag(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
) -> None:
    write_joint_states(tmp_path / "walk", topic, joint_state, chunk_size=1000)
    with (tmp_path / "walk" / "walk_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        found = list(reader.iter_decoded_messages())
        assert [entry.decoded_message.position[1] for entry in found] == [n / 7 for n in range(50)]
        assert {entry.message.sequence for entry in found} == {0}
        assert found[3].message.publish_time == 10**18 + 6
        assert found[3].decoded_message.header.stamp.nanosec == 3
        records = list(reader.iter_metadata())
        assert [record.name for record in records] == ["rosbag2", "rosbag2"]  # open and close
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.chunk_count > 5


@pytest.mark.parametrize("compression", ["zstd", "none"])
def test_files_equal_those_of_the_mcap_library_byte_for_byte(
    tmp_path: Path, compression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = []
    for folder, kind in (("ours", ChunkWriter), ("theirs", Writer)):
        monkeypatch.setattr(writer_module, "ChunkWriter", kind)
        bag = tmp_path / folder / "bag"
        bag.parent.mkdir()
        with BagWriter(bag, ros_distro="jazzy", chunk_size=3000, compression=compression) as w:
            for number in range(300):
                name = f"/noise_{number // 100}"  # announced between messages
                if number % 100 == 0:
                    w.add_topic(replace(NOISE, name=name))
                # Log times that go backwards, within a chunk and across chunks.
                w.write(name, bytes(number), 10**18 + number * 7 % 90, 10**18 + number)
        written.append((bag / "bag_0.mcap").read_bytes())
    assert written[0] == written[1]


def test_folder_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "walk").mkdir()
    (tmp_path / "walk" / "precious").write_text("data")
    with pytest.raises(BagExistsError, match="already exists"):
        BagWriter(tmp_path / "walk", ros_distro="jazzy")
    assert [path.name for path in (tmp_path / "walk").iterdir()] == ["precious"]


def test_folder_that_cannot_be_created_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BagWriteError, match="file/walk"):
        BagWriter(tmp_path / "file" / "walk", ros_distro="jazzy")


@pytest.mark.parametrize(
    "options", [{"compression": "gzip"}, {"chunk_size": 0}, {"max_duration": float("nan")}]
)
def test_options_out_of_range_create_no_folder(tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(BagError):
        BagWriter(tmp_path / "walk", ros_distro="jazzy", **options)
    assert not (tmp_path / "walk").exists()


def test_wrong_calls_are_reported_and_lose_no_data(tmp_path: Path) -> None:
    folder = tmp_path / "walk"
    with BagWriter(folder, ros_distro="jazzy") as writer:
        writer.add_topic(NOISE)
        with pytest.raises(BagError, match="already in the bag"):
            writer.add_topic(NOISE)
        with pytest.raises(BagError, match="type 'p/X' does not read package/msg/Type"):
            writer.add_topic(TopicInfo("/x", "p/X", "uint8 x\n"))
        with pytest.raises(BagError, match="/y: not announced"):
            writer.write("/y", b"", 1, 1)
        writer.write("/noise", b"\0\1\0\0", 1, 1)
        for log_time, publish_time in ((-1, 1), (1, -1), (2**64, 1), (1, 2**64)):
            with pytest.raises(BagError, match="/noise: a time is outside"):
                writer.write("/noise", b"\0\1\0\0", log_time, publish_time)
        writer.write("/noise", b"\0\1\0\0", 2**64 - 1, 0)
        assert writer.counts == {"/noise": 2}
    with pytest.raises(BagWriteError, match="closed"):
        writer.write("/noise", b"\0\1\0\0", 1, 1)
    writer.close()
    with BagReader(folder) as reader:
        assert [message.log_time for message in reader.messages()] == [1, 2**64 - 1]


def test_custom_data_can_be_added_until_the_bag_is_closed(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "walk", ros_distro="jazzy", custom_data={"a": "1"}) as writer:
        writer.custom_data["lost"] = "0"
    with BagReader(tmp_path / "walk") as reader:
        assert reader.custom_data == {"a": "1", "lost": "0"}
    with Reader(tmp_path / "walk") as other:
        assert other.storage.metadata.custom == {"a": "1", "lost": "0"}


@pytest.mark.parametrize("options", [{"max_bytes": 3000}, {"max_duration": 10e-9}])
def test_long_recordings_are_split(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
    options: dict[str, Any],
) -> None:
    folder = tmp_path / "walk"
    datas = write_joint_states(folder, topic, joint_state, chunk_size=500, **options)
    files = sorted(path.name for path in folder.glob("*.mcap"))
    assert len(files) >= 4
    assert "walk_1.mcap" in files
    assert check(folder) == []
    with BagReader(folder) as reader:
        assert [message.data for message in reader.messages()] == datas
    with Reader(folder) as other:
        assert [data for _, _, data in other.messages()] == datas


def test_a_chunk_reaches_the_file_a_second_after_its_first_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0
    monkeypatch.setattr(writer_module.time, "monotonic_ns", lambda: now)
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(NOISE)
        size = (tmp_path / "walk" / "walk_0.mcap").stat().st_size
        for now, grown in (
            (5 * 10**9, False),  # the first message after a silence starts the second
            (5_999_999_999, False),
            (6_000_000_000, True),
            (6_500_000_000, False),
            (7_499_999_999, False),
            (7_500_000_000, True),
        ):
            writer.write("/noise", b"\0\1\0\0", now, now)
            new = (tmp_path / "walk" / "walk_0.mcap").stat().st_size
            assert (new > size) is grown
            size = new


def test_metadata_names_every_topic_before_the_bag_is_closed(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "walk", ros_distro="jazzy", custom_data={"seed": "1"}) as writer:
        writer.add_topic(NOISE)
        text = (tmp_path / "walk" / "metadata.yaml").read_text()
        assert "name: /noise" in text
        assert "seed: '1'" in text


class SimulatedDisk:
    """A disk of limited size; reserved space counts as used until it is released."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, size: int) -> None:
        self.size = size
        self._real_write = os.write
        disk = self

        class File:
            def __init__(self, path: Path) -> None:
                self._file = path.open("xb", buffering=0)

            def write(self, data: memoryview) -> int:
                used = self._file.tell() + (0 if disk.reserve is None else disk.reserve)
                room = disk.size - used
                if room <= 0:
                    raise OSError(errno.ENOSPC, "No space left on device")
                return self._file.write(data[:room])

            def fileno(self) -> int:
                return self._file.fileno()

            def close(self) -> None:
                self._file.close()

        self.reserve: int | None = None

        class Reserve:
            def __init__(self, **_: Any) -> None:
                self._file = Path(os.devnull).open("rb")  # noqa: SIM115

            def fileno(self) -> int:
                return self._file.fileno()

            def close(self) -> None:
                disk.reserve = None
                self._file.close()

        def put_aside(_: int, __: int, length: int) -> None:
            if length > disk.size:
                raise OSError(errno.ENOSPC, "No space left on device")
            self.reserve = length

        monkeypatch.setattr(writer_module, "_open_new", File)
        monkeypatch.setattr(writer_module.tempfile, "TemporaryFile", Reserve)
        monkeypatch.setattr(writer_module.os, "posix_fallocate", put_aside)


def fill(folder: Path, chunk_size: int = 20_000) -> tuple[int, str]:
    """Record noise until the disk is full; return the number of messages and the error message."""
    count = 0
    writer = BagWriter(folder, ros_distro="jazzy", chunk_size=chunk_size)
    writer.add_topic(NOISE)
    while count < 100_000:
        count += 1
        try:
            writer.write("/noise", b"\0\1\0\0" + os.urandom(1000), count, count)
        except DiskFullError as error:
            writer.close()
            return count, str(error)
    raise AssertionError("the disk never filled up")


def test_full_disk_leaves_a_complete_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    SimulatedDisk(monkeypatch, 3_000_000)
    count, message = fill(tmp_path / "walk")
    assert message.startswith(str(tmp_path / "walk"))
    assert f"disk full after {count} messages" in message
    assert count > 1000
    assert check(tmp_path / "walk") == []
    with BagReader(tmp_path / "walk") as reader:
        assert [message.log_time for message in reader.messages()] == list(range(1, count + 1))


def test_full_disk_without_reserved_space_leaves_a_recoverable_bag(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsupported(*_: int) -> None:
        raise OSError(errno.EOPNOTSUPP, "not supported")

    SimulatedDisk(monkeypatch, 300_000)
    monkeypatch.setattr(writer_module.os, "posix_fallocate", unsupported)
    count, message = fill(tmp_path / "walk")
    assert "entrain bag recover" in message
    monkeypatch.undo()
    rescued = recover(tmp_path / "walk", tmp_path / "rescued")
    assert count - 20 <= rescued.counts["/noise"] < count


def test_disk_full_from_the_start_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    SimulatedDisk(monkeypatch, 1000)
    with pytest.raises(DiskFullError, match="disk full"):
        BagWriter(tmp_path / "walk", ros_distro="jazzy")
    assert list(tmp_path.iterdir()) == []


def test_other_disk_errors_are_not_reported_as_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = BagWriter(tmp_path / "walk", ros_distro="jazzy")
    writer.add_topic(NOISE)

    def broken(_: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    writer.write("/noise", b"\0\1\0\0", 1, 1)
    monkeypatch.setattr(writer_module.os, "fsync", broken)
    with pytest.raises(BagWriteError, match="Input/output error") as caught:
        writer.close()
    assert not isinstance(caught.value, DiskFullError)
    monkeypatch.undo()
    assert recover(tmp_path / "walk", tmp_path / "rescued").counts == {"/noise": 1}


def test_disk_failure_in_the_background_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(writer_module.os, "fdatasync", broken)
    writer = BagWriter(tmp_path / "walk", ros_distro="jazzy")
    writer.add_topic(NOISE)
    writer.write("/noise", b"\0\1\0\0", 1, 1)
    writer.flush()
    assert writer._file._synced is not None
    assert isinstance(writer._file._synced.exception(), OSError)
    writer.write("/noise", b"\0\1\0\0", 2, 2)
    with pytest.raises(BagWriteError, match="Input/output error"):
        writer.flush()
    monkeypatch.undo()
    assert recover(tmp_path / "walk", tmp_path / "rescued").counts == {"/noise": 2}


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a real file system of 4 MB, or simulate one if mounting is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = (
        shutil.which("mount")
        and not subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", place],
            capture_output=True,
            check=False,
        ).returncode
    )
    if not mounted:
        with pytest.MonkeyPatch.context() as monkeypatch:
            SimulatedDisk(monkeypatch, 4 * 2**20)
            yield place
        return
    yield place
    subprocess.run(["umount", place], check=True)


def test_real_small_disk_leaves_a_complete_bag(small_disk: Path) -> None:
    count, message = fill(small_disk / "walk")
    assert f"disk full after {count} messages" in message
    assert check(small_disk / "walk") == []
    with BagReader(small_disk / "walk") as reader:
        assert reader.message_count == count
