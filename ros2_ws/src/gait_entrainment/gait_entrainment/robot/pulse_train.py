# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Torque pulses on one ankle: the onset, height and shape of each."""

import enum
import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.robot.faults import LimitError


class Shape(enum.IntEnum):
    """The course of a pulse's torque from onset to end; numbered as in Pulse.msg."""

    SQUARE = 0  # torque throughout
    HALF_SINE = 1  # torque sin(pi t / duration)
    TRAPEZOID = 2  # rises linearly over `rise`, falls linearly over `fall`
    SAMPLES = 3  # torque times equally spaced samples, linear between them


@dataclass(frozen=True)
class Pulse:
    """One pulse as requested."""

    onset: int  # stamp [ns]
    torque: float  # peak [N m], plantarflexion positive; 0 for a sham or a catch pulse
    duration: float  # width [s], flanks included
    shape: Shape = Shape.SQUARE
    rise: float = 0.0  # of a trapezoid [s]
    fall: float = 0.0  # of a trapezoid [s]
    samples: tuple[float, ...] = ()  # fractions of the torque, from onset to end

    @property
    def end(self) -> int:
        """Instant at which it ends [ns]."""
        return self.onset + nanoseconds(self.duration)

    def torque_at(self, instant: int) -> float:
        """Return the requested torque [N m] at an instant [ns]."""
        elapsed, left = instant - self.onset, self.end - instant
        if elapsed < 0 or left <= 0:
            return 0.0
        if self.shape is Shape.SQUARE:
            return self.torque
        if self.shape is Shape.TRAPEZOID:
            flanks = (elapsed, self.rise), (left, self.fall)
            shares = [t / NANOSECONDS_PER_SECOND / flank for t, flank in flanks if flank]
            return self.torque * min([*shares, 1.0])
        place = elapsed / (elapsed + left)
        if self.shape is Shape.HALF_SINE:
            return self.torque * math.sin(math.pi * place)
        index, part = divmod(place * (len(self.samples) - 1), 1)
        before, after = self.samples[int(index)], self.samples[int(index) + 1]
        return self.torque * (before + (after - before) * part)

    def check(self) -> None:
        """Raise LimitError for an impossible shape."""
        flanks = min(self.rise, self.fall) >= 0 and self.rise + self.fall <= self.duration
        if self.shape is Shape.TRAPEZOID and not flanks:
            raise LimitError(
                f"rise: {self.rise:g} s, with fall {self.fall:g} s; allowed: together at most the "
                f"width of {self.duration:g} s"
            )
        shares = 1 < len(self.samples) <= 10_000 and all(-1 <= s <= 1 for s in self.samples)
        if self.shape is Shape.SAMPLES and not shares:
            raise LimitError("samples: allowed: 2 to 10000 fractions of the torque, from -1 to 1")

    @property
    def impulse(self) -> float:
        """Magnitude of the angular impulse [N m s]; an upper bound if samples change sign."""
        share = {
            Shape.SQUARE: lambda: 1.0,
            Shape.HALF_SINE: lambda: 2 / math.pi,
            Shape.TRAPEZOID: lambda: 1 - (self.rise + self.fall) / self.duration / 2,
            Shape.SAMPLES: lambda: (
                sum(abs(a) + abs(b) for a, b in pairwise(self.samples))
                / (2 * (len(self.samples) - 1))
            ),
        }[self.shape]()
        return abs(self.torque) * self.duration * share

    @property
    def steepest(self) -> float:
        """Steepest flank [N m/s]; inf if the torque jumps."""
        if self.torque == 0:
            return 0.0
        if self.shape is Shape.HALF_SINE:
            per_second = math.pi / self.duration
        elif self.shape is Shape.TRAPEZOID and self.rise and self.fall:
            per_second = 1 / min(self.rise, self.fall)
        elif self.shape is Shape.SAMPLES and self.samples[0] == self.samples[-1] == 0:
            change = max(abs(b - a) for a, b in pairwise(self.samples))
            per_second = change * (len(self.samples) - 1) / self.duration
        else:
            per_second = math.inf
        return abs(self.torque) * per_second


@dataclass(frozen=True)
class PulseTrain:
    """Pulses in order of onset; each begins after the one before it has ended."""

    side: Side
    pulses: tuple[Pulse, ...]

    @classmethod
    def periodic(
        cls,
        side: Side,
        first_onset: int,
        period: float,
        count: int,
        torque: float,
        duration: float,
    ) -> "PulseTrain":
        """Return square pulses at a period [s], each rounded to [ns] relative to the first."""
        onsets = (first_onset + nanoseconds(number * period) for number in range(count))
        return cls(side, tuple(Pulse(onset, torque, duration) for onset in onsets))

    @cached_property
    def onsets(self) -> tuple[int, ...]:
        """Onsets of the pulses [ns]."""
        return tuple(pulse.onset for pulse in self.pulses)

    @property
    def end(self) -> int:
        """Instant at which the last pulse ends [ns]."""
        return self.pulses[-1].end

    def latest(self, instant: int) -> int:
        """Return the index of the latest pulse begun by an instant [ns]; -1 before the first."""
        return bisect_right(self.onsets, instant) - 1

    def onsets_within(self, begin: int, end: int) -> tuple[int, ...]:
        """Return the onsets in [begin, end) [ns]."""
        return self.onsets[bisect_left(self.onsets, begin) : bisect_left(self.onsets, end)]

    def torque_at(self, instant: int) -> float:
        """Return the requested torque [N m] at an instant [ns]."""
        number = self.latest(instant)
        return self.pulses[number].torque_at(instant) if number >= 0 else 0.0

    def until(self, instant: int) -> tuple[Pulse, ...]:
        """Return the pulses that began before an instant [ns], as square pulses cut off at it."""
        begun = self.pulses[: self.latest(instant - 1) + 1]
        lasted = (min(p.duration, (instant - p.onset) / NANOSECONDS_PER_SECOND) for p in begun)
        return tuple(Pulse(p.onset, p.torque, time) for p, time in zip(begun, lasted, strict=True))

    def shifted(self, by: int) -> "PulseTrain":
        """Return the train shifted by a time [ns], such as to another clock."""
        moved = (replace(pulse, onset=pulse.onset + by) for pulse in self.pulses)
        return PulseTrain(self.side, tuple(moved))

    def followed_by(self, other: "PulseTrain") -> "PulseTrain":
        """Return the pulses of this train and of another that follows it."""
        return PulseTrain(self.side, self.pulses + other.pulses)


@dataclass(frozen=True)
class PulseTiming:
    """Onsets of one pulse [ns], None if no state shows them, and the announced pulse."""

    commanded: int
    sent: int | None = None
    measured: int | None = None
    torque: float = math.nan  # height [N m]; NaN if not announced; at 0 no state shows the pulse
    duration: float = math.nan  # [s]

    @property
    def onset(self) -> int:
        """The measured onset, or the commanded one if no torque shows it."""
        return self.commanded if self.measured is None else self.measured
