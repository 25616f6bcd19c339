# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One run of the simulated walker without a node: takes promises, yields what to publish.

It never computes past the last promise of the perturbator. In lock-step every promised stretch is
walked at once; in real time as the wall clock advances, slightly ahead of it if torque is
promised. A stretch for which no promise came in time is walked without torque and counted.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.robot import TorqueProfile
from gait_entrainment_msgs.msg import Progress, WalkerTiming
from gait_entrainment_nodes.messaging.stamps import PROGRESS_PERIOD, header
from gait_entrainment_nodes.nodes.lateness import Lateness
from gait_entrainment_nodes.nodes.walker_run import Stretch, WalkerRun

# Grants that may be sent before the recorder has acknowledged the first of them: two let it
# write one while the next is computed.
UNACKNOWLEDGED_GRANTS = 2
# Real time: how long before it is due a promised stretch is walked and made ready to send [ns]. A
# stop in between ends the torque at the end of what has been walked.
HEAD_START = 1_000_000


@dataclass(frozen=True)
class Starved:
    """The start of a stretch without a promise, walked without torque; its length so far [ns]."""

    length: int


class _Account:
    """
    What both kinds of run share: the figures of one run.

    ``start`` is the stamp of heel strike 0 [ns since 1970], from which all other times count.
    """

    def __init__(self, number: int, walker: WalkerRun, start: int) -> None:
        self.number, self.walker, self.start = number, walker, start
        self.lateness = Lateness()  # of samples, from when they were due to when they were sent
        self.grant = 0  # number of the next progress report
        self.reproducible = True
        self.late_stretches = self.starved_stretches = 0
        self._heard: set[Side] = set()  # ankles whose promise has arrived, see _all_arrived

    @property
    def stamp(self) -> int:
        """Time up to which everything has been walked [ns since 1970]."""
        return self.start + self.walker.reached

    def _accept(self, profile: TorqueProfile) -> int:
        """Take a promise; return how much of it arrived too late [ns], and count that."""
        late = self.walker.accept(profile)
        if late:
            self.late_stretches += 1
            self.reproducible = False
        return late

    def _all_arrived(self, profile: TorqueProfile) -> bool:
        """Note a promise; return whether those of all ankles have arrived, and then start over."""
        self._heard.add(profile.side)
        if all_arrived := len(self._heard) >= self.walker.ankles:
            self._heard.clear()
        return all_arrived

    def stop(self, instant: int) -> None:
        """End all torque at a time, or now if that is past."""
        self.walker.stop(instant)
        self.reproducible = False

    def progress(self, *, aborted: bool = False) -> Progress:
        """Report how far everything has been sent, and at the end of the run how it ended."""
        state, message, ending = Progress.WALKING, "", self.walker.ending
        if ending is not None:
            state = Progress.FELL if ending.kind == "fall" else Progress.FLEW_OFF
            message = ending.message
        elif aborted:
            state, message = Progress.ABORTED, "walker_sim was shut down"
        elif self.walker.ended:
            state = Progress.FINISHED
        self.grant += 1
        return Progress(
            header=header(self.stamp),
            run=self.number,
            grant=self.grant - 1,
            events=self.walker.events,
            samples=self.walker.samples,
            reproducible=self.reproducible,
            state=state,
            message=message,
        )

    def timing(self) -> WalkerTiming:
        """Report how well the run kept time."""
        return WalkerTiming(
            header=header(self.stamp),
            run=self.number,
            late_stretches=self.late_stretches,
            late=self.walker.late / NANOSECONDS_PER_SECOND,
            starved_stretches=self.starved_stretches,
            starved=self.walker.starved / NANOSECONDS_PER_SECOND,
            samples=self.lateness.count,
            publish_late_p50=self.lateness.quantile(0.5),
            publish_late_p99=self.lateness.quantile(0.99),
            publish_late_worst=self.lateness.quantile(1.0),
        )


class LockStepRun(_Account):
    """Walks promised stretches at once; if ``acknowledged``, as far as a recorder keeps up."""

    def __init__(self, *of_run: Any, acknowledged: bool) -> None:
        super().__init__(*of_run)
        self._waits = acknowledged
        self._acknowledged = 0  # how many grants the recorder has acknowledged
        self._promised: deque[tuple[int, bool]] = deque()  # (until, last), not walked yet

    def promise(self, profile: TorqueProfile, last: bool) -> int:
        """
        Take a promise, the last of which ends the run; return how much arrived too late [ns].

        Raises ValueError if the promise before it is missing.
        """
        late = self._accept(profile)
        if self._all_arrived(profile):
            self._promised.append((profile.valid_until, last))
        return late

    def acknowledge(self, progress: Progress) -> None:
        """Note that the recorder has everything up to a grant."""
        self._acknowledged = progress.grant + 1

    def due(self) -> float | None:
        """Return 0 if ``walk`` has something to yield, None if not yet."""
        ahead = self._waits and self.grant - self._acknowledged >= UNACKNOWLEDGED_GRANTS
        return 0.0 if self._promised and not (ahead or self.walker.ended) else None

    def wait(self) -> None:
        """Do not wait: what was yielded is published immediately."""

    def walk(self) -> Iterator[Stretch | Progress]:
        """Walk as far as is allowed; publish each result before asking for the next."""
        while self.due() is not None:
            until, last = self._promised.popleft()
            yield self.walker.advance(max(until, self.walker.reached), last=last)
            yield self.progress()


class RealTimeRun(_Account):
    """Walks as time passes: time 0 is due at ``due_at`` [ns] of the steady ``clock``."""

    def __init__(
        self, *of_run: Any, due_at: int, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        super().__init__(*of_run)
        self._due_at, self._clock = due_at, clock
        self._end: int | None = None  # of the run, once the last promise has arrived
        self._starving = False  # the stretch walked last had no promise
        self._next_progress = 0

    def promise(self, profile: TorqueProfile, last: bool) -> int:
        """See `LockStepRun`."""
        late = self._accept(profile)
        # If the last promise is late, its end is already past.
        ends = last and self._all_arrived(profile)
        self._end = max(profile.valid_until, self.walker.reached) if ends else None
        return late

    @property
    def _next(self) -> int:
        """When a sample, a report or the end of the run is due next [ns since its start]."""
        due = min(self.walker.next_sample, self._next_progress)
        return due if self._end is None else min(due, self._end)

    @property
    def _ready(self) -> int:
        """When the walk up to ``_next`` may start [ns since the start of the run]."""
        return self._next - (HEAD_START if self.walker.promised > self._next else 0)

    def due(self) -> float:
        """Return the steady time [s] at which ``walk`` has something to yield."""
        return (self._due_at + self._ready) / NANOSECONDS_PER_SECOND

    def wait(self) -> None:
        """Wait until the stretch that was yielded may be published."""
        early = self._due_at + self.walker.reached - self._clock()
        time.sleep(max(early, 0) / NANOSECONDS_PER_SECOND)

    def walk(self) -> Iterator[Stretch | Starved | Progress]:
        """Walk as far as is allowed now; publish each result before asking for the next."""
        now = self._clock() - self._due_at
        if now < self._ready:
            return
        last = self._end is not None and now >= self._end
        starved = self.walker.starved
        # A sample is part of a stretch only if that continues past it.
        until = now if now >= self._next else self._next + 1
        stretch = self.walker.advance(
            until if self._end is None else min(until, self._end), last=last
        )
        yield stretch
        sent = self._clock() - self._due_at
        for instant in stretch.sample_times:
            self.lateness.add((sent - int(instant)) / NANOSECONDS_PER_SECOND)
        was_starving, self._starving = self._starving, self.walker.starved > starved
        if self._starving and not was_starving:
            self.starved_stretches += 1
            self.reproducible = False
            yield Starved(self.walker.starved - starved)
        if self.walker.reached >= self._next_progress or self.walker.ended:
            reached = self.walker.reached
            self._next_progress = reached - reached % PROGRESS_PERIOD + PROGRESS_PERIOD
            yield self.progress()


Run = LockStepRun | RealTimeRun
