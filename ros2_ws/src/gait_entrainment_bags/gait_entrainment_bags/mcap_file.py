# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One MCAP file as it lies on the disk: its summary, its chunks, and what is wrong with it.

The ``mcap`` library parses the single records. Two things are done here. Every length and offset
is held against the size of the file before it is followed, so that a damaged file gives a
verdict. And messages are taken from a chunk by its index: a topic of a few messages costs the
decompression of the chunks that hold it and no more, where the library's reader makes an object
of every message in them (14 microseconds each).
"""

import os
import re
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Header, Metadata, MetadataIndex, Schema, Statistics

from gait_entrainment_bags.errors import UnreadableBagError
from gait_entrainment_bags.metadata import first_line

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")  # opcode, length of the content
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK = struct.Struct("<QQQII")  # start, end, size, checksum, length of the compression's name
_CHUNK_INDEX = struct.Struct("<QQQQI")  # start, end, offset, length, length of the offsets
_INDEX_OFFSET = struct.Struct("<HQ")  # channel, offset of its message index
_INDEX_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk
_MESSAGE_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, length of the entries
_FOOTER_SIZE = _RECORD.size + 20
# What tells of a chunk in the midst of bytes: length and name of its compression.
_CHUNK_NAMES = (b"\x04\0\0\0zstd", b"\x03\0\0\0lz4")
_ANY_CHUNK_NAME = re.compile(b"|".join(_CHUNK_NAMES))
_CHUNK_NAME_OFFSET = _RECORD.size + _CHUNK.size - 4
# Messages that lie outside of chunks are read in stretches of about this size.
_STRETCH = 2**20
_WRONG_INDEX = "the chunk does not match its message index"
# A chunk is held in memory at once. Writers make them a megabyte; this is for damaged sizes.
_LARGEST_CHUNK = 2**31


class BagMessage(NamedTuple):
    """
    A message as stored; sorts by log time, then by its place in the bag.

    ``log_time`` and ``publish_time`` [ns since the epoch] are when it was received (or the
    instant that it speaks of) and sent; ``data`` is CDR with its header of four bytes.
    """

    log_time: int
    place: int
    topic: str
    publish_time: int
    data: bytes


@dataclass(frozen=True)
class Chunk:
    """A stretch of the file that holds messages: a chunk, or messages outside of any chunk."""

    offset: int
    length: int
    start: int  # first log time
    end: int  # last log time
    is_record: bool = True
    index_offsets: dict[int, int] = field(default_factory=dict)  # by channel; {}: no index


@dataclass(frozen=True)
class Damage:
    """Something that cannot be read, and where it lies [bytes from the start of the file]."""

    offset: int
    text: str


@dataclass
class Contents:
    """What an MCAP file holds, from its summary or from walking through all of it."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)  # messages by topic
    start: int = 0  # first log time; 0 without messages
    end: int = 0
    statistics: Statistics | None = None
    metadata: list[Metadata] = field(default_factory=list)
    metadata_indexes: list[MetadataIndex] = field(default_factory=list)
    damages: list[Damage] = field(default_factory=list)

    @property
    def topics(self) -> dict[int, str]:
        """Topics by channel."""
        return {channel.id: channel.topic for channel in self.channels.values()}

    @property
    def message_count(self) -> int:
        """Messages in the file."""
        return sum(self.counts.values())


_Record = TypeVar("_Record")


class McapFile:
    """
    An MCAP file opened for reading.

    Raises
    ------
    UnreadableBagError
        There is no such file, or it is empty, or not an MCAP file, or has no header.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise UnreadableBagError(f"{path}: no such file")
        try:
            self._file = path.open("rb", buffering=0)
        except OSError as error:
            raise UnreadableBagError(f"{path}: cannot be read: {error.strerror}") from None
        try:
            self.size = os.fstat(self._file.fileno()).st_size
            if self.size == 0:
                raise UnreadableBagError(f"{path}: is empty")
            if not MAGIC.startswith(self.read(0, min(self.size, len(MAGIC)))):
                raise UnreadableBagError(f"{path}: is not an MCAP file")
            self.data_start = len(MAGIC)
            opcode, length = self.record_at(self.data_start)
            if opcode != Opcode.HEADER:
                raise self.damage(self.data_start, "the header is missing")
            self.header: Header = self.parse(Header.read, self.data_start, length)
            self.data_start += _RECORD.size + length
        except UnreadableBagError:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def damage(self, offset: int, text: str) -> UnreadableBagError:
        """Make the error that says what is wrong at an offset."""
        return UnreadableBagError(f"{self.path}: at byte {offset}: {text}")

    def read(self, offset: int, length: int) -> bytes:
        """Read bytes, all of them or an error."""
        if offset + length > self.size:
            raise self.damage(offset, f"the file ends {offset + length - self.size} bytes early")
        try:
            data = os.pread(self._file.fileno(), length, offset)
            while len(data) < length:  # one read gives at most 2 GiB
                more = os.pread(self._file.fileno(), length - len(data), offset + len(data))
                if not more:
                    raise self.damage(offset, "the file became shorter while it was read")
                data += more
        except OSError as error:
            raise self.damage(offset, f"cannot be read: {error.strerror}") from None
        return data

    def record_at(self, offset: int) -> tuple[int, int]:
        """Give opcode and length of the record at an offset, all of which the file holds."""
        opcode, length = _RECORD.unpack(self.read(offset, _RECORD.size))
        if offset + _RECORD.size + length > self.size:
            missing = offset + _RECORD.size + length - self.size
            raise self.damage(offset, f"the file ends {missing} bytes before its record does")
        return opcode, length

    def parse(
        self, parser: Callable[[ReadDataStream], _Record], offset: int, length: int
    ) -> _Record:
        """Parse the content of the record at an offset."""
        return self._parse_bytes(parser, self.read(offset + _RECORD.size, length), offset)

    def _parse_bytes(
        self, parser: Callable[[ReadDataStream], _Record], content: bytes, offset: int
    ) -> _Record:
        try:
            return parser(ReadDataStream(BytesIO(content)))
        except (McapError, struct.error, ValueError) as error:
            raise self.damage(offset, f"broken record: {first_line(error)}") from None

    # The end of the file.

    def read_footer(self) -> Footer:
        """
        Read the footer.

        Raises
        ------
        UnreadableBagError
            The file was never closed, or its end is lost.

        """
        offset = self.size - len(MAGIC) - _FOOTER_SIZE
        if offset >= self.data_start and self.read(self.size - len(MAGIC), len(MAGIC)) == MAGIC:
            opcode, length = _RECORD.unpack(self.read(offset, _RECORD.size))
            if opcode == Opcode.FOOTER and length == 20:
                footer: Footer = self.parse(Footer.read, offset, length)
                return footer
        raise UnreadableBagError(
            f"{self.path}: was never closed, or its end is lost; `entrain bag recover` rescues "
            "what is in it"
        )

    def read_summary(self) -> Contents | None:
        """
        Read the summary, or None where the writer made none that lists chunks and counts.

        Raises
        ------
        UnreadableBagError
            The file was never closed, or the summary is damaged.

        """
        footer = self.read_footer()
        end = self.size - len(MAGIC) - _FOOTER_SIZE
        if footer.summary_start == 0:
            return None
        if not self.data_start <= footer.summary_start <= end:
            raise self.damage(end, "the footer points outside of the file")
        # The checksum covers the footer as well, up to the checksum itself.
        summary = self.read(footer.summary_start, end + _FOOTER_SIZE - 4 - footer.summary_start)
        if footer.summary_crc and zlib.crc32(summary) != footer.summary_crc:
            raise self.damage(footer.summary_start, "the summary does not match its checksum")
        contents = Contents()
        offset = footer.summary_start
        while offset < end:
            opcode, length = self.record_at(offset)
            start = offset + _RECORD.size - footer.summary_start
            self._take(contents, opcode, summary[start : start + length], offset)
            offset += _RECORD.size + length
        statistics = contents.statistics
        if statistics is None or (not contents.channels and statistics.channel_count):
            return None
        if statistics.message_count and not contents.chunks:
            return None
        if statistics.schema_count and not contents.schemas:
            return None
        for channel, topic in contents.topics.items():
            count = statistics.channel_message_counts.get(channel, 0)
            contents.counts[topic] = contents.counts.get(topic, 0) + count
        if contents.message_count != statistics.message_count:
            raise self.damage(
                footer.summary_start,
                f"the statistics count {statistics.message_count} messages, but "
                f"{contents.message_count} by channel",
            )
        contents.start = statistics.message_start_time
        contents.end = statistics.message_end_time
        for index in contents.metadata_indexes:
            opcode, length = self.record_at(index.offset)
            if opcode != Opcode.METADATA:
                raise self.damage(index.offset, "no metadata where the summary says it is")
            contents.metadata.append(self.parse(Metadata.read, index.offset, length))
        return contents

    def _take(self, contents: Contents, opcode: int, content: bytes, offset: int) -> None:
        """Enter a record of the summary or of the data section, other than messages."""
        if opcode == Opcode.SCHEMA:
            schema: Schema = self._parse_bytes(Schema.read, content, offset)
            known_schema = contents.schemas.get(schema.id, schema)
            contents.schemas[schema.id] = schema
            if known_schema != schema:
                raise self.damage(offset, f"schema {schema.id} is there twice, and differs")
        elif opcode == Opcode.CHANNEL:
            channel: Channel = self._parse_bytes(Channel.read, content, offset)
            known_channel = contents.channels.get(channel.id, channel)
            contents.channels[channel.id] = channel
            if known_channel != channel:
                raise self.damage(offset, f"channel {channel.id} is there twice, and differs")
        elif opcode == Opcode.STATISTICS:
            contents.statistics = self._parse_bytes(Statistics.read, content, offset)
        elif opcode == Opcode.METADATA:
            contents.metadata.append(self._parse_bytes(Metadata.read, content, offset))
        elif opcode == Opcode.METADATA_INDEX:
            contents.metadata_indexes.append(
                self._parse_bytes(MetadataIndex.read, content, offset)
            )
        elif opcode == Opcode.CHUNK_INDEX:
            contents.chunks.append(self._parse_chunk_index(content, offset))

    def _parse_chunk_index(self, content: bytes, offset: int) -> Chunk:
        try:
            start, end, chunk_offset, length, size = _CHUNK_INDEX.unpack_from(content)
            pairs = content[_CHUNK_INDEX.size : _CHUNK_INDEX.size + size]
            index_offsets = dict(_INDEX_OFFSET.iter_unpack(pairs))
        except struct.error:
            raise self.damage(offset, "broken chunk index") from None
        return Chunk(chunk_offset, length, start, end, index_offsets=index_offsets)

    # Chunks.

    def chunk_data(self, chunk: Chunk) -> bytes:
        """
        Read the records of a chunk, decompressed and held against their checksum.

        Raises
        ------
        UnreadableBagError
            The chunk is damaged, or compressed by a method unknown here.

        """
        if not chunk.is_record:
            return self.read(chunk.offset, chunk.length)
        opcode, length = self.record_at(chunk.offset)
        if opcode != Opcode.CHUNK:
            raise self.damage(chunk.offset, "no chunk where the index says there is one")
        content = self.read(chunk.offset + _RECORD.size, length)
        try:
            _, _, size, checksum, name_length = _CHUNK.unpack_from(content)
            name = content[_CHUNK.size : _CHUNK.size + name_length]
            data = content[_CHUNK.size + name_length + 8 :]
            (data_length,) = struct.unpack_from("<Q", content, _CHUNK.size + name_length)
        except struct.error:
            raise self.damage(chunk.offset, "broken chunk") from None
        if data_length > len(data) or size > _LARGEST_CHUNK:
            raise self.damage(chunk.offset, "broken chunk: its sizes do not agree")
        records = self._decompress(name, data[:data_length], size, chunk.offset)
        if len(records) != size or (checksum and zlib.crc32(records) != checksum):
            raise self.damage(chunk.offset, "the chunk does not match its size or checksum")
        return records

    def _decompress(self, name: bytes, data: bytes, size: int, offset: int) -> bytes:
        if name == b"":
            return data
        try:
            if name == b"zstd":
                announced = zstandard.get_frame_parameters(data).content_size
                if announced not in (size, zstandard.CONTENTSIZE_UNKNOWN):
                    raise self.damage(offset, "the chunk does not match its size or checksum")
                return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
            if name == b"lz4":
                return bytes(lz4.frame.decompress(data))
        except (zstandard.ZstdError, RuntimeError, MemoryError, ValueError) as error:
            raise self.damage(
                offset, f"the chunk cannot be decompressed: {first_line(error)}"
            ) from None
        raise self.damage(offset, f"the chunk's compression {name!r} is not zstd, lz4 or none")

    def messages(self, chunk: Chunk, rank: int, topics: Mapping[int, str]) -> list[BagMessage]:
        """
        Read messages of a chunk, in the order of the file, of these topics (by channel).

        The rank is the place of the chunk among all those of the bag.

        Raises
        ------
        UnreadableBagError
            The chunk or its index is damaged.

        """
        place = rank * _LARGEST_CHUNK
        try:
            if chunk.index_offsets.keys() <= topics.keys():  # all of it, or no index
                records = self.chunk_data(chunk)
                return [
                    message
                    for opcode, start, stop in _split(records)
                    if opcode == Opcode.MESSAGE
                    and (message := _parse_message(records, start, stop, place, topics))
                ]
            entries: list[tuple[int, int]] = []  # offset in the chunk, log time
            for channel in topics.keys() & chunk.index_offsets.keys():
                index = self.message_index(chunk.index_offsets[channel], channel)
                entries += [(offset, log_time) for log_time, offset in index]
            if not entries:
                return []
            records = self.chunk_data(chunk)
            messages = []
            for offset, log_time in sorted(entries):
                opcode, length = _RECORD.unpack_from(records, offset)
                start = offset + _RECORD.size
                if opcode != Opcode.MESSAGE or start + length > len(records):
                    raise _BrokenRecordsError(_WRONG_INDEX)
                found = _parse_message(records, start, start + length, place, topics)
                if found is None or found.log_time != log_time:
                    raise _BrokenRecordsError(_WRONG_INDEX)
                messages.append(found)
            return messages
        except (struct.error, OverflowError):  # an offset beyond the chunk
            raise self.damage(chunk.offset, _WRONG_INDEX) from None
        except _BrokenRecordsError as error:
            raise self.damage(chunk.offset, str(error)) from None

    def message_index(self, offset: int, channel: int) -> list[tuple[int, int]]:
        """
        Read the message index of a channel: log times and offsets in the chunk.

        Raises
        ------
        UnreadableBagError
            There is none at that offset.

        """
        opcode, length = self.record_at(offset)
        content = self.read(offset, _RECORD.size + length)
        if opcode == Opcode.MESSAGE_INDEX and len(content) >= _MESSAGE_INDEX.size:
            _, _, found, size = _MESSAGE_INDEX.unpack_from(content)
            entries = content[_MESSAGE_INDEX.size :]
            if found == channel and size == len(entries) and size % _INDEX_ENTRY.size == 0:
                return list(_INDEX_ENTRY.iter_unpack(entries))
        raise self.damage(offset, "no message index where the chunk's index says there is one")

    # Walking through all of the file.

    def records(self, offset: int | None = None) -> Iterator[tuple[int, int, int]]:
        """
        Give opcode, offset and length of the content of every record of the data section.

        It begins at an offset, or with the first record after the header.

        Raises
        ------
        UnreadableBagError
            What comes next is no record, or reaches beyond the end of the file.

        """
        offset = self.data_start if offset is None else offset
        while True:
            if offset == self.size:
                raise self.damage(offset, "the file was never closed")
            opcode, length = self.record_at(offset)
            if opcode == 0:
                raise self.damage(offset, "no record, but a zero")
            yield opcode, offset, length
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                return
            offset += _RECORD.size + length

    def scan(
        self,
        keep: Callable[[Contents, Chunk, list[BagMessage]], None] | None = None,
        summary: Contents | None = None,
    ) -> Contents:
        """
        Take stock of the data section, whatever is damaged in it; `Contents.damages` says what.

        Parameters
        ----------
        keep
            Called with every readable chunk and the messages in it, in the order of the file,
            and with what was found up to there.
        summary
            If given, its channels count as announced, and damage that leads astray is passed
            over up to the next chunk that it lists.

        """
        contents = Contents()
        if summary is not None:
            contents.schemas.update(summary.schemas)
            contents.channels.update(summary.channels)
        for chunk in self._stretches(contents, summary or Contents()):
            place = len(contents.chunks) * _LARGEST_CHUNK
            messages = []
            try:
                topics = contents.topics
                records = self.chunk_data(chunk)
                for opcode, start, stop in _split(records):
                    if opcode != Opcode.MESSAGE:
                        self._take(contents, opcode, records[start:stop], chunk.offset)
                        topics = contents.topics
                        continue
                    message = _parse_message(records, start, stop, place, topics)
                    if message is None:
                        raise _BrokenRecordsError("a message of a channel that is not announced")
                    messages.append(message)
            except UnreadableBagError as error:
                contents.damages.append(Damage(chunk.offset, str(error)))
            except _BrokenRecordsError as error:
                damage = self.damage(chunk.offset, str(error))
                contents.damages.append(Damage(chunk.offset, str(damage)))
            if not messages:
                continue
            times = [message.log_time for message in messages]
            start, end = min(times), max(times)
            contents.start = min(start, contents.start) if contents.counts else start
            contents.end = max(end, contents.end)
            contents.chunks.append(replace(chunk, start=start, end=end))
            for message in messages:
                contents.counts[message.topic] = contents.counts.get(message.topic, 0) + 1
            if keep is not None:
                keep(contents, contents.chunks[-1], messages)
        return contents

    def _stretches(self, contents: Contents, summary: Contents) -> Iterator[Chunk]:
        """Give whatever holds messages, and enter the rest of the data section in `contents`."""
        position = self.data_start  # where the next record begins
        begin: int | None = None  # of a stretch of messages outside of chunks
        while True:
            try:
                for opcode, offset, length in self.records(position):
                    if begin is not None and (
                        opcode != Opcode.MESSAGE or offset - begin > _STRETCH
                    ):
                        yield Chunk(begin, offset - begin, 0, 0, is_record=False)
                        begin = None
                    position = offset + _RECORD.size + length
                    if opcode == Opcode.MESSAGE:
                        begin = offset if begin is None else begin
                    elif opcode == Opcode.CHUNK:
                        yield Chunk(offset, position - offset, 0, 0)
                    elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
                        self._take_or_note(contents, opcode, offset, length)
                return
            except UnreadableBagError as error:
                contents.damages.append(Damage(position, str(error)))
            if begin is not None:
                yield Chunk(begin, position - begin, 0, 0, is_record=False)
                begin = None
            listed = [chunk.offset for chunk in summary.chunks if chunk.offset > position]
            found = min(listed) if listed else self._find_chunk(position + 1)
            if found is None:
                return
            position = found

    def _find_chunk(self, offset: int) -> int | None:
        """Search for the next chunk where no index tells of it: by the name of its compression."""
        overlap = _CHUNK_NAME_OFFSET + len(_CHUNK_NAMES[0])
        while offset < self.size:
            piece = self.read(offset, min(_STRETCH + overlap, self.size - offset))
            places = (
                match.start() - _CHUNK_NAME_OFFSET
                for match in _ANY_CHUNK_NAME.finditer(piece, _CHUNK_NAME_OFFSET)
            )
            for place in places:
                opcode, length = _RECORD.unpack_from(piece, place)
                if opcode == Opcode.CHUNK and offset + place + _RECORD.size + length <= self.size:
                    return offset + place
            offset += _STRETCH
        return None

    def _take_or_note(self, contents: Contents, opcode: int, offset: int, length: int) -> None:
        try:
            content = self.read(offset + _RECORD.size, length)
            self._take(contents, opcode, content, offset)
        except UnreadableBagError as error:
            contents.damages.append(Damage(offset, str(error)))


class _BrokenRecordsError(Exception):
    """Records inside of a chunk that make no sense."""


def _split(records: bytes) -> Iterator[tuple[int, int, int]]:
    """Give opcode, start and stop of the content of each record in a chunk."""
    offset, end = 0, len(records)
    while offset < end:
        if offset + _RECORD.size > end:
            raise _BrokenRecordsError("the chunk ends within a record")
        opcode, length = _RECORD.unpack_from(records, offset)
        start = offset + _RECORD.size
        offset = start + length
        if offset > end:
            raise _BrokenRecordsError("the chunk ends within a record")
        yield opcode, start, offset


def _parse_message(
    records: bytes, start: int, stop: int, place: int, topics: Mapping[int, str]
) -> BagMessage | None:
    """Parse a message, or give None if it belongs to none of the topics."""
    if stop - start < _MESSAGE.size:
        raise _BrokenRecordsError("a message is too short")
    channel, _, log_time, publish_time = _MESSAGE.unpack_from(records, start)
    topic = topics.get(channel)
    if topic is None:
        return None
    data = records[start + _MESSAGE.size : stop]
    return BagMessage(log_time, place + start, topic, publish_time, data)
