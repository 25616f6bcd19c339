# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Reading a damaged bag gives data or a reported error, never a traceback or a hang."""

import contextlib
import os
import shutil
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from gait_entrainment_bags import BagReader, UnreadableBagError, check, recover

ALL = [1, 2, 3, 4]


def read(path: Path) -> list[int] | None:
    """Return the log times in a bag, or None if it is reported as unreadable."""
    try:
        with BagReader(path) as reader:
            found = [message.log_time for message in reader.messages()]
            some = [message.log_time for message in reader.messages(reader.topics.keys() & {"/b"})]
            assert some == [2] or "/b" not in reader.topics
            return found
    except UnreadableBagError as error:
        text = str(error)
    assert str(path) in text
    assert "\n" not in text
    return None


def test_file_cut_at_every_length(small_bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    shutil.copy(small_bag / "small_0.mcap", path)
    for length in reversed(range(path.stat().st_size)):
        os.truncate(path, length)
        assert read(path) is None
        assert any(finding.rule in ("closed", "mcap") for finding in check(path))


def test_every_byte_flipped(small_bag: Path, tmp_path: Path) -> None:
    path = tmp_path / "flipped.mcap"
    shutil.copy(small_bag / "small_0.mcap", path)
    with path.open("r+b", buffering=0) as file:
        for offset, byte in enumerate(path.read_bytes()):
            os.pwrite(file.fileno(), bytes([byte ^ 0xFF]), offset)
            # Either an error or all of the messages, never silently fewer.
            assert read(path) in (None, ALL)
            assert check(path) != [], f"byte {offset}"
            os.pwrite(file.fileno(), bytes([byte]), offset)


def test_every_byte_of_the_metadata_file_flipped(small_bag: Path, tmp_path: Path) -> None:
    folder = tmp_path / "small"
    folder.mkdir()
    (folder / "small_0.mcap").write_bytes((small_bag / "small_0.mcap").read_bytes())
    data = bytearray((small_bag / "metadata.yaml").read_bytes())
    for offset in range(len(data)):
        data[offset] ^= 0x15
        (folder / "metadata.yaml").write_bytes(data)
        data[offset] ^= 0x15
        # Both are slow and read the file with the same function, so each gets half the bytes.
        if offset % 2:
            check(folder)
        else:
            with contextlib.suppress(UnreadableBagError):
                BagReader(folder).close()


def test_message_that_reaches_beyond_its_chunk(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE, enable_crcs=False)
        writer.start("ros2")
        schema = writer.register_schema("p/msg/Noise", "ros2msg", b"uint8[] bytes\n")
        channels = [writer.register_channel(name, "cdr", schema) for name in ("/a", "/b")]
        for number, channel in enumerate(channels):
            writer.add_message(channel, number, b"marked%d" % number, number)
        writer.finish()
    data = bytearray(path.read_bytes())
    data[data.index(b"marked1") - 22 - 8] += 1  # the length of its record
    path.write_bytes(data)
    for topics in (None, ["/b"]):
        with BagReader(path) as reader, pytest.raises(UnreadableBagError, match="chunk"):
            list(reader.messages(topics))


@pytest.mark.parametrize("kind", ["schema", "channel"])
def test_one_id_for_two_schemas_or_channels(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, use_chunking=False, enable_crcs=False, use_statistics=False)
        writer.start("ros2")
        for number, text in enumerate((b"int32 x\n", b"float32 y\n"), start=1):
            schema = writer.register_schema("p/msg/T", "ros2msg", text)
            channel = writer.register_channel(f"/{number}", "cdr", schema)
            writer.add_message(channel, number, bytes(8), number)
        writer.finish()
    data = path.read_bytes()
    if kind == "schema":
        data = data.replace(b"\2\0\7\0\0\0p/msg/T", b"\1\0\7\0\0\0p/msg/T")
    else:
        data = data.replace(b"\2\0\2\0\2\0\0\0/2", b"\1\0\2\0\2\0\0\0/2")
    path.write_bytes(data)
    with pytest.raises(UnreadableBagError, match=f"{kind} 1 appears twice, with different"):
        BagReader(path)
    assert "intact" in [finding.rule for finding in check(path)]
    assert f"{kind} 1 appears twice" in recover(path, tmp_path / "rescued").losses[0]


@settings(derandomize=True, deadline=None, max_examples=150)
@given(data=st.data())
def test_bytes_replaced_at_random(
    small_bag: Path, tmp_path_factory: object, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("damaged")  # type: ignore[attr-defined]
    content = bytearray((small_bag / "small_0.mcap").read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        offset = data.draw(st.integers(0, len(content)))
        cut = data.draw(st.integers(0, 8))
        content[offset : offset + cut] = data.draw(
            st.binary(max_size=8) | st.just(b"\xff" * 8) | st.just(bytes(8))
        )
    path = folder / "damaged.mcap"
    path.write_bytes(content)
    read(path)
    check(path)
    try:
        rescued = recover(path, folder / "rescued")
    except UnreadableBagError:
        return
    assert sum(rescued.counts.values()) <= len(ALL)
    assert check(folder / "rescued") == []
