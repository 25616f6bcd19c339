# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Chance of a correct verdict after a number of pulses, found by judging simulated walks.

A walk has long-range correlated stride periods (fractional Gaussian noise), and either ignores the
pulses or corrects a share of the distance to its locked phase in each stride, up to a limit. The
model's walker is not used: how a person responds, between these two, is not known beforehand.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.gait import GaitEvent, Verdict, analyze
from gait_entrainment.settings import Checked, setting
from gait_entrainment_sessions.statistics import Estimate, Floats, share
from gait_entrainment_studies.cohort.population import step_noise
from gait_entrainment_studies.cohort.study import events_of

# Toe-off as a share of the stride, and its scatter [s]; both from docs/analysis.md.
_TOE_OFF, _SCATTER = 0.68, 0.005
COUNTS = (10, 20, 25, 30, 40, 50, 60, 80)


@dataclass(frozen=True)
class PowerPlan(Checked):
    """What is known or assumed before a session."""

    variation: float = setting(
        0.02, "coefficient of variation of the stride period", "1", (0.0, 0.2)
    )
    hurst: float = setting(
        0.75, "its correlation: from 0.5 (white) to below 1", "1", (0.5, 1.0), most_excluded=True
    )
    stride: float = setting(1.1, "stride period", "s", (0.3, 5.0))
    baseline: int = setting(15, "strides before the pulses", "1", (2, 1000))
    gain: float = setting(
        0.5, "share of the distance to its lock that a walk corrects per stride", "1", (0.01, 1.0)
    )
    limit: float = setting(0.08, "largest correction as a share of a stride", "1", (0.001, 1.0))
    trials: int = setting(100, "walks of each kind", "1", (20, 100_000))
    seed: int = setting(0, "seed", "1", (0, 2**63 - 1))


@dataclass(frozen=True)
class Power:
    """Chances of the verdicts after a number of pulses."""

    pulses: int
    entrained: Estimate  # a walker that locks is judged entrained
    drifting: Estimate  # a walker that ignores the pulses is judged drifting
    wrongly: Estimate  # a walker that ignores the pulses is judged entrained


def power(plan: PowerPlan, offset: float, counts: Sequence[int] = COUNTS) -> list[Power]:
    """
    Return the chances of the verdict after each number of pulses, ascending.

    ``offset`` is the pulse period minus the stride period [s]. Raises UsageError if no walk of the
    plan could lock at it.
    """
    if not abs(offset) < plan.limit * plan.stride:
        raise UsageError(
            f"period_offset: {offset:g} s; allowed: within {plan.limit * plan.stride:g} s, the "
            "largest correction in a stride: beyond it no walker locks"
        )
    longest = max(counts)
    found: dict[bool, list[dict[int, Verdict]]] = {True: [], False: []}
    noise = step_noise(plan.seed, plan.baseline + longest + 2, 2 * plan.trials, plan.hurst).T
    generators = np.random.default_rng(plan.seed).spawn(2 * plan.trials)
    for number, (row, generator) in enumerate(zip(noise, generators, strict=True)):
        free = plan.stride * (1 + plan.variation * row)
        locks = number % 2 == 0
        events, onsets = walk(plan, free, offset, longest, locks=locks, generator=generator)
        found[locks].append(_verdicts(events, onsets))

    def chance(locks: bool, pulses: int, verdict: Verdict) -> Estimate:
        at = [verdicts.get(pulses, Verdict.UNDECIDED) for verdicts in found[locks]]
        return share(at.count(verdict), len(at))

    return [
        Power(
            n,
            chance(True, n, Verdict.ENTRAINED),
            chance(False, n, Verdict.DRIFTING),
            chance(False, n, Verdict.ENTRAINED),
        )
        for n in sorted(set(counts))
    ]


def enough_of(found: Sequence[Power], chance: float) -> int | None:
    """Return the number of pulses from which on both chances are high enough; None if never."""
    right = [min(row.entrained.value, row.drifting.value) >= chance for row in found]
    first = max((n for n, enough in enumerate(right, start=1) if not enough), default=0)
    return found[first].pulses if first < len(found) else None


def _verdicts(events: Sequence[GaitEvent], onsets: Sequence[int]) -> dict[int, Verdict]:
    """Return the verdict after each pulse, by its number."""
    analysis = analyze(events, onsets, Side.RIGHT)
    at = {judged.stride: judged.verdict for judged in analysis.entrainments}
    return {p.number: at[p.stride] for p in analysis.pulses if p.stride in at}


def walk(
    plan: PowerPlan,
    free: Floats,
    offset: float,
    pulses: int,
    *,
    locks: bool,
    generator: np.random.Generator,
) -> tuple[list[GaitEvent], list[int]]:
    """
    Return the events and the pulse onsets [ns] of one experiment on the right leg.

    ``free`` are the stride periods [s] without pulses; the pulse period is their mean in the
    baseline plus ``offset`` [s]. The first pulse has a random phase.
    """
    measured = float(np.mean(free[: plan.baseline]))
    period = measured + offset
    first = float(np.sum(free[: plan.baseline])) + generator.uniform() * measured
    locked = generator.uniform(-0.1, 0.0) * plan.stride  # lag at which it locks
    scatter = _SCATTER * generator.standard_normal(len(free))
    strikes, toe_offs = [0.0], []
    for k, alone in enumerate(free):
        stride, start = float(alone), strikes[-1]
        if locks and k >= plan.baseline:
            expected = start + _TOE_OFF * plan.stride
            nearest = round((expected - first) / period)
            lag = first + nearest * period - expected
            wanted = plan.gain * (lag - locked) + offset
            if 0 <= nearest < pulses:
                stride += min(max(wanted, -plan.limit * plan.stride), plan.limit * plan.stride)
        strikes.append(start + stride)
        toe_offs.append(start + _TOE_OFF * stride + float(scatter[k]))
    onsets = [nanoseconds(first) + nanoseconds(n * period) for n in range(pulses)]
    # The left leg strikes halfway through a stride, and lifts off a quarter of the way through.
    steps = np.interp(np.arange(2 * len(free) + 1) / 2, np.arange(len(strikes)), strikes)
    offs = np.stack([(steps[:-1:2] + steps[1::2]) / 2, toe_offs], axis=1)
    return events_of(steps, offs.ravel()), onsets
