# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Step numbers for what was detected, by a model of the period.

A sensor does not know which step it sees, and one that counts loses count at the first event that
it misses. Here a place in the gait follows from the time since the latest event, in strides of the
person's own median: a missed event leaves a gap in the numbers, a
doubled one finds its place taken, and neither moves the number of any other event.
"""

import math
from dataclasses import dataclass

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.gait import GaitEvent, GaitLimits
from gait_entrainment_sensors.detection import Detection, OwnMedian

# Heel strike and toe-off of each leg; a kind and side comes back after so many places.
_PLACES = 4
# Strides of either kind and side whose median is the period: two wrong ones do not move it.
_OWN_STRIDES = 9
# From so many on the median is known: one missed event can spoil one of them.
_KNOWN_STRIDES = 3
# Detections of a kind and side refused in a row after which it is the model that is wrong.
_CONVINCING = 3
# Strides for which places are remembered, to see which are taken.
_REMEMBERED = 4 * _PLACES


@dataclass(slots=True)
class NumberingCounts:
    """What became of the detections."""

    numbered: int = 0
    repeated: int = 0  # dropped: its place was taken
    implausible: int = 0  # dropped: too early or too late for any place
    airborne: int = 0  # dropped: toe-offs before the other foot's strike, as in running
    missed: int = 0  # places that were passed by without a detection
    restarts: int = 0  # times that the detections fitted together, but not what was known


def numbered(found: Detection, step: int) -> GaitEvent:
    """Return a detection as the event of a step."""
    return GaitEvent(nanoseconds(found.time), found.kind, found.side, step, found.uncertainty)


class Numbering:
    """
    Numbers the detections of both feet, given in the order in which they were detected.

    The first heel strike is step 0; with ``first_side`` it is step 0 or 1, such that strikes of
    that side have even numbers. Strikes and toe-offs of a side return once a stride, so each
    belongs to the place of its kind and side that is nearest to where the period predicts it from
    the latest strike: half a stride either way. While the period is not known, to the next such
    place after the latest event. A runner's feet leave the ground before the other one strikes:
    such toe-offs have no place. ``limits`` say which strides can be
    (`gait_entrainment.gait.GaitLimits`).
    """

    def __init__(self, first_side: Side | None = None, limits: GaitLimits | None = None) -> None:
        self.limits = limits or GaitLimits()
        self.counts = NumberingCounts()
        self._even = first_side  # the side whose strikes have even numbers
        self._known: dict[int, float] = {}  # remembered events: place -> time [s]
        self._strides = OwnMedian(_KNOWN_STRIDES, _OWN_STRIDES)
        # Time of the latest detection of each kind and side [s], and its place; None if refused.
        self._previous: list[tuple[float, int | None]] = [(-math.inf, None)] * _PLACES
        self._latest = -1  # place
        self._refused = [0] * _PLACES  # in a row, by the first place of kind and side

    @property
    def period(self) -> float:
        """The person's own stride period [s]; 0 before it is known."""
        return self._strides.value

    def add(self, detection: Detection) -> GaitEvent | None:
        """Return the event, numbered, or None if it can have no place in the gait."""
        if not self._known:
            if detection.kind is not EventKind.HEEL_STRIKE:  # with which a run begins
                return None
            fate, place = "", self._begin(detection)
        else:
            fate, place = self._place(detection)
        first = self._first_place(detection)
        if fate != "repeated":
            self._measure(first, detection.time, None if fate else place)
        if fate:
            setattr(self.counts, fate, getattr(self.counts, fate) + 1)
            self._refused[first] += fate == "implausible"
            if self._refused[first] < _CONVINCING:
                return None
            place = self._restart(detection)
        self._refused[first] = 0
        self._accept(detection, place)
        return numbered(detection, (place + 1) // 2)

    def troubles(self) -> tuple[str, ...]:
        """Return what a person should know, each in one line; empty if all is well."""
        counts = self.counts
        told = []
        if counts.repeated or counts.implausible:
            told.append(
                f"{counts.repeated} detections repeated an event, {counts.implausible} fitted no "
                "place in the gait"
            )
        if counts.airborne:
            told.append(f"{counts.airborne} toe-offs precede the other's strike: running? clocks?")
        if counts.missed:
            told.append(f"{counts.missed} events were missed")
        if counts.restarts:
            told.append(f"the count was begun anew {counts.restarts} times")
        return tuple(told)

    def _begin(self, detection: Detection) -> int:
        """Return the place of the first heel strike."""
        self._even = self._even if self._even is not None else detection.side
        return self._first_place(detection)

    def _first_place(self, detection: Detection) -> int:
        """Return the first place of a kind and side: strikes 0 and 2, toe-offs 3 and 1."""
        even = detection.side is self._even
        if detection.kind is EventKind.HEEL_STRIKE:
            return 0 if even else 2
        return 3 if even else 1

    def _place(self, detection: Detection) -> tuple[str, int]:
        """Return as what a detection must be dropped, or an empty text, and its place."""
        time, first, least = detection.time, self._first_place(detection), self.limits.stride_least
        earlier = [p for p, known in self._known.items() if known < time]
        before = max(earlier, default=-1)
        after = min((p for p, known in self._known.items() if known >= time), default=math.inf)
        same = max((p for p in self._known if (p - first) % _PLACES == 0), default=None)
        if same is not None and abs(time - self._known[same]) < least:
            return "repeated", same
        if before < 0:  # earlier than all that is remembered
            return "implausible", first
        strike = max((p for p in earlier if p % 2 == 0), default=-_PLACES)
        # Who runs strikes after the other foot's toe-off, and soon.
        runs = self.period or time - self._known[before] < least
        since = strike if runs and before - strike < _PLACES else before
        place = since + 1 + (first - since - 1) % _PLACES  # the next of the kind and side
        if place == strike + 3 and self._comes_before(strike + 2, time):
            return "airborne", place
        if self.period:
            # From that strike, a quarter of a stride a place: the error is one place at most.
            strides = (time - self._known[since]) / self.period
            place = first + _PLACES * round((since - first) / _PLACES + strides)
            if place in self._known:
                return "repeated", place
            if same is not None:
                least = (1 - self.limits.stride_change) * self.period * (place - same) / _PLACES
                if time - self._known[same] < least:
                    return "implausible", place
        before = strike if first % 2 == 0 else before
        return ("" if before < place < after else "implausible"), place

    def _comes_before(self, strike: int, time: float) -> bool:
        """Whether a time is before that of the other foot's strike, as far as one can know."""
        if (latest := self._known.get(strike - _PLACES)) is None:
            return False
        # Of a stride that is not known yet one step is, and the other may be shorter by a quarter.
        stride = self.period or 1.75 * (self._known[strike - 2] - latest)
        return time < latest + stride

    def _measure(self, first: int, time: float, place: int | None) -> None:
        """
        Take the stride since the latest detection of a kind and side, whether taken or refused.

        Were those refused left out, a period of two strides would confirm itself.
        """
        (before, known), self._previous[first] = self._previous[first], (time, place)
        strides = 1 if place is None or known is None else max((place - known) // _PLACES, 1)
        if self.limits.stride_least <= (time - before) / strides <= self.limits.stride_most:
            self._strides.add((time - before) / strides)

    def _accept(self, detection: Detection, place: int) -> None:
        """Remember an event."""
        counts, latest = self.counts, self._latest
        counts.numbered += 1
        if place < latest:
            counts.missed -= 1
        elif latest >= 0:
            counts.missed += place - latest - 1
        self._latest = max(latest, place)
        self._known[place] = detection.time
        self._known = {p: t for p, t in self._known.items() if p > self._latest - _REMEMBERED}

    def _restart(self, detection: Detection) -> int:
        """Believe the detections rather than the model; return the place to go on from."""
        elapsed = detection.time - self._known[self._latest]
        passed = max(round(_PLACES * elapsed / self.period), 0) if self.period else 0
        place = self._latest + passed + 1
        place += (self._first_place(detection) - place) % _PLACES
        self._known = {}
        self._refused = [0] * _PLACES
        self._strides = OwnMedian(_KNOWN_STRIDES, _OWN_STRIDES)
        self.counts.restarts += 1
        return place
