# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Step numbers for detected events, from a model of the stride period.

A sensor does not know which step it sees, and a sensor that counts is wrong from the first event
that it misses. Here the place in the gait follows from the time since the latest event, in the
person's own median strides. A missed event leaves a gap in the numbers, a doubled one finds its
place taken, and neither changes the number of any other event.
"""

import math
from dataclasses import dataclass

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.gait import GaitEvent, GaitLimits
from gait_entrainment_sensors.detection import Detection, OwnMedian

# Heel strike and toe-off of each leg: a kind and side recurs after this many places.
_PLACES = 4
# Strides of any kind and side whose median is the period: two wrong ones do not move it.
_OWN_STRIDES = 9
# The median is known after this many: one missed event can spoil one of them.
_KNOWN_STRIDES = 3
# After this many detections of a kind and side refused in a row the model is wrong.
_CONVINCING = 3
# Places that are remembered, to see which are taken: four strides.
_REMEMBERED = 4 * _PLACES


@dataclass(slots=True)
class NumberingCounts:
    """The outcome of the detections."""

    numbered: int = 0
    repeated: int = 0  # dropped: its place was taken
    implausible: int = 0  # dropped: too early or too late for any place
    airborne: int = 0  # dropped: toe-offs before the other foot's strike, as in running
    missed: int = 0  # places that were passed without a detection
    restarts: int = 0  # times that detections agreed with each other, but not with the model


def numbered(found: Detection, step: int) -> GaitEvent:
    """Return the event of a detection, with its step number."""
    return GaitEvent(nanoseconds(found.time), found.kind, found.side, step, found.uncertainty)


class Numbering:
    """
    Numbers the detections of both feet, given in the order in which they were detected.

    The first heel strike is step 0; with ``first_side`` it is step 0 or 1, so that strikes of that
    side have even numbers. Strikes and toe-offs of a side recur once a stride, so each belongs to
    the place of its kind and side that is nearest to where the period predicts it from the latest
    strike: half a stride either way. Until the period is known, it belongs to the next such place
    after the latest event. In running a foot leaves the ground before the other one strikes; such
    toe-offs have no place. ``limits`` define which strides are plausible
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
        """Return the numbered event, or None if it has no place in the gait."""
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
        """Return what a person should know, one line each; empty if all is well."""
        counts = self.counts
        lines = []
        if counts.repeated or counts.implausible:
            lines.append(
                f"{counts.repeated} detections repeated an event, {counts.implausible} fitted no "
                "place in the gait"
            )
        if counts.airborne:
            lines.append(f"{counts.airborne} toe-offs before the other's strike: running? clocks?")
        if counts.missed:
            lines.append(f"{counts.missed} events were missed")
        if counts.restarts:
            lines.append(f"the count was restarted {counts.restarts} times")
        return tuple(lines)

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
        """Return the count under which to drop a detection, empty to keep it, and its place."""
        time, first, least = detection.time, self._first_place(detection), self.limits.stride_least
        earlier = [p for p, known in self._known.items() if known < time]
        before = max(earlier, default=-1)
        after = min((p for p, known in self._known.items() if known >= time), default=math.inf)
        same = max((p for p in self._known if (p - first) % _PLACES == 0), default=None)
        if same is not None and abs(time - self._known[same]) < least:
            return "repeated", same
        if before < 0:  # earlier than all remembered events
            return "implausible", first
        strike = max((p for p in earlier if p % 2 == 0), default=-_PLACES)
        # In running a strike soon follows the other foot's toe-off.
        runs = self.period or time - self._known[before] < least
        since = strike if runs and before - strike < _PLACES else before
        place = since + 1 + (first - since - 1) % _PLACES  # the next of the kind and side
        if place == strike + 3 and self._comes_before(strike + 2, time):
            return "airborne", place
        if self.period:
            # From that strike, at a quarter of a stride per place: off by at most one place.
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
        """Whether a time is before the other foot's strike, as far as is known."""
        if (latest := self._known.get(strike - _PLACES)) is None:
            return False
        # While the stride is unknown, one step is known; the other may be shorter by a quarter.
        stride = self.period or 1.75 * (self._known[strike - 2] - latest)
        return time < latest + stride

    def _measure(self, first: int, time: float, place: int | None) -> None:
        """
        Add the stride since the latest detection of a kind and side, whether kept or refused.

        Without the refused ones, a period of two strides would confirm itself.
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
        """Trust the detections rather than the model; return the place to continue from."""
        elapsed = detection.time - self._known[self._latest]
        passed = max(round(_PLACES * elapsed / self.period), 0) if self.period else 0
        place = self._latest + passed + 1
        place += (self._first_place(detection) - place) % _PLACES
        self._known = {}
        self._refused = [0] * _PLACES
        self._strides = OwnMedian(_KNOWN_STRIDES, _OWN_STRIDES)
        self.counts.restarts += 1
        return place
