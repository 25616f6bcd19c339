# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Recording into a bag: MCAP files and the ``metadata.yaml`` that rosbag2 expects."""

import errno
import os
import shutil
import tempfile
import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from io import FileIO
from pathlib import Path
from typing import Any

from mcap.writer import LIBRARY_IDENTIFIER, CompressionType

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.chunk_writer import ChunkWriter
from gait_entrainment_bags.errors import BagError, BagWriteError, DiskFullError, make_folder
from gait_entrainment_bags.metadata import (
    RECORD_NAME,
    BagDescription,
    FileInformation,
    TopicInfo,
    first_line,
    offered_qos_text,
)

ENDED_EARLY = "ended_early"
"""Key in the custom data of a bag for the reason why its recording ended early."""
_COMPRESSIONS = {kind.name.lower(): kind for kind in CompressionType}  # none, lz4, zstd
_MEBIBYTE = 2**20
_DISK_FULL = (errno.ENOSPC, errno.EDQUOT)


class BagWriter(AbstractContextManager["BagWriter"]):
    """
    A bag that is being recorded; not thread-safe.

    The folder is created, and its files are named after it, as by rosbag2. Messages are
    compressed in chunks of ``chunk_size`` bytes by ``zstd``, ``lz4`` or ``none``. A chunk that is
    not full is completed by the first `write` after ``flush_interval`` seconds; if messages may
    stop arriving, also call `flush`, from a timer on steady time. A new file begins once the
    current one holds ``max_bytes`` bytes, or spans ``max_duration`` seconds of log time (0:
    never). The attribute ``custom_data`` may be extended until `close`.

    Raises BagExistsError if the folder already exists, BagWriteError if it cannot be created or
    written to; no folder is left behind. Every method raises BagWriteError if writing fails: the
    bag then accepts no more messages, and `recover` rescues what reached the disk.
    """

    def __init__(
        self,
        folder: Path | str,
        *,
        ros_distro: str,
        custom_data: Mapping[str, str] | None = None,
        chunk_size: int = _MEBIBYTE,
        compression: str = "zstd",
        flush_interval: float = 1.0,
        max_bytes: int = 0,
        max_duration: float = 0.0,
    ) -> None:
        if compression not in _COMPRESSIONS:
            raise BagError(f"compression {compression!r}; allowed: {', '.join(_COMPRESSIONS)}")
        if not chunk_size > 0 or max_bytes < 0 or not max_duration >= 0 or not flush_interval > 0:
            raise BagError(
                "chunk_size and flush_interval must be above 0, max_bytes and max_duration at "
                f"least 0; given {chunk_size}, {flush_interval}, {max_bytes}, {max_duration}"
            )
        self.folder = Path(folder).absolute()
        self.ros_distro = ros_distro
        self.custom_data = dict(custom_data or {})
        self.counts: dict[str, int] = {}  # messages written so far, by topic
        self._chunk_size = chunk_size
        self._compression = _COMPRESSIONS[compression]
        self._flush_interval = round(flush_interval * NANOSECONDS_PER_SECOND)
        self._max_bytes = max_bytes
        self._max_span = round(max_duration * NANOSECONDS_PER_SECOND)
        self._topics: dict[str, TopicInfo] = {}
        self._files: list[FileInformation] = []  # the last one is the current file
        self._flush_at: int | None = None  # on the steady clock; None: nothing is pending
        self._closed = False
        make_folder(Path(folder))
        try:
            self._open_file()
            self._write_description()
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise _write_error(error, f"{folder}: cannot be written to, removed") from None

    def __exit__(self, *_: object) -> None:
        self.close()

    def add_topic(self, topic: TopicInfo) -> None:
        """Announce a topic, which is in the bag even without messages; BagError if it exists."""
        if topic.name in self._topics:
            raise BagError(f"{topic.name}: already in the bag")
        if not topic.is_storable:
            raise BagError(f"{topic.name}: type {topic.type!r} does not read package/msg/Type")
        self._require_open()
        self._topics[topic.name] = topic
        self.counts[topic.name] = 0
        try:
            self._register(topic)
            # Updated now, so that metadata.yaml lists every topic even after a crash.
            self._write_description()
        except OSError as error:
            raise self._failure(error) from None

    def write(self, topic: str, data: bytes, log_time: int, publish_time: int) -> None:
        """
        Record one message of an announced topic, in CDR with its four-byte header.

        The log time is when it was received, or the time that it is about; the publish time is
        when it was sent [ns since the epoch]. Raises BagError if the topic or a time is invalid,
        and DiskFullError if the disk is full: unless its text says otherwise, the bag has then
        been closed with all that was written, including this message.
        """
        self._require_open()
        channel = self._channels.get(topic)
        if channel is None:
            raise BagError(f"{topic}: not announced with add_topic")
        if not (0 <= log_time < 2**64 and 0 <= publish_time < 2**64):
            raise BagError(
                f"{topic}: a time is outside of 0 to 2**64 - 1 ns: "
                f"log time {log_time}, publish time {publish_time}"
            )
        try:
            self._writer.add_message(channel, log_time, data, publish_time)
        except OSError as error:
            raise self._failure(error) from None
        current = self._files[-1]
        if log_time < current.start or not current.message_count:
            current.start = log_time
        if log_time > current.end:
            current.end = log_time
        current.message_count += 1
        self.counts[topic] += 1
        self._complete(current)

    def _complete(self, current: FileInformation) -> None:
        """Complete the chunk once it is old enough, and the file once it is large enough."""
        now = time.monotonic_ns()
        if self._flush_at is None:
            self._flush_at = now + self._flush_interval
        elif now >= self._flush_at:
            self.flush()
        if self._file.full:
            full = f"disk full after {sum(self.counts.values())} messages"
            self.custom_data[ENDED_EARLY] = full
            self.close()
            raise DiskFullError(
                f"{self.folder}: {full}; all of them are in the bag, which is closed and readable"
            )
        if (self._max_bytes and self._file.tell() >= self._max_bytes) or (
            self._max_span and current.end - current.start >= self._max_span
        ):
            try:
                self._close_file()
                self._file.close()
                self._open_file()
            except OSError as error:
                raise self._failure(error) from None
            for topic in self._topics.values():
                self._register(topic)

    def flush(self) -> None:
        """
        Write everything pending to the file, so that a crash of this process loses none of it.

        A separate thread then syncs it to the disk, so that a power failure loses only later
        messages; the caller does not wait for that. Without new messages it costs nothing.
        """
        self._require_open()
        if self._flush_at is None:
            return
        self._flush_at = None
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._file.start_sync()
        except OSError as error:
            raise self._failure(error) from None

    def close(self) -> None:
        """Finish the bag: index, statistics, description. A second call does nothing."""
        if self._closed:
            return
        try:
            self._close_file()
            self._write_description()
            self._file.close()
        except OSError as error:
            raise self._failure(error) from None
        self._closed = True

    def _require_open(self) -> None:
        if self._closed:
            raise BagWriteError(f"{self.folder}: the bag is closed")

    def _failure(self, error: OSError) -> BagWriteError:
        """Abandon the current file as it is; return the error to raise."""
        self._closed = True
        self._file.close()
        return _write_error(
            error, f"{self.folder}: not closed; `entrain bag recover` rescues what is in it"
        )

    def _open_file(self) -> None:
        path = self.folder / f"{self.folder.name}_{len(self._files)}.mcap"
        # Space for a chunk that does not compress, the index and the descriptions.
        self._file = _ReservingFile(path, 2 * self._chunk_size + _MEBIBYTE)
        self._files.append(FileInformation(path.name))
        output: Any = self._file
        self._writer = ChunkWriter(
            output, self._chunk_size, self._compression, enable_data_crcs=True
        )
        self._schemas = {("", "", ""): 0}  # id by type, encoding and text; 0 is no schema
        self._channels: dict[str, int] = {}  # id by topic
        self._flush_at = None
        self._writer.start("ros2", f"gait_entrainment {LIBRARY_IDENTIFIER}")
        self._writer.add_metadata(RECORD_NAME, self._description().as_record())

    def _register(self, topic: TopicInfo) -> None:
        schema = topic.type, topic.schema_encoding, topic.schema_text
        if schema not in self._schemas:
            data = topic.schema_text.encode(errors="surrogateescape")
            self._schemas[schema] = self._writer.register_schema(*schema[:2], data)
        metadata = {
            "offered_qos_profiles": offered_qos_text(topic.qos_profiles),
            "topic_type_hash": topic.type_hash,
        }
        self._channels[topic.name] = self._writer.register_channel(
            topic.name, topic.message_encoding, self._schemas[schema], metadata
        )

    def _close_file(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._writer.add_metadata(RECORD_NAME, self._description().as_record())
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.sync()

    def _description(self) -> BagDescription:
        topics = [(topic, self.counts[topic.name]) for topic in self._topics.values()]
        return BagDescription(topics, self._files, self.custom_data, self.ros_distro)

    def _write_description(self) -> None:
        try:
            self._description().write(self.folder)
        except OSError as error:
            if not self._file.make_room(error):
                raise
            self._description().write(self.folder)


def _write_error(error: OSError, what: str) -> BagWriteError:
    if error.errno in _DISK_FULL:
        return DiskFullError(f"{what}: disk full")
    return BagWriteError(f"{what}: {first_line(error)}")


def _open_new(path: Path) -> FileIO:
    return path.open("xb", buffering=0)


class _ReservingFile:
    """
    The file that a recording is written to, with space reserved for its end.

    When the disk is full, the reserved space is released for the current write and the end of the
    bag; `full` then tells the writer to close the bag. An unnamed file holds the space, so a
    process that is killed leaves nothing behind.
    """

    def __init__(self, path: Path, reserve: int) -> None:
        self.full = False
        self._size = 0
        self._syncing = ThreadPoolExecutor(1)
        self._synced: Future[None] | None = None
        self._raw = _open_new(path)
        self._reserve = tempfile.TemporaryFile(dir=path.parent, buffering=0)  # noqa: SIM115
        try:
            os.posix_fallocate(self._reserve.fileno(), 0, reserve)
        except OSError as error:
            # Some file systems cannot reserve space; if they are full, the bag stays unfinished.
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                self.close()
                raise

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        while rest:
            try:
                written = self._raw.write(rest)
            except OSError as error:
                if not self.make_room(error):
                    raise
                continue
            self._size += written
            rest = rest[written:]
        return len(data)

    def make_room(self, error: OSError) -> bool:
        """Release the reserved space, if the disk is full and it is still reserved."""
        if error.errno not in _DISK_FULL or self.full:
            return False
        self.full = True
        self._reserve.close()
        return True

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Do nothing: there is no buffer, every write goes directly to the kernel."""

    def start_sync(self) -> None:
        """Sync the data to the disk in a thread, unless a sync is still running."""
        if self._synced is None or self._synced.done():
            if self._synced is not None:
                self._synced.result()  # raises its error, if any
            self._synced = self._syncing.submit(os.fdatasync, self._raw.fileno())

    def sync(self) -> None:
        os.fsync(self._raw.fileno())

    def close(self) -> None:
        self._syncing.shutdown()
        self._raw.close()
        self._reserve.close()
