# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Synthetic gait events and pulses: exact ones for examples, noisy ones for Monte Carlo."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.gait import GaitEvent

Floats = npt.NDArray[np.float64]
OFFSET = -0.05  # pulse period minus unperturbed period [s], the paper's example
STANCE = 0.68  # toe-off of a leg, as a fraction of its stride; near the model's


def events_of(
    strikes: Sequence[int], toe_offs: Sequence[int], side: Side = Side.RIGHT, first_step: int = 0
) -> list[GaitEvent]:
    """
    Return the gait events of strides of one leg, in order.

    ``strikes`` (n + 1) [ns] of that leg bound n strides with ``toe_offs`` (n) [ns]; the other leg
    strikes in the middle and leaves the ground midway between.
    """
    events = [GaitEvent(strikes[0], EventKind.HEEL_STRIKE, side, first_step)]
    for i, (start, end, toe_off) in enumerate(
        zip(strikes[:-1], strikes[1:], toe_offs, strict=True)
    ):
        step, middle = first_step + 2 * i + 1, (start + end) // 2
        assert middle < toe_off < end
        events += [
            GaitEvent((start + middle) // 2, EventKind.TOE_OFF, side.other, step),
            GaitEvent(middle, EventKind.HEEL_STRIKE, side.other, step),
            GaitEvent(toe_off, EventKind.TOE_OFF, side, step + 1),
            GaitEvent(end, EventKind.HEEL_STRIKE, side, step + 1),
        ]
    return events


def regular_walk(periods: Sequence[int], start: int = 0) -> list[GaitEvent]:
    """Return the events of strides with these periods [ns], toe-off at STANCE."""
    strikes = [start]
    for period in periods:
        strikes.append(strikes[-1] + period)
    return events_of(
        strikes, [s + round(STANCE * p) for s, p in zip(strikes, periods, strict=False)]
    )


def white(rng: np.random.Generator, n: int) -> Floats:
    """Return n independent values of unit variance."""
    return rng.standard_normal(n)


def autoregressive(rng: np.random.Generator, n: int) -> Floats:
    """Return n values of an AR(1) process with lag-1 correlation 0.5 and unit variance."""
    values = rng.standard_normal(n)
    for i in range(1, n):
        values[i] = 0.5 * values[i - 1] + np.sqrt(0.75) * values[i]
    return values


def long_range(rng: np.random.Generator, n: int) -> Floats:
    """
    Return n values of fractional Gaussian noise with Hurst exponent 0.85 and unit variance.

    Stride periods of healthy adults fluctuate with exponents of this size (Hausdorff et al.
    1995). Exact, by circulant embedding (Davies and Harte 1987).
    """
    k = np.arange(n + 1, dtype=float)
    h = 2 * 0.85
    covariance = 0.5 * ((k + 1) ** h - 2 * k**h + np.abs(k - 1) ** h)
    spectrum = np.fft.fft(np.concatenate([covariance, covariance[-2:0:-1]])).real
    size = len(spectrum)
    normal = rng.standard_normal(size) + 1j * rng.standard_normal(size)
    return np.fft.fft(np.sqrt(spectrum / size) * normal).real[:n]


def recorded_strides(strides: int = 80) -> list[Floats]:
    """
    Return stretches of people's stride periods [s] from PhysioNet's gait-maturation-db.

    None has a stop or a missed step: every stride is within a quarter of its stretch's median. The
    database is searched for in shared/data next to the repository; without it, none are returned.
    """
    folders = (parent / "shared" / "data" / "gait_maturation" for parent in Path(__file__).parents)
    folder = next((folder for folder in folders if folder.is_dir()), None)
    stretches: list[Floats] = []
    for path in sorted(folder.glob("[0-9]*.txt")) if folder else ():
        periods = np.loadtxt(path)[:, 1]
        for begin in range(0, len(periods) - strides + 1, strides):
            stretch = periods[begin : begin + strides]
            if np.all(np.abs(stretch / np.median(stretch) - 1) < 0.25):
                stretches.append(stretch)
    return stretches


Noise = Callable[[np.random.Generator, int], Floats]
Response = Callable[[float], float]  # lag of a pulse [s] -> change of the stride period [s]


class Walk(NamedTuple):
    """One experiment, and what only its simulation knows."""

    events: list[GaitEvent]
    onsets: list[int]  # [ns]
    answered: list[int]  # pulse that each stride under pulses answered, from 0

    def slipped(self, last: int) -> bool:
        """Whether pulses and strides were not one to one over the ``last`` strides with pulses."""
        return any(b - a != 1 for a, b in pairwise(self.answered[-last:]))


def noisy_walk(
    rng: np.random.Generator,
    response: Response,
    noise: Noise,
    variation: float,
    offset: float = OFFSET,
    unperturbed: float = 1.934,
    counts: tuple[int, int, int] = (15, 50, 15),
) -> Walk:
    """
    Return one experiment, as ``perturbed`` does.

    Stride periods are ``unperturbed`` [s] plus noise with a coefficient of variation
    ``variation``; ``counts`` are the strides of baseline, pulses and washout.
    """
    free = unperturbed * (1 + variation * noise(rng, sum(counts)))
    return perturbed(rng, response, free, offset, unperturbed, counts[:2])


def perturbed(
    rng: np.random.Generator,
    response: Response,
    free: Floats,
    offset: float = OFFSET,
    unperturbed: float | None = None,
    counts: tuple[int, int] = (15, 50),
) -> Walk:
    """
    Return one experiment.

    Stride periods are ``free`` [s], plus the walker's response once there are pulses. The pulses
    are planned as the experiment plans them: period ``offset`` [s] away from the measured mean of
    the baseline, initial phase at random. Toe-offs scatter by 5 ms around STANCE.

    Parameters
    ----------
    rng
        Source of all randomness.
    response, free, offset
        As above.
    unperturbed
        Mean stride period [s], from which toe-off is expected; that of ``free`` if None.
    counts
        Strides of baseline and pulses.

    """
    baseline, pulses = counts
    if unperturbed is None:
        unperturbed = float(np.mean(free))
    jitter = 0.005 * rng.standard_normal(len(free))
    measured = float(np.mean(free[:baseline]))
    first = float(np.sum(free[: baseline - 1])) + (1 + rng.uniform()) * measured
    onsets = [nanoseconds(first) + nanoseconds(n * (measured + offset)) for n in range(pulses)]
    strikes, toe_offs, answered = [0.0], [], []
    for k in range(len(free)):
        start, period = strikes[-1], float(free[k])
        if baseline <= k < baseline + pulses:
            # The pulse that belongs to this stride is the one nearest to its expected toe-off.
            expected = start + STANCE * unperturbed
            n = round((expected - first) / (measured + offset))
            lag = first + n * (measured + offset) - expected
            period += response(lag)
            answered.append(n)
        strikes.append(start + period)
        toe_offs.append(start + STANCE * period + float(jitter[k]))
    events = events_of([nanoseconds(t) for t in strikes], [nanoseconds(t) for t in toe_offs])
    return Walk(events, onsets, answered)


def ignores(_lag: float) -> float:
    """Walker that does not respond at all: it drifts by the whole offset."""
    return 0.0


def locks(lag: float) -> float:
    """Walker that makes up half of its lag in each stride, without a limit: it locks."""
    return 0.5 * (lag + 0.1)


def locks_within_80_ms(lag: float) -> float:
    """Walker that does the same by at most 80 ms: it locks, but recovers from a slip slowly."""
    return float(np.clip(locks(lag), -0.08, 0.08))


def follows_partly(_lag: float) -> float:
    """Walker that adopts half of the offset whatever the lag: it drifts slowly."""
    return 0.5 * OFFSET


def slips(lag: float) -> float:
    """Walker whose response, at most 40 ms, falls short of a 50 ms offset: it slips in phase."""
    return float(0.04 * np.sin(2 * np.pi * lag / 1.934))
