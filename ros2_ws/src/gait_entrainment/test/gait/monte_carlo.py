# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Monte Carlo of the entrainment verdict on noisy walkers that are known to lock, or not to.

Prints the table of docs/analysis.md: python monte_carlo.py [TRIALS]
"""

import statistics
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv
from synthetic_gait import (
    Noise,
    Response,
    autoregressive,
    follows_partly,
    ignores,
    locks,
    locks_within_80_ms,
    long_range,
    noisy_walk,
    perturbed,
    recorded_strides,
    slips,
    white,
)

from gait_entrainment.conventions import Side
from gait_entrainment.gait import GaitEvent, Verdict, analyze, drift_of

STEADY = 0.025  # coefficient of variation below which a recorded stretch is called steady


@dataclass(frozen=True)
class Case:
    """A walker, and the noise of its stride periods."""

    response: Response
    noise: Noise
    variation: float  # coefficient of variation of the stride periods

    def __str__(self) -> str:
        walker = self.response.__name__.replace("_", " ")
        noise = self.noise.__name__.replace("_", " ")
        return f"| {walker} | {noise} | {100 * self.variation:g} % |"


@dataclass(frozen=True)
class Outcome:
    """Verdicts of many independent trials of one case."""

    trials: int
    ever_entrained: int  # trials in which any stride was called entrained
    final: Counter[Verdict]  # verdicts at the last pulse
    since: list[int]  # entrained_since_stride, where entrained at the last pulse

    def __str__(self) -> str:
        cells = [rate(self.ever_entrained, self.trials)]
        cells.append(rate(self.final[Verdict.ENTRAINED], self.trials))
        others = [v for v in Verdict if v != Verdict.ENTRAINED]
        cells += [f"{100 * self.final[v] / self.trials:.1f}" for v in others]
        cells.append(f"{statistics.median(self.since):g}" if self.since else "-")
        return " " + " | ".join(cells) + " |"


def interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a binomial rate (Clopper and Pearson 1934)."""
    low = betaincinv(successes, trials - successes + 1, 0.025) if successes else 0.0
    high = betaincinv(successes + 1, trials - successes, 0.975) if successes < trials else 1.0
    return float(low), float(high)


def rate(successes: int, trials: int) -> str:
    """Return a rate with its 95 % interval, in per cent."""
    low, high = interval(successes, trials)
    return f"{100 * successes / trials:.1f} ({100 * low:.1f} to {100 * high:.1f})"


def run(case: Case, trials: int, seed: int = 2012) -> Outcome:
    """Run independent trials of one case; the same seed gives the same trials."""
    return outcome_of(
        noisy_walk(rng, case.response, case.noise, case.variation)
        for rng in np.random.default_rng(seed).spawn(trials)
    )


def run_recorded(response: Response, *, steady: bool, seed: int = 2012) -> Outcome:
    """Let a walker respond on every recorded stretch that is steady, or is not."""
    strides = [s for s in recorded_strides() if (np.std(s) < STEADY * np.mean(s)) == steady]
    rngs = np.random.default_rng(seed).spawn(len(strides))
    return outcome_of(
        perturbed(rng, response, free) for rng, free in zip(rngs, strides, strict=True)
    )


def outcome_of(walks: Iterable[tuple[list[GaitEvent], list[int]]]) -> Outcome:
    """Judge walks."""
    trials, ever, final, since = 0, 0, Counter[Verdict](), []
    for events, onsets in walks:
        entrainments = analyze(events, onsets, Side.RIGHT).entrainments
        trials += 1
        ever += any(e.verdict == Verdict.ENTRAINED for e in entrainments)
        last = entrainments[-1]
        final[last.verdict] += 1
        if last.entrained_since_stride is not None:
            since.append(last.entrained_since_stride)
    return Outcome(trials, ever, final, since)


def coverage(rng: np.random.Generator, trials: int) -> float:
    """Return how often the interval over 20 strides holds an indifferent walker's drift."""
    covered, numbers = 0, list(range(20))
    for _ in range(trials):
        lags = np.cumsum(0.02 + 0.04 * rng.standard_normal(20)).tolist()
        drift = drift_of(numbers, numbers, lags)
        covered += abs(drift.slope - 0.02) <= drift.half_width
    return covered / trials


NOISES: tuple[Noise, ...] = (white, autoregressive, long_range)


def cases() -> Iterator[Case]:
    """Yield the rows of the table."""
    for response in (ignores, follows_partly, slips, locks, locks_within_80_ms):
        for variation in (0.03, 0.02, 0.01):
            for noise in NOISES:
                yield Case(response, noise, variation)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print(
        "| walker | noise | CV | ever entrained, % (95 % interval) | at the last pulse: "
        "entrained, % | undecided, % | drifting, % | lost, % | untestable, % | entrained since "
        "stride, median |"
    )
    print("| --- " * 10 + "|")
    for each in cases():
        print(each, run(each, count), sep="", flush=True)
    for walker in (ignores, locks) if recorded_strides() else ():
        for limit, calm in (("below", True), ("above", False)):
            name = f"| {walker.__name__} | recorded | {limit} {100 * STEADY:g} % |"
            print(name, run_recorded(walker, steady=calm), sep="", flush=True)
    print(f"coverage of the drift's interval: {coverage(np.random.default_rng(1), 4 * count):.3f}")
