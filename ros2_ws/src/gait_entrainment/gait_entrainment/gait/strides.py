# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Gait events and the strides of one leg; events may be missing, repeated or out of order."""

import math
import statistics
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.gait.plausibility import GaitLimits, GaitWatch

# Heel strike and toe-off of each leg.
PLACES = 4
# Three strides: by then torque has ended, as it does when the person stops.
CONVINCING_PLACES = 3 * PLACES

# Number of places of the gait that are remembered, four strides: enough to tell a repeated event
# from a late one, and a bound on memory if a leg's strikes stop arriving.
REMEMBERED_PLACES = 16


@dataclass(frozen=True, slots=True)
class GaitEvent:
    """
    A heel strike or a toe-off.

    Step numbers identify events, whatever order they arrive in: heel strike n closes step n, and
    the toe-off of step n begins its swing, between heel strikes n - 1 and n. Both belong to the
    swing leg. A run starts with heel strike 0. A source must number its steps this way.
    """

    stamp: int  # time of the event [ns since the start of the run]
    kind: EventKind
    side: Side  # the leg that strikes or leaves the ground
    step: int
    uncertainty: float = 0.0  # standard deviation of the stamp [s]; 0 if it is exact

    @property
    def place(self) -> int:
        """Place in the order of a gait: 0 for heel strike 0, 1 for toe-off 1, 2 for strike 1."""
        return 2 * self.step - (1 if self.kind == EventKind.TOE_OFF else 0)


@dataclass(frozen=True, slots=True)
class Stride:
    """One stride of a leg: from one of its heel strikes to the next."""

    number: int  # stride 1 starts at the leg's first heel strike of the run
    side: Side
    start: int  # heel strike that starts it [ns]
    end: int  # heel strike that closes it [ns]
    toe_off: int | None  # toe-off of the leg within it [ns]; None if it is missing
    step_periods: tuple[float, float]  # [s], in order; NaN if the strike between is missing
    toe_off_uncertainty: float = 0.0  # standard deviation of its stamp [s]; if missing, ``end``'s

    @property
    def period(self) -> float:
        """Stride period [s]."""
        return (self.end - self.start) / NANOSECONDS_PER_SECOND


@dataclass(slots=True)
class EventCounts:
    """Outcome of the events received, for judging the source."""

    accepted: int = 0
    out_of_order: int = 0  # accepted after an event that is later in the gait
    repeated: int = 0  # dropped: the same event again
    late: int = 0  # dropped: the stride that it belongs to was already closed or given up
    contradictory: int = 0  # dropped: stamp, side or step disagree with the events before
    implausible: int = 0  # dropped: too long or too short for a stride of this person
    missing: int = 0  # places of the gait, up to the latest, whose event was not accepted
    missed_strides: int = 0  # strides without one of their two heel strikes


class StrideTracker:
    """
    Closes the strides of one leg as its heel strikes arrive.

    Events are placed by step number, so a missing event does not change another stride's number.
    They may be out of order until the leg's next heel strike, which closes one stride and gives up
    those that still lack a bound. The side of step 0 is taken from the first event. If two events
    contradict each other, the first to arrive is accepted. Any event is accepted only if the
    strides since earlier ones can have taken that long. Three strides of events that agree with
    each other but not with those accepted replace them, so a single wrong event does not block all
    that follow. None of them may lie before the end of a returned stride, in place or in stamp.
    """

    def __init__(self, side: Side, limits: GaitLimits | None = None) -> None:
        self.side = side  # the leg whose strides are wanted
        self.watch = GaitWatch(side, limits or GaitLimits())
        self.counts = EventCounts()  # outcome of the events received so far
        self.stride_in_progress = 0  # the one that the leg's latest heel strike started
        self.latest_strike: int | None = None  # its stamp [ns]
        self._first_step: int | None = None  # step that the leg's first heel strike closes
        self._stamps: dict[int, int] = {}  # remembered events: place -> stamp
        self._toe_off: GaitEvent | None = None  # the leg's latest
        self._latest_place = -1
        self._strike_place = -1
        self._rival: StrideTracker | None = None  # of dropped events that fit together
        self._closed = (0, -math.inf)  # place and stamp of the latest strike that closed a stride

    def add(self, event: GaitEvent, now: float = math.inf) -> Stride | None:
        """Take one event, dropped if later than ``now`` [ns]; return the stride that it closes."""
        if event.stamp > now:  # has not happened, so it is never convincing
            self.counts.implausible += 1
            return None
        fate = self._fate(event)
        setattr(self.counts, fate, getattr(self.counts, fate) + 1)
        if fate != "accepted":
            return self._doubt(event) if fate in ("contradictory", "implausible") else None
        self._rival = None
        place = event.place
        if place > self._latest_place:
            self.counts.missing += place - self._latest_place - 1
            self._latest_place = place
        else:
            self.counts.missing -= 1
            self.counts.out_of_order += 1
        self._first_step = self._first_step_if(event)
        self._stamps[place] = event.stamp
        if len(self._stamps) > 2 * REMEMBERED_PLACES:
            oldest = self._latest_place - REMEMBERED_PLACES
            self._stamps = {p: stamp for p, stamp in self._stamps.items() if p >= oldest}
        if event.side != self.side:
            return None
        if event.kind == EventKind.TOE_OFF:
            self._toe_off = event
            return None
        return self._strike(event, self._first_step)

    def _fate(self, event: GaitEvent) -> str:
        """Return "accepted", or why the event must be dropped: a field of EventCounts."""
        place, stamp = event.place, event.stamp
        # Sides alternate with the steps.
        if place < 0 or self._first_step not in (None, self._first_step_if(event)):
            return "contradictory"
        if place in self._stamps:
            return "repeated" if stamp == self._stamps[place] else "contradictory"
        for other, known in self._stamps.items():
            if known == stamp or (other < place) != (known < stamp):
                return "contradictory"
        if place < max(self._strike_place, self._latest_place - REMEMBERED_PLACES):
            return "late"
        return "accepted" if self._believes(place, stamp) else "implausible"

    def _believes(self, place: int, stamp: int) -> bool:
        """Whether the strides since the latest event at least a stride before are plausible."""
        earlier = [p for p in self._stamps if p <= place - PLACES] or list(self._stamps)[:1]
        since = max(earlier, default=place)
        elapsed = stamp - self._stamps.get(since, stamp)
        return self.watch.believes((place - since) / PLACES, elapsed)

    def _doubt(self, event: GaitEvent) -> Stride | None:
        """Drop an event, unless three strides of such events agree: then go on with those."""
        if event.place < self._closed[0] or event.stamp < self._closed[1]:
            return None
        if self._rival is None or self._rival._fate(event) != "accepted":
            self._rival = StrideTracker(self.side, self.watch.limits)
        stride = self._rival.add(event)
        if self._rival.counts.accepted <= CONVINCING_PLACES:
            return None
        self.__dict__.update(self._rival.__dict__, counts=self.counts)
        counts = self.counts  # those of the wrong places are void
        counts.missing = max(self._latest_place + 1 - counts.accepted, 0)
        counts.missed_strides = min(counts.missed_strides, self.stride_in_progress)
        return stride

    def _first_step_if(self, event: GaitEvent) -> int:
        """Return the step of the leg's first heel strike, 0 or 1, that the event implies."""
        return event.step % 2 if event.side == self.side else 1 - event.step % 2

    def _strike(self, event: GaitEvent, first_step: int) -> Stride | None:
        """Take the leg's latest heel strike: close one stride or give some up."""
        started, start = self.stride_in_progress, self.latest_strike
        closed = (event.step - first_step) // 2  # number of the stride that ends here
        self.stride_in_progress, self.latest_strike = closed + 1, event.stamp
        self._strike_place = event.place
        if start is None or closed != started:
            self.watch.add(event.stamp, None)
            self.counts.missed_strides += max(closed - max(started - 1, 0), 0)
            return None
        self._closed = event.place, event.stamp
        self.watch.add(event.stamp, (event.stamp - start) / NANOSECONDS_PER_SECOND)
        middle = self._stamps.get(event.place - 2, math.nan)
        first, second = middle - start, event.stamp - middle
        step_periods = first / NANOSECONDS_PER_SECOND, second / NANOSECONDS_PER_SECOND
        toe_off = self._stamps.get(event.place - 1)
        uncertainty = (self._toe_off or event).uncertainty
        return Stride(closed, self.side, start, event.stamp, toe_off, step_periods, uncertainty)


class UnperturbedPeriod:
    """Mean period of the complete strides before the first pulse, in exact integer arithmetic."""

    def __init__(self) -> None:
        self.periods: list[int] = []  # of the strides taken [ns]
        self.mean = math.nan  # [s]
        self.deviation = math.nan  # standard deviation of the strides [s]; NaN with one
        self.standard_error = math.nan  # of the mean [s]; NaN with one stride

    def settle(self, limits: GaitLimits) -> None:
        """Set the figures from the strides near enough to their median, so without pauses."""
        own = statistics.median(self.periods or [0]) * (1 - limits.stride_change)
        kept = [p for p in self.periods if own <= p <= own / (1 - limits.stride_change) ** 2]
        n, total = len(kept), sum(kept)
        if n > 0:
            self.mean = total / (n * NANOSECONDS_PER_SECOND)
        if n > 1:
            variance = (n * sum(p * p for p in kept) - total * total) / (n * n * (n - 1))
            self.standard_error = math.sqrt(variance) / NANOSECONDS_PER_SECOND
            self.deviation = self.standard_error * math.sqrt(n)
