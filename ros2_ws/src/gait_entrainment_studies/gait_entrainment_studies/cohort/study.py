# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The human study's experiment on each simulated subject.

Fed in: the distributions of the subjects, their variability, and 10 N m for 0.1 s. Predicted: who
entrains, where in the gait cycle, and how the basin depends on the subject. The spread of the
basin is mostly fed in, for the basin follows from torque over body size and peak torque.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.gait import GaitEvent, Verdict, analyze
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.cohort.subjects import Subjects
from gait_entrainment_studies.locking.branches import locked_gaits, pieces_of, stable_intervals
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats
from gait_entrainment_studies.variability.population import (
    Population,
    PopulationWalk,
    PopulationWalker,
    PulseTrains,
    locked_runs,
    noise_for,
)

# Streams of noise beside that which draws the subjects. A trial's goes by its pulse period: it is
# the same trial, whatever other periods are asked for.
_PILOT, _TRIAL = 1, 2

# A pulse within this fraction of the stride of the noise-free lock counts as locked.
_LOCKED_WITHIN = 0.05


@dataclass(frozen=True)
class StudyPlan:
    """The experiment, the same for every subject."""

    torque: float = 10.0
    width: float = 0.1
    period_offsets: tuple[float, ...] = (-0.05,)
    """Pulse periods off each subject's measured stride period [s]."""
    baseline: int = 15
    pulses: int = 50
    washout: int = 15
    initial_phase: float = 0.0
    seed: int = 0
    hurst: float = 0.75
    slope: float = 0.0
    asymmetry: float = 0.0

    @property
    def solvable(self) -> bool:
        """Whether locks are solved for: on level ground, with equal legs."""
        return self.slope == 0 and self.asymmetry == 0


@dataclass(frozen=True)
class Trial:
    """One subject at one pulse period."""

    subject: int
    period_offset: float
    measured_period: float
    verdict: str
    """That of definitions.md, or that the walker fell or flew off."""
    fraction_locked: float
    """Of the strides under pulses; NaN where the walker has no lock at that period."""
    mean_run: float
    """Mean length [strides] of the runs of locked strides."""
    median_lag: float


@dataclass(frozen=True)
class Study:
    """All trials, and each subject's basin without noise."""

    trials: tuple[Trial, ...]
    basins: Floats
    """
    (n, 2) shortest and longest pulse period with a stable lock, solved without noise, off the
    unperturbed stride period in percent of it; (0, 2) where the plan is not solvable.
    """

    @property
    def basin_widths(self) -> Floats:
        """Each subject's basin without noise, both sides together, in percent of its stride."""
        widths: Floats = self.basins[:, 1] - self.basins[:, 0]
        return widths


def run_study(subjects: Subjects, plan: StudyPlan) -> Study:
    """
    Run the experiment on each subject at each pulse period, with noise of its own.

    Raises ValueError where the plan cannot be conducted.
    """
    if not np.isfinite(plan.torque):
        raise ValueError(f"torque {plan.torque} N m is not a finite number")
    count = len(subjects.walkers)
    population = Population(subjects.walkers, plan.slope)
    noise = noise_for(population, subjects.variation, (plan.seed, _PILOT), plan.hurst)
    gaits = [PulsedGait(walker, plan.torque, plan.width) for walker in subjects.walkers]
    pieces = [pieces_of(gait) for gait in gaits]
    if not 0 <= plan.initial_phase < 1:
        raise ValueError(
            f"initial_phase {plan.initial_phase:g} is out of range; allowed: 0 to below 1"
        )
    # Half the stride is room enough for any stride that noise makes; less the pulse, so that no
    # two of them reach into one double stance.
    shortest = min(gait.unperturbed_period for gait in gaits) / 2 - plan.width
    for offset in plan.period_offsets:
        if not abs(offset) < shortest:
            raise ValueError(
                f"period_offset {offset:g} s is out of range; allowed: within {shortest:.3g} s"
            )
    trials: list[Trial] = []
    for offset in plan.period_offsets:
        walker = PopulationWalker(
            population,
            2 * (plan.baseline + plan.pulses + plan.washout) + 2,
            (plan.seed, _TRIAL, nanoseconds(offset) % 2**64),
            noise,
            plan.hurst,
            plan.asymmetry,
        )
        walk, trains = _conduct(walker, plan, offset, count)
        for subject in range(count):
            lock = float("nan")
            if plan.solvable:
                period = gaits[subject].unperturbed_period + offset
                locks = locked_gaits(gaits[subject], period, pieces[subject])
                lock = next((one.lag for one in reversed(locks) if one.stable), lock)
            trials.append(_trial(walk, trains, subject, offset, lock))
    basins = []
    for gait, branches in zip(gaits, pieces, strict=True) if plan.solvable else ():
        stable = stable_intervals(branches)
        ends = [(p.least_period.period, p.greatest_period.period) for p in stable]
        base = gait.unperturbed_period
        low = min((end[0] for end in ends), default=base) / base - 1
        high = max((end[1] for end in ends), default=base) / base - 1
        basins.append((100 * low, 100 * high))
    return Study(tuple(trials), np.reshape(basins, (-1, 2)))


def _conduct(
    walker: PopulationWalker, plan: StudyPlan, offset: float, count: int
) -> tuple[PopulationWalk, PulseTrains]:
    """Walk the baseline, plan the pulses from it as `definitions.md` says, walk the rest."""
    baseline = walker.walk(2 * (plan.baseline - 1))
    measured = baseline.stride_periods.mean(axis=0)
    trains = PulseTrains(
        first_onset=baseline.heel_strikes[-1] + (1 + plan.initial_phase) * measured,
        period=measured + offset,
        count=plan.pulses,
        torque=np.full(count, plan.torque),
        width=plan.width,
    )
    steps = 2 * (plan.baseline + plan.pulses + plan.washout)
    return walker.walk(steps, trains), trains


def _trial(
    walk: PopulationWalk, trains: PulseTrains, subject: int, offset: float, lock: float
) -> Trial:
    period = float(trains.period[subject])
    measured = period - offset
    if walk.fell[subject] or walk.flew_off[subject]:
        verdict = "fell" if walk.fell[subject] else "flew off"
        nan = float("nan")
        return Trial(subject, offset, measured, verdict, nan, nan, nan)
    strikes = walk.heel_strikes[:, subject]
    onsets = trains.first_onset[subject] + np.arange(trains.count) * period
    events = _events(strikes, walk.toe_offs[:, subject])
    analysis = analyze(events, [nanoseconds(float(t)) for t in onsets], Side.RIGHT)
    last = analysis.entrainments[-1].verdict if analysis.entrainments else Verdict.UNDECIDED
    lags = np.array([pulse.phase_lag for pulse in analysis.pulses])
    fraction, runs = float("nan"), list[int]()
    if np.isfinite(lock):
        fraction, runs = locked_runs(lags, lock, _LOCKED_WITHIN * measured)
    mean_run = float(np.mean(runs)) if runs else float("nan")
    return Trial(
        subject,
        offset,
        measured,
        last.name.lower(),
        fraction,
        mean_run,
        float(np.median(lags[-20:])) if lags.size else float("nan"),
    )


def _events(strikes: Floats, toe_offs: Floats) -> list[GaitEvent]:
    """Events of a walk whose heel strike 0 is the right, perturbed leg's."""
    sides = (Side.RIGHT, Side.LEFT)
    events = [GaitEvent(0, EventKind.HEEL_STRIKE, Side.RIGHT, 0)]
    for step in range(toe_offs.size):
        side = sides[(step + 1) % 2]
        off, strike = nanoseconds(float(toe_offs[step])), nanoseconds(float(strikes[step + 1]))
        events.append(GaitEvent(off, EventKind.TOE_OFF, side, step + 1))
        events.append(GaitEvent(strike, EventKind.HEEL_STRIKE, side, step + 1))
    return events


def verdicts(study: Study, offset: float) -> dict[str, int]:
    """Count the verdicts at one pulse period; they add up to the number of subjects."""
    return dict(Counter(t.verdict for t in study.trials if t.period_offset == offset))


def measured_basin_percent(study: Study) -> Floats:
    """Each subject's longest way off its own period at which it was found entrained [%]."""
    widest: dict[int, float] = {}
    for trial in study.trials:
        reached = abs(trial.period_offset) / trial.measured_period
        entrained = trial.verdict == "entrained"
        widest[trial.subject] = max(widest.get(trial.subject, 0.0), reached if entrained else 0.0)
    percent: Floats = 100 * np.array([widest[subject] for subject in sorted(widest)])
    return percent


def table_1_subjects(count: int, variation: float) -> Subjects:
    """Return subjects that are all the walker of Table 1: what noise alone does."""
    return Subjects((WalkerParameters(),) * count, np.full(count, variation), 0)
