# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The ``mcap`` library's writer, with a faster path for messages.

The library makes an object of every message, writes each field separately and counts the message;
here a message is packed in one step and counted with its chunk. The file is identical to the
byte, which a test verifies; to achieve this, the class uses private members of ``mcap`` 1.
"""

import struct
from typing import Any

from mcap.opcode import Opcode
from mcap.writer import Writer

_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_FIELDS = _HEAD.size - 9  # bytes of the fields, which follow opcode and length
_MESSAGE = int(Opcode.MESSAGE)


class _Index:
    """The message index of a channel in a chunk."""

    def __init__(self, channel: int) -> None:
        self._channel = channel
        self.entries: list[int] = []  # log time and offset of each message in turn

    def write(self, records: Any) -> None:
        """Write the index as a record."""
        count = len(self.entries)
        head = Opcode.MESSAGE_INDEX, 6 + 8 * count, self._channel, 8 * count
        records.write(struct.pack(f"<BQHI{count}Q", *head, *self.entries))


class ChunkWriter(Writer):
    """See the module's docstring."""

    _Writer__statistics: Any
    _Writer__chunk_builder: Any
    _Writer__chunk_size: int

    def add_message(
        self, channel_id: int, log_time: int, data: bytes, publish_time: int, sequence: int = 0
    ) -> None:
        """Add a message to the current chunk, and finish the chunk once it is large enough."""
        chunk = self._Writer__chunk_builder
        index = chunk.message_indices.get(channel_id)
        if index is None:
            index = chunk.message_indices[channel_id] = _Index(channel_id)
        write, offset = chunk.record_writer.write, chunk.record_writer.count
        index.entries += (log_time, offset)
        length = _FIELDS + len(data)
        write(_HEAD.pack(_MESSAGE, length, channel_id, sequence, log_time, publish_time) + data)
        if offset + _HEAD.size + len(data) > self._Writer__chunk_size:
            self._Writer__finalize_chunk()

    def _Writer__finalize_chunk(self) -> None:  # noqa: N802
        chunk, statistics = self._Writer__chunk_builder, self._Writer__statistics
        indices = chunk.message_indices
        times = [log_time for index in indices.values() for log_time in index.entries[::2]]
        if times:
            first, last = chunk.message_start_time, chunk.message_end_time = min(times), max(times)
            if statistics.message_count:
                first = min(first, statistics.message_start_time)
            statistics.message_start_time = first
            statistics.message_end_time = max(last, statistics.message_end_time)
            chunk.num_messages = len(times)
            statistics.message_count += len(times)
            for channel, index in indices.items():
                statistics.channel_message_counts[channel] += len(index.entries) // 2
        super()._Writer__finalize_chunk()  # type: ignore[misc]
