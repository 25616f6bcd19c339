# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Monte Carlo of the entrainment verdict on noisy walkers that are known to lock or not to lock.

Prints the tables of docs/analysis.md: python monte_carlo.py [TRIALS]
"""

import statistics
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betaincinv
from synthetic_gait import (
    Noise,
    Response,
    Walk,
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
from gait_entrainment.gait import Verdict, analyze, drift_of

NOISES: tuple[Noise, ...] = (white, autoregressive, long_range)
JUDGED = 40  # pulses, the most that the verdict judges at a time
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


@dataclass
class Outcome:
    """Verdicts of many independent trials of one case."""

    trials: int = 0
    ever_entrained: int = 0  # trials in which any stride was called entrained
    final: Counter[Verdict] = field(default_factory=Counter)  # verdicts at the last pulse
    slipped: Counter[Verdict] = field(default_factory=Counter)  # of walkers that really slipped
    since: list[int] = field(default_factory=list)  # entrained_since_stride, if at the last pulse

    def __str__(self) -> str:
        cells = [rate(self.ever_entrained, self.trials)]
        cells.append(rate(self.final[Verdict.ENTRAINED], self.trials))
        others = [v for v in Verdict if v != Verdict.ENTRAINED]
        cells += [f"{100 * self.final[v] / self.trials:.1f}" for v in others]
        cells.append(f"{statistics.median(self.since):g}" if self.since else "-")
        return " " + " | ".join(cells) + " |"

    @property
    def followed(self) -> Counter[Verdict]:
        """Verdicts at the last pulse of the walkers that really answered one pulse per stride."""
        return self.final - self.slipped

    def in_truth(self) -> str:
        """Return how many slipped, and how many of the rest and of these are called entrained."""
        cells = [rate(self.slipped.total(), self.trials)]
        for verdicts in (self.followed, self.slipped):
            total, entrained = verdicts.total(), verdicts[Verdict.ENTRAINED]
            cells.append(f"{rate(entrained, total)} of {total}" if total else "-")
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


def run_recorded(
    response: Response, least: float = 0.0, below: float = 1.0, seed: int = 2012
) -> Outcome:
    """Let a walker respond on each recorded stretch with a CV from ``least`` to ``below``."""
    strides = recorded_strides()
    rngs = np.random.default_rng(seed).spawn(len(strides))
    return outcome_of(
        perturbed(rng, response, free)
        for rng, free in zip(rngs, strides, strict=True)
        if least <= np.std(free) / np.mean(free) < below
    )


def outcome_of(walks: Iterable[Walk]) -> Outcome:
    """Judge walks."""
    outcome = Outcome()
    for walk in walks:
        entrainments = analyze(walk.events, walk.onsets, Side.RIGHT).entrainments
        last = entrainments[-1]
        outcome.trials += 1
        outcome.ever_entrained += any(e.verdict == Verdict.ENTRAINED for e in entrainments)
        outcome.final[last.verdict] += 1
        outcome.slipped[last.verdict] += walk.slipped(JUDGED)
        if last.entrained_since_stride is not None:
            outcome.since.append(last.entrained_since_stride)
    return outcome


def coverage(rng: np.random.Generator, trials: int) -> float:
    """Return how often the interval over 20 strides contains an indifferent walker's drift."""
    covered, numbers = 0, list(range(20))
    for _ in range(trials):
        lags = np.cumsum(0.02 + 0.04 * rng.standard_normal(20)).tolist()
        drift = drift_of(numbers, numbers, lags)
        covered += abs(drift.slope - 0.02) <= drift.half_width
    return covered / trials


def outcomes(trials: int) -> Iterator[tuple[str, Outcome]]:
    """Yield the rows of the tables: the walker with its noise, and the outcome."""
    for response in (ignores, follows_partly, slips, locks, locks_within_80_ms):
        for variation in (0.03, 0.02, 0.01):
            for noise in NOISES:
                case = Case(response, noise, variation)
                yield str(case), run(case, trials)
    for response in (ignores, locks, locks_within_80_ms) if recorded_strides() else ():
        name = f"| {response.__name__.replace('_', ' ')} | recorded | "
        yield f"{name}below {100 * STEADY:g} % |", run_recorded(response, below=STEADY)
        yield f"{name}above {100 * STEADY:g} % |", run_recorded(response, least=STEADY)
        yield f"{name}any |", run_recorded(response)


def table(columns: str) -> str:
    """Return the head of a table with these columns."""
    return f"| walker | noise | CV | {columns} |\n{'| --- ' * (4 + columns.count('|'))}|"


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print(
        table(
            "ever entrained, % (95 % interval) | at the last pulse: entrained, % | undecided, % | "
            "drifting, % | lost, % | untestable, % | entrained since stride, median"
        )
    )
    locking = []
    for row, outcome in outcomes(count):
        print(row, outcome, sep="", flush=True)
        if row.startswith("| locks"):
            locking.append(row + outcome.in_truth())
    print(table("slipped, % | entrained, % of those that did not slip | % of those that did"))
    print(*locking, sep="\n")
    print(f"coverage of the drift's interval: {coverage(np.random.default_rng(1), 4 * count):.3f}")
