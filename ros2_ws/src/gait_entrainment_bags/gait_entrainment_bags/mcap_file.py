# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One MCAP file on disk: its summary, its chunks, and any damage to it.

This module does two things that the reader of the ``mcap`` library does not. It checks every
length and offset against the size of the file before using it, so that damage is reported. And
it takes messages from a chunk through its index: reading a topic of a few messages only costs
decompressing the chunks that hold it, whereas the library makes an object of every message in
them (14 microseconds each).
"""

import math
import os
import zlib
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer, Header, MetadataIndex

from gait_entrainment_bags.errors import UnreadableBagError, noting
from gait_entrainment_bags.mcap_records import (
    BROKEN,
    CHUNK_HEAD,
    LARGEST_CHUNK,
    RECORD,
    BagMessage,
    Chunk,
    Contents,
    decompress,
    find_chunks,
    parse,
    parse_indexed_message,
    parse_message,
    parse_message_index,
    split,
)
from gait_entrainment_bags.metadata import first_line

MAGIC = b"\x89MCAP0\r\n"
_FOOTER_SIZE = RECORD.size + 20
_FOOTER = RECORD.pack(Opcode.FOOTER, 20)  # how it begins
# Record types that are read outside of chunks, in stretches of about a megabyte.
_LOOSE = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.METADATA)
_STRETCH = 2**20


class McapFile:
    """
    An MCAP file opened for reading.

    Raises UnreadableBagError if there is no such file, or it is empty, not an MCAP file, or
    without a header. Every method except `scan` and `walk` raises it if what it reads is damaged.
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
            content = self.record(len(MAGIC), Opcode.HEADER)
            with self._broken("header", len(MAGIC)):
                self.header: Header = parse(Header, content)
            self.data_start = len(MAGIC) + RECORD.size + len(content)
        except UnreadableBagError:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def damage(self, offset: int, text: str) -> UnreadableBagError:
        """Return the error to raise for damage at an offset."""
        return UnreadableBagError(f"{self.path}: at byte {offset}: {text}")

    @contextmanager
    def _broken(self, what: str, offset: int) -> Iterator[None]:
        """Turn a parser's error about broken bytes into one that gives what is broken where."""
        try:
            yield
        except BROKEN as error:
            raise self.damage(offset, f"broken {what}: {first_line(error)}") from None

    def read(self, offset: int, length: int) -> bytes:
        """Read this number of bytes; raises UnreadableBagError if there are fewer."""
        if offset + length > self.size:
            raise self.damage(offset, f"the file ends {offset + length - self.size} bytes early")
        data = b""
        try:
            while len(data) < length:  # a single read returns at most 2 GiB
                more = os.pread(self._file.fileno(), length - len(data), offset + len(data))
                if not more:
                    raise self.damage(offset, "the file became shorter while it was read")
                data = data + more if data else more
        except OSError as error:
            raise self.damage(offset, f"cannot be read: {error.strerror}") from None
        return data

    def record_at(self, offset: int) -> tuple[int, int]:
        """Return opcode and length of the record at an offset, which is completely in the file."""
        opcode, length = RECORD.unpack(self.read(offset, RECORD.size))
        missing = offset + RECORD.size + length - self.size
        if missing > 0:
            raise self.damage(offset, f"the record ends {missing} bytes after the file does")
        return opcode, length

    def record(self, offset: int, expected: Opcode) -> bytes:
        """Read the content of the record at an offset, which must have the expected opcode."""
        opcode, length = self.record_at(offset)
        if opcode != expected:
            what = expected.name.lower().replace("_", " ")
            raise self.damage(offset, f"expected a record of type {what}")
        return self.read(offset + RECORD.size, length)

    def read_footer(self) -> Footer:
        """Read the footer; raises an error if the file was never closed, or its end is lost."""
        offset = self.size - len(MAGIC) - _FOOTER_SIZE
        if offset >= self.data_start:
            end = self.read(offset, self.size - offset)
            if end.startswith(_FOOTER) and end.endswith(MAGIC):
                footer: Footer = parse(Footer, end[RECORD.size :])
                return footer
        raise UnreadableBagError(
            f"{self.path}: was never closed, or its end is lost; `entrain bag recover` rescues "
            "what is in it"
        )

    def read_summary(self) -> Contents | None:
        """Read the summary; None if there is none that lists chunks and counts."""
        footer = self.read_footer()
        begin, end = footer.summary_start, self.size - len(MAGIC) - _FOOTER_SIZE
        if begin == 0:
            return None
        if not self.data_start <= begin <= end:
            raise self.damage(end, "the footer points outside of the file")
        # The checksum also covers the footer, up to the checksum itself.
        summary = self.read(begin, end + _FOOTER_SIZE - 4 - begin)
        if footer.summary_crc and zlib.crc32(summary) != footer.summary_crc:
            raise self.damage(begin, "the summary does not match its checksum")
        contents = Contents()
        with self._broken("summary", begin):
            for opcode, start, stop in split(summary[: end - begin]):
                content = summary[start:stop]
                if opcode == Opcode.METADATA_INDEX:
                    opcode = Opcode.METADATA
                    content = self.record(parse(MetadataIndex, content).offset, opcode)
                contents.take(opcode, content)
        statistics = contents.statistics
        if (
            statistics is None
            or (statistics.channel_count and not contents.channels)
            or (statistics.message_count and not contents.chunks)
            or (statistics.schema_count and not contents.schemas)
        ):
            return None
        for channel, topic in contents.names.items():
            contents.counts[topic] += statistics.channel_message_counts.get(channel, 0)
        if contents.counts.total() != statistics.message_count:
            raise self.damage(
                begin,
                f"the statistics count {statistics.message_count} messages, but "
                f"{contents.counts.total()} by channel",
            )
        contents.start, contents.end = statistics.message_start_time, statistics.message_end_time
        return contents

    def chunk_data(self, chunk: Chunk) -> bytes:
        """Read the records of a chunk, decompressed and checked against size and checksum."""
        if not chunk.is_record:
            return self.read(chunk.offset, chunk.length)
        content = self.record(chunk.offset, Opcode.CHUNK)
        with self._broken("chunk", chunk.offset):
            return decompress(content)

    def messages(
        self,
        chunk: Chunk,
        rank: int,
        names: Mapping[int, str],
        start: int = 0,
        end: float = math.inf,
    ) -> list[BagMessage]:
        """
        Read messages of these topics (by channel) from a chunk; rank is its place in the bag.

        Messages with log times outside of ``start`` up to ``end`` [ns] are left out if an index
        gives their log times.
        """
        place = rank * LARGEST_CHUNK
        with self._broken("chunk", chunk.offset):
            if chunk.index_offsets.keys() <= names.keys():  # all of it, or no index
                records = self.chunk_data(chunk)
                return [
                    message
                    for opcode, start, stop in split(records)
                    if opcode == Opcode.MESSAGE
                    and (message := parse_message(records, start, stop, place, names))
                ]
            entries = sorted(
                (offset, log_time)
                for channel in names.keys() & chunk.index_offsets.keys()
                for log_time, offset in self.message_index(chunk.index_offsets[channel], channel)
                if start <= log_time < end
            )
            records = self.chunk_data(chunk) if entries else b""
            return [parse_indexed_message(records, *entry, place, names) for entry in entries]

    def message_index(self, offset: int, channel: int) -> list[tuple[int, int]]:
        """Read the message index of a channel: log times and offsets in the chunk."""
        content = self.record(offset, Opcode.MESSAGE_INDEX)
        with self._broken("message index", offset):
            return parse_message_index(content, channel)

    def records(self, offset: int) -> Iterator[tuple[int, int, int]]:
        """Yield opcode, offset and content length of the next records of the data section."""
        while True:
            if offset == self.size:
                raise self.damage(offset, "the file was never closed")
            opcode, length = self.record_at(offset)
            if opcode == 0:
                raise self.damage(offset, "a zero instead of a record")
            yield opcode, offset, length
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                return
            offset += RECORD.size + length

    def check_data(self) -> None:
        """Check the data section against the checksum at its end, if there is one."""
        opcode, end, length = deque(self.records(self.data_start), maxlen=1).pop()
        if opcode != Opcode.DATA_END or length != 4:
            raise self.damage(end, "the end of the data section is not marked")
        expected = parse(DataEnd, self.record(end, Opcode.DATA_END)).data_section_crc
        checksum = 0
        for offset in range(0, end, _STRETCH):
            checksum = zlib.crc32(self.read(offset, min(_STRETCH, end - offset)), checksum)
        if expected and checksum != expected:
            raise self.damage(end, "the data section does not match its checksum")

    def scan(self) -> Contents:
        """List the contents of the data section, including its damages."""
        contents = Contents()
        deque(self.walk(contents), maxlen=0)
        return contents

    def walk(
        self, contents: Contents, summary: Contents | None = None
    ) -> Iterator[tuple[Chunk, list[BagMessage]]]:
        """
        Yield every readable chunk with its messages, in the order of the file.

        ``contents`` is filled with what is found on the way, and with the damages. The channels
        of a summary count as announced. If damage hides where the next record begins, reading
        continues at the next chunk that the summary lists.
        """
        summary = summary or Contents()
        contents.schemas += summary.schemas
        contents.channels += summary.channels
        listed = sorted(chunk.offset for chunk in summary.chunks)
        for chunk in self._stretches(contents, listed):
            messages: list[BagMessage] = []
            with noting(contents.damages.append):
                self._read_chunk(contents, chunk, messages)
            if messages:
                times = [message.log_time for message in messages]
                chunk = replace(chunk, start=min(times), end=max(times))
                start = min(chunk.start, contents.start) if contents.counts else chunk.start
                contents.start, contents.end = start, max(chunk.end, contents.end)
                contents.chunks.append(chunk)
                contents.counts.update(message.topic for message in messages)
                yield chunk, messages

    def _read_chunk(self, contents: Contents, chunk: Chunk, messages: list[BagMessage]) -> None:
        """Read a whole chunk: messages into the list, the rest into `contents`."""
        place = len(contents.chunks) * LARGEST_CHUNK
        names = contents.names
        with self._broken("chunk", chunk.offset):
            records = self.chunk_data(chunk)
            for opcode, start, stop in split(records):
                if opcode != Opcode.MESSAGE:
                    offset = chunk.offset + (0 if chunk.is_record else start - RECORD.size)
                    with noting(contents.damages.append), self._broken("record", offset):
                        contents.take(opcode, records[start:stop])
                    names = contents.names
                elif message := parse_message(records, start, stop, place, names):
                    messages.append(message)
                else:
                    raise ValueError("a message on a channel that is not announced")

    def _stretches(self, contents: Contents, listed: list[int]) -> Iterator[Chunk]:
        """Yield the data section's chunks, and stretches outside them that may hold messages."""
        position: int | None = self.data_start  # where the next record begins
        while position is not None:
            begin = position  # of a stretch outside of chunks
            try:
                for opcode, offset, length in self.records(position):
                    loose = opcode in _LOOSE
                    if begin < offset and not (loose and offset - begin <= _STRETCH):
                        yield Chunk(begin, offset - begin, is_record=False)
                        begin = offset
                    position = offset + RECORD.size + length
                    if opcode == Opcode.CHUNK:
                        yield Chunk(offset, position - offset)
                    begin = begin if loose else position
                return
            except UnreadableBagError as error:
                contents.damages.append(str(error))
            if begin < position:
                yield Chunk(begin, position - begin, is_record=False)
            later = [offset for offset in listed if offset > position]
            position = later[0] if later else self._find_chunk(position + 1)

    def _find_chunk(self, offset: int) -> int | None:
        """Search for the next chunk if no index lists one."""
        while offset < self.size:
            piece = self.read(offset, min(_STRETCH + CHUNK_HEAD, self.size - offset))
            for place, length in find_chunks(piece):
                if offset + place + length <= self.size:
                    return offset + place
            offset += _STRETCH
        return None
