# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A train of torque pulses on one ankle: square, or with ramps for flanks."""

import math
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds


@dataclass(frozen=True)
class PulseTrain:
    """Pulses at a fixed period; onsets are exact integer nanoseconds."""

    side: Side
    first_onset: int  # stamp of the first onset [ns]
    period: float  # from onset to onset [s]
    count: int  # number of pulses
    torque: float  # height [N m], plantarflexion positive
    duration: float  # width [s], flanks included
    ramp: float = 0.0  # duration [s] of each flank, at most half the width; 0 is a square pulse
    rising: int = 0  # so many first pulses are lower: they rise in equal steps to the height

    def onset(self, number: int) -> int:
        """
        Return the onset [ns] of pulse ``number``, counted from 0.

        Each onset is rounded from the first one, so that rounding never accumulates.
        """
        return self.first_onset + nanoseconds(number * self.period)

    def end(self, number: int) -> int:
        """Return the instant [ns] at which pulse ``number``, counted from 0, ends."""
        return self.onset(number) + nanoseconds(self.duration)

    def latest(self, instant: int) -> int:
        """Return the number of the pulse that began last at an instant [ns]; -1 before all."""
        if instant < self.first_onset:
            return -1
        number = int((instant - self.first_onset) / (self.period * NANOSECONDS_PER_SECOND)) + 1
        number = min(number, self.count - 1)
        while number >= 0 and self.onset(number) > instant:  # the division may round upwards
            number -= 1
        return number

    def onsets_within(self, begin: int, end: int) -> tuple[int, ...]:
        """Return the onsets [ns] that lie in [begin, end)."""
        numbers = range(max(self.latest(begin), 0), self.latest(end - 1) + 1)
        return tuple(onset for onset in map(self.onset, numbers) if begin <= onset)

    def torque_at(self, instant: int) -> float:
        """Return the torque [N m] asked for at an instant [ns]."""
        number = self.latest(instant)
        return self.shape(number, instant - self.onset(number)) if number >= 0 else 0.0

    def height(self, number: int) -> float:
        """Return the height [N m] of pulse ``number``, counted from 0."""
        return self.torque * min((number + 1) / (self.rising + 1), 1.0)

    def shape(self, number: int, elapsed: int) -> float:
        """Return the torque [N m] of pulse ``number`` at a time [ns] since its onset."""
        width = nanoseconds(self.duration)
        if not 0 <= elapsed < width:
            return 0.0
        if self.ramp == 0:
            return self.height(number)
        nearest_flank = min(elapsed, width - elapsed) / NANOSECONDS_PER_SECOND
        return self.height(number) * min(nearest_flank / self.ramp, 1.0)

    def impulse_within(self, window: float) -> float:
        """
        Return the largest angular impulse [N m s] that falls into any ``window`` [s].

        No window holds more than the one that begins with a pulse. Ramps and lower first pulses
        are left out of account, so that the value is never too small.
        """
        whole = min(math.floor(window / self.period), self.count)
        rest = min(window - whole * self.period, self.duration) if whole < self.count else 0.0
        return abs(self.torque) * (whole * self.duration + rest)
