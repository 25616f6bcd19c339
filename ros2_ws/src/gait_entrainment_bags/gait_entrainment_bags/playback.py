# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Playing a bag: which message is due when. Nothing here reads a clock or sends anything.

The caller passes the time: a node can pace by absolute deadlines, and a test by chosen numbers.
"""

from collections.abc import Collection, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from fnmatch import fnmatchcase
from itertools import islice
from typing import NamedTuple

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.errors import BagError, NothingToPlayError
from gait_entrainment_bags.mcap_records import BagMessage
from gait_entrainment_bags.reader import BagReader

FASTEST = float("inf")
"""Rate at which every message is due immediately: the caller sets the pace."""

# `FASTEST` skips the ticks in a longer silence [ns]: the next log time may be years ahead.
_LONGEST_TICKING = 3600 * NANOSECONDS_PER_SECOND
# Number of messages that are read ahead while the previous ones are taken.
_AHEAD = 2000


class Moment(NamedTuple):
    """A time in the bag [ns since 1970], of a message or, without one, of a clock tick."""

    instant: int
    message: BagMessage | None


class Playback:
    """
    The messages of an open bag in the order of log time, each at its due time.

    It plays the named topics from ``start_offset`` seconds into the bag, to which a loop returns,
    for ``duration`` seconds. The rate is in seconds of the bag per second, above 0; `FASTEST`
    means no pacing. The clock ticks every ``clock_period`` seconds of the bag from the start on
    (0: never), so a listener sees the same ticks at every rate, except that `FASTEST` skips those
    in a silence of more than an hour.

    Raises BagError if a number is out of range or a topic is not in the bag, NothingToPlayError if
    no topic has a message. Methods that advance raise UnreadableBagError if the bag is damaged.
    """

    def __init__(
        self,
        bag: BagReader,
        topics: Collection[str],
        *,
        start_offset: float = 0.0,
        duration: float = float("inf"),
        rate: float = 1.0,
        loop: bool = False,
        paused: bool = False,
        clock_period: float = 0.0,
    ) -> None:
        self._topics = list(bag.require_topics(topics))
        if not any(bag.counts[topic] for topic in self._topics):
            chosen = ", ".join(self._topics) or "nothing"
            raise NothingToPlayError(f"{bag.path}: holds no messages to play on {chosen}")
        _require_positive("rate", rate)
        _require_positive("duration", duration, " s")
        offset = round(start_offset * NANOSECONDS_PER_SECOND)
        if not 0 <= offset <= bag.duration:
            raise BagError(
                f"start_offset: {start_offset:g} s; allowed: 0 to "
                f"{bag.duration / NANOSECONDS_PER_SECOND:g} s"
            )
        self.rate = rate
        self.paused = paused
        # The first time to play, and the time to stop before [ns].
        self.start = bag.start + offset
        length = min(duration * NANOSECONDS_PER_SECOND, bag.duration + 1)
        self.end = min(self.start + round(length), bag.end + 1)
        self._bag = bag
        self._loop = loop
        self._tick_period = round(clock_period * NANOSECONDS_PER_SECOND)
        # The time `_origin` in the bag is due at `_origin_at` on the steady clock.
        self._origin = self._origin_at = 0
        self._moments = self._moments_from(self.start)
        self._go_to(self.start)

    def begin(self, now: int) -> None:
        """Make the first time in the bag due now (steady time [ns])."""
        self._origin_at = now

    def due(self) -> int | None:
        """Return the steady time [ns] at which the next moment is due; None if never."""
        if self.paused or self.ended or self._next is None:
            return None
        if self.rate == FASTEST:
            return self._origin_at
        return self._origin_at + round((self._next.instant - self._origin) / self.rate)

    def take(self, now: int) -> Moment | None:
        """Return the next moment if it is due by now (steady time [ns]); None if none is."""
        due = self.due()
        return None if due is None or now < due else self._advance(due)

    def take_next(self) -> Moment | None:
        """Return the next moment while paused, whenever it is due; None after the last one."""
        if not self.paused or self.ended:
            return None
        moment = self._advance(self._origin_at)
        if moment is not None:
            self._origin = moment.instant
        return moment

    def pause(self, now: int) -> None:
        """Stop at the time in the bag that is due now."""
        if not self.paused:
            self._origin = self.instant(now)
            self.paused = True

    def resume(self, now: int) -> None:
        """Continue from where playback was paused."""
        if self.paused:
            self._origin_at = now
            self.paused = False

    def set_rate(self, rate: float, now: int) -> None:
        """Play at another rate from now on; raises BagError if it is not above 0."""
        _require_positive("rate", rate)
        self._origin, self._origin_at = self.instant(now), now
        self.rate = rate

    def seek(self, instant: int, now: int) -> None:
        """Continue from a time in the bag [ns since 1970]; BagError if that is out of range."""
        if not self.start <= instant < self.end:
            raise BagError(f"time: {instant} ns; allowed: {self.start} to {self.end - 1} ns")
        self._origin_at = now
        self._go_to(instant)

    def stop(self) -> None:
        """Stop playing; `seek` starts again."""
        self.ended = True
        self._moments.close()

    def instant(self, now: int) -> int:
        """Return the time in the bag that is due now [ns since 1970]."""
        if self.paused or self.rate == FASTEST:
            return self._origin
        return self._origin + round((now - self._origin_at) * self.rate)

    def _go_to(self, instant: int) -> None:
        self._moments.close()
        self._origin = instant
        self._moments = self._moments_from(instant)
        self._next: Moment | None = next(self._moments, None)
        self.ended = self._next is None

    def _advance(self, due: int) -> Moment | None:
        """Return the next moment, due at a steady time [ns], and fetch the one after it."""
        moment = self._next
        self._next = next(self._moments, None)
        if self.rate == FASTEST and moment is not None:
            self._origin = moment.instant
        if self._next is None:
            if self._loop:
                # Each round lasts as long as the bag, however late this call is.
                self._origin_at = due
                self._go_to(self.start)
            else:
                self.stop()
        return moment

    def _moments_from(self, start: int) -> Generator[Moment, None, None]:
        tick, period = start, self._tick_period
        with closing(_read_ahead(self._bag.messages(self._topics, start, self.end))) as messages:
            for message in messages:
                silent = message.log_time - tick
                if period and self.rate == FASTEST and silent > _LONGEST_TICKING:
                    tick += silent // period * period
                while period and tick <= message.log_time:
                    yield Moment(tick, None)
                    tick += period
                yield Moment(message.log_time, message)


def choose_topics(
    bag: BagReader, patterns: Collection[str] = (), excluded: Collection[str] = ()
) -> list[str]:
    """
    List the topics of a bag that match one of the patterns, and none of the excluded ones.

    Patterns are names, with ``*`` for any text, as in ``/gait/*``; without patterns all match.
    Raises BagError if a pattern matches no topic of the bag.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in bag.topics):
            raise BagError(f"topics: {pattern} matches no topic of {bag.path}")
    return [
        name
        for name in bag.topics
        if (not patterns or any(fnmatchcase(name, pattern) for pattern in patterns))
        and not any(fnmatchcase(name, pattern) for pattern in excluded)
    ]


def _require_positive(name: str, value: float, unit: str = "") -> None:
    if not value > 0:
        raise BagError(f"{name}: {value:g}{unit}; allowed: above 0")


def _read_ahead(messages: Iterator[BagMessage]) -> Generator[BagMessage, None, None]:
    """Read messages in a thread until closed: a chunk takes 20 ms, which would make them late."""
    with ThreadPoolExecutor(1) as reader:
        following = reader.submit(lambda: list(islice(messages, _AHEAD)))
        while batch := following.result():
            following = reader.submit(lambda: list(islice(messages, _AHEAD)))
            yield from batch
