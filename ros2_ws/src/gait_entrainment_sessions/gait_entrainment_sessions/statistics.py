# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Statistics of pulse phases in addition to the verdict: within a run, over blocks, across persons.

Each is defined in docs/analysis.md, with its source and with what it cannot show. None of them
enters the verdict. Intervals are 95 % intervals.
"""

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from gait_entrainment.gait import Analysis, PulsePhase
from gait_entrainment_studies.cohort.locked import locked_runs

Floats = NDArray[np.float64]
CONFIDENCE = 0.95
# How many of the last pulses give the slope, and the direction and concentration: the literature's
# "last ten or so", and the shortest window of the verdict.
SLOPE_PULSES, DIRECTION_PULSES = 10, 20
# A pulse this close to where most of them are counts as locked; a share of the stride.
LOCKED_WITHIN = 0.05


class Estimate(NamedTuple):
    """A value with its 95 % interval; NaN if unknown."""

    value: float
    low: float
    high: float


UNKNOWN = Estimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Direction:
    """Where in the stride the pulses lie, and how close together."""

    count: int
    phase: float  # mean direction, in strides since heel strike, 0 to below 1
    resultant: float  # mean resultant length, 0 to 1
    kappa: float  # concentration (von Mises); infinite if all are equal, NaN for a single one


@dataclass(frozen=True)
class Locking:
    """How much of a run was locked, at whatever lag."""

    lag: float  # where most lags lie [s]
    share: float  # share of the pulses within the tolerance of it
    runs: tuple[int, ...]  # lengths of the spans of locked pulses


@dataclass(frozen=True)
class Border:
    """Where entrainment ends on one side: between two of the offsets tried."""

    entrained: float  # largest offset found entrained [% of the stride], with its sign; 0 if none
    beyond: float  # next larger offset found not entrained; infinite if none was tried
    consistent: bool  # whether no smaller offset of this side was found not entrained


def last_pulses(analysis: Analysis) -> tuple[PulsePhase, ...]:
    """Return the pulses with a lag in the last stretch: of one train, after the latest hole."""
    placed = [pulse for pulse in analysis.pulses if not math.isnan(pulse.phase_lag)]
    if analysis.entrainments:
        last = analysis.entrainments[-1].stretch
        first = next(e.stride for e in analysis.entrainments if e.stretch == last)
        placed = [pulse for pulse in placed if pulse.stride >= first]
    return tuple(placed)


def slope(strides: Sequence[float], lags: Sequence[float]) -> Estimate:
    """
    Return the least-squares slope of lags [s] over stride numbers, with Student's interval.

    NaN if there are fewer than three points or all strides are the same.
    """
    if len(lags) < 3 or len(set(strides)) < 2:
        return UNKNOWN
    fitted = stats.linregress(strides, lags)
    # If all lags are the same, linregress divides zero by zero.
    error = fitted.stderr if np.ptp(lags) else 0.0
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, len(lags) - 2)) * error
    return Estimate(float(fitted.slope), float(fitted.slope - half), float(fitted.slope + half))


def direction(phases: Sequence[float]) -> Direction:
    """Return mean direction, resultant length and concentration of phases, in strides."""
    if not len(phases):
        return Direction(0, math.nan, math.nan, math.nan)
    angles = 2 * np.pi * np.asarray(phases)
    vector = stats.directional_stats(np.column_stack([np.cos(angles), np.sin(angles)]))
    resultant = min(float(vector.mean_resultant_length), 1.0)
    phase = math.atan2(*vector.mean_direction[::-1]) / (2 * math.pi) % 1.0 % 1.0
    # If all angles are equal, the likelihood grows without bound.
    alike = math.inf if len(phases) > 1 else math.nan
    kappa = alike if 1.0 - resultant < 1e-12 else float(stats.vonmises.fit(angles, fscale=1)[0])
    return Direction(len(phases), phase, resultant, kappa)


def convergence(numbers: Sequence[float], lags: Sequence[float]) -> Estimate:
    """
    Return the time constant, in pulses, of an exponential approach of the lags to a final value.

    Least squares fit of L + A exp(-n / tau); the interval is that of log(tau), from the covariance
    of the fit. NaN if no approach is shown: A may be zero, the interval extends beyond the pulses
    (a drifting lag would fit as well), a lag is unknown, or there are fewer than eight.
    """
    if len(lags) < 8 or math.isnan(sum(lags)):
        return UNKNOWN
    n, y = np.asarray(numbers, float) - numbers[0], np.asarray(lags, float)
    scale = max(float(np.ptp(y)), 1e-12)
    last = float(np.median(y[-5:]))
    guess = [last / scale, (y[0] - last) / scale, math.log(max(n[-1] / 5, 1.0))]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a missing covariance is handled below
            fitted, covariance = optimize.curve_fit(_approach, n, y / scale, p0=guess, maxfev=2000)
    except RuntimeError:  # it does not converge
        return UNKNOWN
    half = stats.t.ppf(0.5 + CONFIDENCE / 2, len(y) - 3) * np.sqrt(np.diag(covariance))
    log = float(fitted[2])
    if not (abs(fitted[1]) > half[1] and log + half[2] < math.log(n[-1])):
        return UNKNOWN
    return Estimate(math.exp(log), math.exp(log - half[2]), math.exp(log + half[2]))


def _approach(n: Floats, last: float, height: float, log_tau: float) -> Floats:
    value: Floats = last + height * np.exp(-n / np.exp(np.clip(log_tau, -20, 20)))
    return value


def locking(pulses: Sequence[PulsePhase], stride: float) -> Locking:
    """
    Return how many pulses lie within 5 % of the stride [s] of where most of them lie.

    Runs end at a missing pulse. By chance, for pulses that run evenly through the stride, the
    share is 10 %.
    """
    lags = np.array([pulse.phase_lag for pulse in pulses])
    if not lags.size or not stride > 0:
        return Locking(math.nan, math.nan, ())
    reach = LOCKED_WITHIN * stride
    # Each lag counts those near it, which is quick even for a thousand pulses.
    near = [int((np.abs(_wrapped(lags - lag, stride)) <= reach).sum()) for lag in lags]
    lag = float(lags[int(np.argmax(near))])
    around = _wrapped(lags - lag, stride)
    middle = float(around[np.abs(around) <= reach].mean())
    everywhere = np.full(pulses[-1].number - pulses[0].number + 1, np.nan)
    everywhere[[pulse.number - pulses[0].number for pulse in pulses]] = around - middle
    _, runs = locked_runs(everywhere, 0.0, reach)
    return Locking(lag + middle, sum(runs) / lags.size, tuple(runs))


def _wrapped(lags: Floats, stride: float) -> Floats:
    wrapped: Floats = (lags + stride / 2) % stride - stride / 2
    return wrapped


def border(offsets: Iterable[tuple[float, str]], sign: int) -> Border:
    """
    Return where entrainment ends on one side, from blocks (offset [% of the stride], verdict).

    ``sign`` is +1 for pulses slower than the walker, -1 for faster ones. Only "entrained",
    "drifting" and "lost" count; any other verdict does not narrow the interval.
    """
    side = [(abs(o), v) for o, v in offsets if o * sign > 0]
    held = max((o for o, v in side if v == "entrained"), default=0.0)
    ran = [o for o, v in side if v in ("drifting", "lost")]
    beyond = min((o for o in ran if o > held), default=math.inf)
    return Border(sign * held, sign * beyond, all(o > held for o in ran))


def share(found: int, count: int) -> Estimate:
    """Return a share with Wilson's interval."""
    if not count:
        return UNKNOWN
    interval = stats.binomtest(found, count).proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(found / count, float(interval.low), float(interval.high))


def mean(values: Sequence[float]) -> Estimate:
    """Return the mean of values of a normal distribution, with Student's interval."""
    n = len(values)
    if n < 2:
        return Estimate(float(values[0]), math.nan, math.nan) if n else UNKNOWN
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1)) * float(np.std(values, ddof=1)) / n**0.5
    middle = float(np.mean(values))
    return Estimate(middle, middle - half, middle + half)


def deviation(values: Sequence[float]) -> Estimate:
    """Return the standard deviation of such values, with the chi-square interval."""
    n = len(values)
    if n < 2:
        return UNKNOWN
    found = float(np.std(values, ddof=1))
    tails = stats.chi2.ppf([0.5 + CONFIDENCE / 2, 0.5 - CONFIDENCE / 2], n - 1)
    return Estimate(found, *(found * math.sqrt((n - 1) / float(tail)) for tail in tails))


def rayleigh(phases: Sequence[float]) -> float:
    """
    Return the p-value of Rayleigh's test that phases, one per person, have no common direction.

    Not meant for the pulses of one run: they are periodic, so any few of them show a direction.
    """
    n = len(phases)
    if n < 2:
        return math.nan
    # Zar, Biostatistical Analysis, 5th ed., eq. 27.4. The series that other libraries use falls
    # below zero for a few phases close together, such as those of persons who entrain.
    spread = n**2 * (1 - direction(phases).resultant ** 2)
    return math.exp(math.sqrt(1 + 4 * n + 4 * spread) - (1 + 2 * n))
