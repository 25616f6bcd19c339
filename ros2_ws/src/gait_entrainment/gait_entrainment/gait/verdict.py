# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The entrainment verdict: the gait is shown to follow the pulses, or shown not to, or neither.

The lag of an indifferent walker is a random walk: each stride adds pulse period minus stride
period, so it drifts by D, their mean difference, and wanders with the noise of the strides. The
lag of a locked walker is stationary. So the gait is entrained if the lag stays put: if its spread
is small compared with that due to D and that due to wandering. A slope of the lag that does not
differ from zero is only a failure to reject, and would call noise entrained.
"""

import cmath
import enum
import math
import statistics
from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.gait.drift import Drift, drift_of
from gait_entrainment.gait.pulse_phase import PulsePhase
from gait_entrainment.gait.strides import Stride, UnperturbedPeriod
from gait_entrainment.settings import Checked, setting


class Verdict(enum.IntEnum):
    """What can be claimed about the gait and the pulses."""

    UNDECIDED = 0  # neither claim can be made
    ENTRAINED = 1  # the lag is shown to stay put, for several strides
    DRIFTING = 2  # drift shown not to be small, never entrained before
    LOST = 3  # drift shown not to be small, entrained before
    UNTESTABLE = 4  # no number of such pulses could decide it


class Reason(enum.IntEnum):
    """Why no claim is made."""

    NONE = 0  # a claim is made: entrained, drifting or lost
    FEW_PULSES = 1  # fewer than the window needs
    HOLE = 2  # the same, because of a hole in the record
    UNCLEAR = 3  # the lag neither stays put nor is shown to drift
    CREEPING = 4  # the lag keeps moving smoothly: a slow passage, or an unfinished approach
    TOO_CLOSE = 5  # pulse period and unperturbed period are too close to tell apart
    BASELINE_UNKNOWN = 6  # fewer than two complete strides before the first pulse
    NOT_ONE_TO_ONE = 7  # pulses at a rate other than one per stride


@dataclass(frozen=True)
class VerdictSettings(Checked):
    """
    Every number in the verdict; raises SettingError if one is out of range.

    D is the difference between pulse period and unperturbed period. A spread of the lag is given
    as the steady drift per stride that would cause it.
    """

    window: int = setting(20, "fewest pulses judged at a time", "1", (5, 1000))
    longest_window: int = setting(40, "most pulses judged at a time", "1", (5, 1000))
    judged_from: int = setting(25, "pulses that suffice for a longer window", "1", (5, 1000))
    window_deviations: float = setting(
        100.0, "drift by D over the window / deviation of the baseline", "1", (1.0, 1e4)
    )
    spread_margin: float = setting(0.35, "spread of an entrained lag / D", "1", (0.01, 1.0))
    scatter_margin: float = setting(0.32, "the same / scatter of the lag", "1", (0.01, 1.0))
    quiet_margin: float = setting(0.12, "spread that is always small / D", "1", (0.001, 1.0))
    drift_margin: float = setting(0.25, "slope of a drifting lag / D", "1", (0.01, 1.0))
    period_margin: float = setting(
        0.25, "(mean stride period - pulse period) / D of an entrained gait", "1", (0.01, 1.0)
    )
    successive: int = setting(5, "successive strides that must pass", "1", (1, 1000))
    smallest_difference: float = setting(0.002, "smallest testable D", "s", (0.0, 1.0))
    smallest_difference_errors: float = setting(
        2.0, "the same in standard errors of the unperturbed period", "1", (0.0, 100.0)
    )
    largest_difference: float = setting(
        0.25, "largest D at one pulse per stride / unperturbed period", "1", (0.01, 0.5)
    )
    irregularity: float = setting(0.0, "planned variation of pulse intervals", "s", (0.0, 100.0))
    stretch_tolerance: float = setting(
        0.010, "distance from the final lag of an entrained stride", "s", (0.0, 1.0)
    )
    stretch_tolerance_deviations: float = setting(
        2.0, "the same in standard deviations of the lag, if larger", "1", (0.0, 10.0)
    )


@dataclass(frozen=True, slots=True)
class Entrainment:
    """The verdict at one stride, and the figures that it rests on."""

    verdict: Verdict
    reason: Reason
    stretch: int  # number, from 1, of the pulses of one train without a hole between them
    stride: int  # stride at which the verdict was formed
    stamp: int  # heel strike that closes it [ns]
    since_stride: int  # stride since which this verdict has held
    unperturbed_period: float  # mean stride period before the first pulse [s]; NaN if unknown
    unperturbed_period_error: float  # its standard error [s]; NaN with fewer than two strides
    pulse_period: float  # mean period of the onsets in the window [s]; NaN with one
    mean_period: float  # mean stride period over the window [s]
    drift: float  # slope of the unwrapped lag [s per stride]; NaN with fewer than three pulses
    drift_interval: float  # half width of its 95 % interval [s per stride]
    window: int  # pulses that the verdict needs
    spread: float  # of the lag, as the steady drift that would spread it as much [s per stride]
    scatter: float  # of the lag from pulse to pulse [s]; NaN with fewer than three pulses
    phase_locking_value: float  # length of the mean phase vector, 0 to 1; reported, not used
    entrained_since_stride: int | None  # since when every lag has been near the final one


class _Outliers:
    """
    Finds the last value of a growing sequence above any level, in logarithmic time.

    It keeps the values that no later one exceeds. These decrease, and the last value above a level
    is among them. An entrained lag leaves a handful; only a steady drift keeps them all.
    """

    def __init__(self) -> None:
        self._falling: list[float] = []  # negated, hence ascending as bisect requires
        self._positions: list[int] = []

    def add(self, value: float, position: int) -> None:
        while self._falling and self._falling[-1] >= -value:
            self._falling.pop()
            self._positions.pop()
        self._falling.append(-value)
        self._positions.append(position)

    def last_above(self, level: float) -> int:
        """Return the position of the last value above ``level``, -1 if there is none."""
        index = bisect_left(self._falling, -level)
        return self._positions[index - 1] if index else -1


class EntrainmentTest:
    """
    Forms a new verdict at each stride with pulses.

    A stride without a pulse adds nothing about the pulses and is skipped, so the verdict stays
    after the last pulse and washout does not lose it. The work per stride depends on the window,
    not on the length of the run.
    """

    def __init__(self, settings: VerdictSettings) -> None:
        self._settings = settings
        self._since = self._stretch = 0
        self._after_hole = False
        self._strides: list[int] = []  # stride of each pulse with a lag
        self.restart(hole=False)

    def restart(self, *, hole: bool) -> None:
        """Forget the pulses so far: another train begins, or a hole in the record ends."""
        self._stretch += bool(self._strides) or not self._stretch
        self._after_hole = hole and (self._after_hole or bool(self._strides))
        longest = max(self._settings.window, self._settings.longest_window)
        self._window: deque[tuple[PulsePhase, Stride]] = deque(maxlen=longest)
        self._strides = []
        self._above, self._below = _Outliers(), _Outliers()
        self._passed = 0  # successive evaluations that met the criteria for entrained
        self._was_entrained = False
        self._verdict: Verdict | None = None

    def add(
        self, stride: Stride, pulses: Sequence[PulsePhase], unperturbed: UnperturbedPeriod
    ) -> Entrainment | None:
        """Take one stride with its pulses; return None if none of them has a lag."""
        placed = [pulse for pulse in pulses if not math.isnan(pulse.phase_lag)]
        if not placed:
            return None
        for position, pulse in enumerate(placed, start=len(self._strides)):
            self._strides.append(pulse.stride)
            self._above.add(pulse.unwrapped_lag, position)
            self._below.add(-pulse.unwrapped_lag, position)
            self._window.append((pulse, stride))
        first, last = self._window[0][0], self._window[-1][0]
        pulse_period = _mean_period(first.onset, last.onset, last.number - first.number)
        difference = abs(pulse_period - unperturbed.mean)
        size = self._size(difference, unperturbed.deviation)
        window = [pulse for pulse, _ in self._window][-size:]
        lags = [pulse.unwrapped_lag for pulse in window]
        positions = [pulse.stride + pulse.phase for pulse in window]
        drift = drift_of(positions, [pulse.number for pulse in window], lags)
        oldest = self._window[-len(window)][1]
        mean_period = _mean_period(oldest.start, stride.end, stride.number - oldest.number + 1)
        reason = self._untestable(difference, unperturbed)
        if reason is Reason.NONE or len(window) < 2:
            near = abs(mean_period - pulse_period) < self._settings.period_margin * difference
            full = len(window) >= min(size, self._settings.judged_from)
            verdict, reason = self._judge(drift, difference, near=near, full=full)
        else:
            self._passed, verdict = 0, Verdict.UNTESTABLE
        if verdict != self._verdict:
            self._verdict, self._since = verdict, stride.number
        entrained = verdict == Verdict.ENTRAINED
        return Entrainment(
            verdict=verdict,
            reason=reason,
            stretch=self._stretch,
            stride=stride.number,
            stamp=stride.end,
            since_stride=self._since,
            unperturbed_period=unperturbed.mean,
            unperturbed_period_error=unperturbed.standard_error,
            pulse_period=pulse_period,
            mean_period=mean_period,
            drift=drift.slope,
            drift_interval=drift.half_width,
            window=size,
            spread=drift.spread,
            scatter=drift.scatter,
            phase_locking_value=_phase_locking_value(window),
            entrained_since_stride=self._first_near(lags) if entrained else None,
        )

    def _size(self, difference: float, deviation: float) -> int:
        """Return how many pulses it takes to tell drift from wandering; arguments in s."""
        settings, longest = self._settings, self._window.maxlen or 0
        if not deviation * settings.window_deviations < longest * difference:
            return settings.window if math.isnan(deviation) else longest
        return max(settings.window, math.ceil(settings.window_deviations * deviation / difference))

    def _untestable(self, difference: float, unperturbed: UnperturbedPeriod) -> Reason:
        """Return why no number of such pulses could decide; NONE if they could."""
        settings = self._settings
        if math.isnan(unperturbed.standard_error):
            return Reason.BASELINE_UNKNOWN
        if difference > settings.largest_difference * unperturbed.mean:
            return Reason.NOT_ONE_TO_ONE
        least = settings.smallest_difference_errors * unperturbed.standard_error
        if difference >= max(settings.smallest_difference, least):
            return Reason.NONE
        return Reason.TOO_CLOSE

    def _judge(
        self, drift: Drift, difference: float, *, near: bool, full: bool
    ) -> tuple[Verdict, Reason]:
        """Return the claim for a window; ``near``: mean stride period and pulse period agree."""
        settings = self._settings
        if not full:
            self._passed = 0
            return Verdict.UNDECIDED, Reason.HOLE if self._after_hole else Reason.FEW_PULSES
        scattered = settings.scatter_margin * drift.scatter
        largest = max(scattered, settings.quiet_margin * difference)
        stays = near and drift.spread < min(largest, settings.spread_margin * difference)
        self._passed = self._passed + 1 if stays and not drift.creeps else 0
        if self._passed >= settings.successive:
            self._was_entrained = True
            return Verdict.ENTRAINED, Reason.NONE
        if abs(drift.slope) - drift.half_width > settings.drift_margin * difference:
            return Verdict.LOST if self._was_entrained else Verdict.DRIFTING, Reason.NONE
        creeping = stays and drift.creeps
        return Verdict.UNDECIDED, Reason.CREEPING if creeping else Reason.UNCLEAR

    def _first_near(self, lags: Sequence[float]) -> int:
        """Return the stride since which every lag has been near the median of the window."""
        settings, final = self._settings, statistics.median(lags)
        tolerance = max(
            settings.stretch_tolerance,
            settings.stretch_tolerance_deviations * statistics.stdev(lags),
        )
        last_outlier = max(
            self._above.last_above(final + tolerance), self._below.last_above(tolerance - final)
        )
        # If the latest pulse itself is an outlier, the entrained strides start there.
        return self._strides[min(last_outlier + 1, len(self._strides) - 1)]


def _mean_period(start: int, end: int, count: int) -> float:
    """Mean [s] of ``count`` periods that fill the time between two stamps [ns]; NaN for none."""
    return (end - start) / (count * NANOSECONDS_PER_SECOND) if count else math.nan


def _phase_locking_value(window: Sequence[PulsePhase]) -> float:
    # Not sum(): its last bits differ from Python 3.14 on, and a replay must give the same bits.
    total = 0j
    for pulse in window:
        total += cmath.exp(2j * math.pi * pulse.phase)
    return min(abs(total) / len(window), 1.0)  # rounding may exceed 1
