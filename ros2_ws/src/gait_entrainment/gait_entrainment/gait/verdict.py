# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The entrainment verdict: the gait is shown to follow the pulses, or shown not to, or neither.

"The 95 % interval of the slope contains zero" is a failure to reject and calls noise entrained.
The verdict is an equivalence test instead: entrained if drift and difference of periods are shown
to be small compared with what an indifferent walker would show, drifting if the drift is shown
not to be small, undecided if the data allow neither claim.
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
from gait_entrainment.gait.strides import Stride
from gait_entrainment.settings import check_settings, setting


class Verdict(enum.IntEnum):
    """What can be claimed about the gait and the pulses."""

    UNDECIDED = 0  # too few pulses, or neither claim can be made
    ENTRAINED = 1  # drift and difference of periods shown to be small, for several strides
    DRIFTING = 2  # drift shown not to be small, never entrained before
    LOST = 3  # drift shown not to be small, entrained before
    UNTESTABLE = 4  # pulse period too close to the unperturbed period, or the latter unknown


@dataclass(frozen=True)
class VerdictSettings:
    """Every number in the verdict; raises SettingError for one that is out of range."""

    window: int = setting(20, "latest pulses judged at a time", "1", (5, 1000))
    confidence: float = setting(
        0.95, "two-sided confidence level of the drift's interval", "1", (0.5, 0.9999)
    )
    drift_margin: float = setting(
        0.25,
        "largest drift per stride of an entrained gait, as a fraction of the "
        "difference between pulse period and unperturbed period",
        "1",
        (0.01, 1.0),
    )
    period_margin: float = setting(
        0.25,
        "largest difference between mean stride period and pulse period of an "
        "entrained gait, as a fraction of the difference between pulse period and "
        "unperturbed period",
        "1",
        (0.01, 1.0),
    )
    successive: int = setting(
        5,
        "successive strides with pulses that must pass before the gait is called entrained",
        "1",
        (1, 1000),
    )
    largest_autocorrelation: float = setting(
        0.9, "upper bound of the lag-1 autocorrelation of the residuals", "1", (0.0, 0.99)
    )
    smallest_difference: float = setting(
        0.002,
        "smallest testable difference between pulse period and unperturbed period",
        "s",
        (0.0, 1.0),
    )
    smallest_difference_errors: float = setting(
        2.0, "the same in standard errors of the unperturbed period", "1", (0.0, 100.0)
    )
    stretch_tolerance: float = setting(
        0.010,
        "distance from the final lag within which a stride counts as entrained",
        "s",
        (0.0, 1.0),
    )
    stretch_tolerance_deviations: float = setting(
        2.0,
        "the same in standard deviations of the lag over the window, if that is more",
        "1",
        (0.0, 10.0),
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_settings(self)


@dataclass(frozen=True, slots=True)
class Entrainment:
    """The verdict at one stride, and the figures that it rests on."""

    verdict: Verdict
    stride: int  # stride at which the question was asked
    stamp: int  # heel strike that closes it [ns]
    since_stride: int  # stride since which this verdict has held
    unperturbed_period: float  # mean stride period before the first pulse [s]; NaN if unknown
    unperturbed_period_error: float  # its standard error [s]; NaN with fewer than two strides
    pulse_period: float  # mean period of the onsets in the window [s]; NaN with one
    mean_period: float  # mean stride period over the window [s]
    drift: float  # slope of the unwrapped lag [s per stride]; NaN with fewer than three pulses
    drift_interval: float  # half width of its confidence interval [s per stride]
    autocorrelation: float  # lag 1, of the residuals, in [0, largest_autocorrelation]
    effective_pulses: float  # pulses in the window, discounted for autocorrelation
    phase_locking_value: float  # length of the mean phase vector, 0 to 1; reported, not used
    entrained_since_stride: int | None  # since when every lag has been near the final one


class _Outliers:
    """
    Finds the last value of a growing sequence above any level, in logarithmic time.

    Keeps the values that no later one exceeds: those decrease, and the last value above a level
    is among them. An entrained lag leaves a handful; only a steady drift keeps them all.
    """

    def __init__(self) -> None:
        self._falling: list[float] = []  # negated: ascending, as bisect wants them
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
    Forms the verdict anew at each stride that brings pulses.

    A stride without a pulse says nothing new about the pulses and is not asked: so the verdict
    stands still after the last pulse, and washout does not lose it. The work per stride depends
    on the window, not on the length of the run.
    """

    def __init__(self, settings: VerdictSettings) -> None:
        self._settings = settings
        self._window: deque[tuple[PulsePhase, Stride]] = deque(maxlen=settings.window)
        self._strides: list[int] = []  # stride of each pulse with a lag
        self._above, self._below = _Outliers(), _Outliers()
        self._passed = 0  # successive evaluations that met the criteria for entrained
        self._was_entrained = False
        self._verdict: Verdict | None = None
        self._since = 0

    def add(
        self,
        stride: Stride,
        pulses: Sequence[PulsePhase],
        unperturbed_period: float,
        unperturbed_period_error: float,
    ) -> Entrainment | None:
        """Take one stride with its pulses; returns None if none of them has a lag."""
        placed = [pulse for pulse in pulses if pulse.toe_off is not None]
        if not placed:
            return None
        for position, pulse in enumerate(placed, start=len(self._strides)):
            self._strides.append(pulse.stride)
            self._above.add(pulse.unwrapped_lag, position)
            self._below.add(-pulse.unwrapped_lag, position)
            self._window.append((pulse, stride))
        window = [pulse for pulse, _ in self._window]
        lags = [pulse.unwrapped_lag for pulse in window]
        drift = drift_of(
            [pulse.stride + pulse.phase for pulse in window],
            lags,
            self._settings.confidence,
            self._settings.largest_autocorrelation,
        )
        first, last = window[0], window[-1]
        oldest = self._window[0][1]
        pulse_period = _mean_period(first.onset, last.onset, last.number - first.number)
        mean_period = _mean_period(oldest.start, stride.end, stride.number - oldest.number + 1)
        difference = abs(pulse_period - unperturbed_period)
        verdict = self._judge(
            drift, difference, unperturbed_period_error, abs(mean_period - pulse_period)
        )
        if verdict != self._verdict:
            self._verdict, self._since = verdict, stride.number
        entrained = verdict == Verdict.ENTRAINED
        return Entrainment(
            verdict=verdict,
            stride=stride.number,
            stamp=stride.end,
            since_stride=self._since,
            unperturbed_period=unperturbed_period,
            unperturbed_period_error=unperturbed_period_error,
            pulse_period=pulse_period,
            mean_period=mean_period,
            drift=drift.slope,
            drift_interval=drift.half_width,
            autocorrelation=drift.autocorrelation,
            effective_pulses=drift.effective_pulses,
            phase_locking_value=_phase_locking_value(window),
            entrained_since_stride=self._first_near(lags) if entrained else None,
        )

    def _judge(
        self, drift: Drift, difference: float, period_error: float, deviation: float
    ) -> Verdict:
        """
        Return what can be claimed now.

        ``difference`` is that of pulse period and unperturbed period [s], whose standard error is
        ``period_error``; ``deviation`` that of pulse period and mean stride period [s].
        """
        settings, size = self._settings, len(self._window)
        full = size == settings.window
        testable = (
            difference >= settings.smallest_difference
            and difference >= settings.smallest_difference_errors * period_error
        )
        margin = settings.drift_margin * difference
        passes = (
            full
            and testable
            and abs(drift.slope) + drift.half_width < margin
            and deviation < settings.period_margin * difference
        )
        self._passed = self._passed + 1 if passes else 0
        if size > 1 and not testable:
            return Verdict.UNTESTABLE
        if self._passed >= settings.successive:
            self._was_entrained = True
            return Verdict.ENTRAINED
        if full and abs(drift.slope) - drift.half_width > margin:
            return Verdict.LOST if self._was_entrained else Verdict.DRIFTING
        return Verdict.UNDECIDED

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
    # Not sum(): its last bits differ from Python 3.14 on, and a replay must give the same.
    total = 0j
    for pulse in window:
        total += cmath.exp(2j * math.pi * pulse.phase)
    return min(abs(total) / len(window), 1.0)  # rounding may exceed 1
