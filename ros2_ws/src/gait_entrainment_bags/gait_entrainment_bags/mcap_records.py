# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Parsing the records of an MCAP file: schemas and channels, messages, chunks.

The ``mcap`` library parses the rare kinds of records. The frequent ones, messages and their
indexes, are parsed here, ten times as fast. Invalid bytes raise one of `BROKEN`; `mcap_file`
adds where in the file they are.
"""

import re
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any, NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics
from zstandard import ZstdError

from gait_entrainment_bags.metadata import TopicInfo, topic_of

BROKEN = (McapError, ZstdError, struct.error, ValueError, OverflowError, RuntimeError, MemoryError)
RECORD = struct.Struct("<BQ")  # opcode, length of the content
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_WHOLE_MESSAGE = struct.Struct("<BQHIQQ")  # RECORD and _MESSAGE together
_CHUNK = struct.Struct("<QQQII")  # start, end, size, checksum, length of the compression's name
_CHUNK_INDEX = struct.Struct("<QQQQI")  # start, end, offset, length, length of the offsets
_INDEX_OFFSET = struct.Struct("<HQ")  # channel, offset of its message index
_MESSAGE_INDEX = struct.Struct("<HI")  # channel, length of the entries
_INDEX_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk
_RECORD_TYPES: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
}
# Bytes that identify a chunk among other bytes: length and name of its compression.
_CHUNK_NAME = re.compile(rb"\x04\0\0\0zstd|\x03\0\0\0lz4")
_CHUNK_NAME_OFFSET = RECORD.size + _CHUNK.size - 4
CHUNK_HEAD = _CHUNK_NAME_OFFSET + 8  # bytes by which `find_chunks` recognizes a chunk
# A chunk is kept in memory as a whole. Writers make them a megabyte; this catches damaged sizes.
LARGEST_CHUNK = 2**31


class BagMessage(NamedTuple):
    """
    A stored message; sorts by log time, then by its place in the bag.

    ``log_time`` [ns since the epoch] is when the message was received, or the time that it is
    about; ``publish_time`` is when it was sent; ``data`` is CDR with its four-byte header.
    """

    log_time: int
    place: int
    topic: str
    publish_time: int
    data: bytes

    @property
    def offset(self) -> int:
        """Offset of its record in its chunk."""
        return self.place % LARGEST_CHUNK - RECORD.size


@dataclass(frozen=True)
class Chunk:
    """A stretch of the file that holds messages: a chunk, or messages outside of any chunk."""

    offset: int
    length: int
    start: int = 0  # first log time
    end: int = 0  # last log time
    is_record: bool = True
    index_offsets: dict[int, int] = field(default_factory=dict)  # by channel; {}: no index


@dataclass
class Contents:
    """The contents of an MCAP file, from its summary or from reading all of it."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    chunks: list[Chunk] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)  # messages by topic
    start: int = 0  # first log time; 0 without messages
    end: int = 0
    statistics: Statistics | None = None
    metadata: list[Metadata] = field(default_factory=list)
    damages: list[str] = field(default_factory=list)  # what cannot be read, and where

    @property
    def names(self) -> dict[int, str]:
        """Names of topics by channel."""
        return {channel.id: channel.topic for channel in self.channels}

    @property
    def topics(self) -> list[TopicInfo]:
        """Topics, one for each channel: a name may appear twice, with two types."""
        schemas = {schema.id: schema for schema in self.schemas}
        return [topic_of(channel, schemas.get(channel.schema_id)) for channel in self.channels]

    def take(self, opcode: int, content: bytes) -> None:
        """Add a record of the summary or of the data section that is not a message."""
        if opcode == Opcode.CHUNK_INDEX:
            start, end, offset, length, size = _CHUNK_INDEX.unpack_from(content)
            pairs = content[_CHUNK_INDEX.size : _CHUNK_INDEX.size + size]
            index_offsets = dict(_INDEX_OFFSET.iter_unpack(pairs))
            self.chunks.append(Chunk(offset, length, start, end, index_offsets=index_offsets))
        if opcode not in _RECORD_TYPES:
            return
        record = parse(_RECORD_TYPES[opcode], content)
        if opcode == Opcode.STATISTICS:
            self.statistics = record
        elif opcode == Opcode.METADATA:
            self.metadata.append(record)
        else:
            known: list[Any] = self.schemas if opcode == Opcode.SCHEMA else self.channels
            others = [other for other in known if other.id == record.id]
            if record not in others:
                known.append(record)
                if others:
                    kind = Opcode(opcode).name.lower()
                    raise ValueError(f"{kind} {record.id} appears twice, with different content")


def parse(record_type: Any, content: bytes) -> Any:
    """Parse the content of a record as one of the types in ``mcap.records``."""
    return record_type.read(ReadDataStream(BytesIO(content)))


def split(records: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and stop of the content of each record."""
    offset, end = 0, len(records)
    while offset < end:
        if offset + RECORD.size > end:
            raise ValueError("it ends within a record")
        opcode, length = RECORD.unpack_from(records, offset)
        start = offset + RECORD.size
        offset = start + length
        if offset > end:
            raise ValueError("it ends within a record")
        yield opcode, start, offset


def parse_message(
    records: bytes, start: int, stop: int, place: int, names: Mapping[int, str]
) -> BagMessage | None:
    """Parse a message; return None if its channel is not one of the named ones."""
    if stop - start < _MESSAGE.size:
        raise ValueError("a message is too short")
    channel, _, log_time, publish_time = _MESSAGE.unpack_from(records, start)
    topic = names.get(channel)
    if topic is None:
        return None
    data = records[start + _MESSAGE.size : stop]
    return BagMessage(log_time, place + start, topic, publish_time, data)


def parse_indexed_message(
    records: bytes, offset: int, log_time: int, place: int, names: Mapping[int, str]
) -> BagMessage:
    """Parse the message at an offset given by an index."""
    if offset + _WHOLE_MESSAGE.size <= len(records):
        fields = _WHOLE_MESSAGE.unpack_from(records, offset)
        opcode, length, channel, _, found, publish_time = fields
        start, stop = offset + RECORD.size, offset + RECORD.size + length
        complete = _MESSAGE.size <= length and stop <= len(records)
        if complete and opcode == Opcode.MESSAGE and found == log_time and channel in names:
            data = records[offset + _WHOLE_MESSAGE.size : stop]
            return BagMessage(found, place + start, names[channel], publish_time, data)
    raise ValueError("it does not match its message index")


def parse_message_index(content: bytes, channel: int) -> list[tuple[int, int]]:
    """Return the log times of a channel's messages and their offsets in the chunk."""
    found, size = _MESSAGE_INDEX.unpack_from(content)
    if found != channel or size != len(content) - _MESSAGE_INDEX.size:
        raise ValueError("its channel or length is wrong")
    return list(_INDEX_ENTRY.iter_unpack(content[_MESSAGE_INDEX.size :]))


def decompress(chunk: bytes) -> bytes:
    """Return the records in the content of a chunk, checked against size and checksum."""
    _, _, size, checksum, name_length = _CHUNK.unpack_from(chunk)
    begin = _CHUNK.size + name_length + 8
    (length,) = struct.unpack_from("<Q", chunk, begin - 8)
    name, data = chunk[_CHUNK.size : begin - 8], chunk[begin : begin + length]
    if len(data) != length or size > LARGEST_CHUNK:
        raise ValueError("its sizes do not agree")
    if name == b"zstd":
        announced = zstandard.get_frame_parameters(data).content_size
        if announced not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise ValueError("it does not match its size or checksum")
        data = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    elif name == b"lz4":
        data = bytes(lz4.frame.decompress(data))
    elif name:
        raise ValueError(f"its compression {name!r} is not zstd, lz4 or none")
    if len(data) != size or (checksum and zlib.crc32(data) != checksum):
        raise ValueError("it does not match its size or checksum")
    return data


def find_chunks(piece: bytes) -> Iterator[tuple[int, int]]:
    """Yield offset and length of possible chunks, found by the name of their compression."""
    for match in _CHUNK_NAME.finditer(piece, _CHUNK_NAME_OFFSET):
        offset = match.start() - _CHUNK_NAME_OFFSET
        opcode, length = RECORD.unpack_from(piece, offset)
        if opcode == Opcode.CHUNK:
            yield offset, RECORD.size + length
