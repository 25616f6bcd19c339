# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The human study's experiment on each simulated subject.

Inputs: the distributions of the subjects, their variability, and 10 N m for 0.1 s. Predicted: who
entrains, where in the gait cycle, and how the basin depends on the subject. The spread of the
basin comes mostly from the inputs, because it follows from torque over body size and peak torque.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.gait import GaitEvent, Verdict, analyze
from gait_entrainment.settings import Checked, setting
from gait_entrainment.walker.variation import step_noise
from gait_entrainment_studies.cohort.locked import locked_runs
from gait_entrainment_studies.cohort.population import (
    Population,
    PopulationWalk,
    PulseTrains,
    noise_for,
)
from gait_entrainment_studies.cohort.subjects import Subjects
from gait_entrainment_studies.locking.branches import basin_of, locked_gaits, pieces_of
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats
from gait_entrainment_studies.locking.walked import ENDINGS

# Streams of noise in addition to the one that draws the subjects. A trial's stream depends on its
# pulse period alone, so the trial is the same whatever other periods are requested.
_PILOT, _TRIAL = 1, 2

# A pulse within this fraction of the stride of the noise-free lock counts as locked.
_LOCKED_WITHIN = 0.05


@dataclass(frozen=True)
class StudyPlan(Checked):
    """The experiment, the same for every subject."""

    torque: float = setting(10.0, "height of the pulses", "N m")
    width: float = setting(0.1, "duration of a pulse", "s")
    period_offsets: tuple[float, ...] = (-0.05,)
    """Pulse periods minus each subject's measured stride period [s]."""
    baseline: int = 15
    pulses: int = setting(50, "pulses in a trial", within=(1, math.inf))
    washout: int = 15
    initial_phase: float = setting(
        0.0, "first pulse, as a fraction of a stride", within=(0, 1), most_excluded=True
    )
    seed: int = setting(0, "seed of subjects and noise", within=(0, math.inf))
    hurst: float = setting(0.75, "correlation of the noise: from 0.5 (white) to below 1")
    slope: float = setting(0.0, "rise of the ground, uphill positive", "rad")
    asymmetry: float = setting(0.0, "excess stiffness of the perturbed leg, from -1 to 1")

    @property
    def solvable(self) -> bool:
        """Whether locks are solved for: only on level ground and with equal legs."""
        return self.slope == 0 and self.asymmetry == 0


@dataclass(frozen=True)
class Trial:
    """One subject at one pulse period."""

    subject: int
    period_offset: float
    measured_period: float
    verdict: str
    """A verdict of docs/analysis.md, or that the walker fell or flew off."""
    fraction_locked: float = math.nan
    """Of the strides under pulses; NaN if the walker has no lock at that period."""
    mean_run: float = math.nan
    """Mean length [strides] of the runs of locked strides."""
    median_lag: float = math.nan


@dataclass(frozen=True)
class Study:
    """All trials, and each subject's basin without noise."""

    trials: tuple[Trial, ...]
    basins: Floats
    """
    (n, 2) shortest and longest pulse period with a stable lock, solved without noise, minus the
    unperturbed stride period, in percent of it; (0, 2) if the plan is not solvable.
    """

    @property
    def basin_widths(self) -> Floats:
        """Each subject's basin without noise, both sides together, in percent of its stride."""
        widths: Floats = self.basins[:, 1] - self.basins[:, 0]
        return widths


def run_study(subjects: Subjects, plan: StudyPlan) -> Study:
    """
    Run the experiment on each subject at each pulse period, each time with different noise.

    Raises UsageError if the plan cannot be conducted.
    """
    population = Population(subjects.walkers, plan.slope, plan.asymmetry)
    alike = Population(subjects.walkers, plan.slope)
    noise = noise_for(alike, subjects.variation, (plan.seed, _PILOT), plan.hurst)
    gaits = [PulsedGait(walker, plan.torque, plan.width) for walker in subjects.walkers]
    pieces = [pieces_of(gait) for gait in gaits]
    # Half the stride leaves room for any stride that noise makes; the pulse is subtracted so that
    # no two pulses reach into one double stance.
    shortest = min(gait.unperturbed_period for gait in gaits) / 2 - plan.width
    trials: list[Trial] = []
    for offset in plan.period_offsets:
        if not abs(offset) < shortest:
            raise UsageError(f"period_offset: {offset:g} s; allowed: within {shortest:.3g} s")
        walk, trains = _conduct(population, noise, plan, offset)
        for subject, gait in enumerate(gaits):
            lock = math.nan
            if plan.solvable:
                locks = locked_gaits(gait, gait.unperturbed_period + offset, pieces[subject])
                lock = next((found.lag for found in reversed(locks) if found.stable), lock)
            trials.append(_trial(walk, trains, subject, offset, lock))
    basins = []
    for gait, branches in zip(gaits, pieces, strict=True) if plan.solvable else ():
        base = gait.unperturbed_period
        basins.append([100 * (end / base - 1) for end in basin_of(gait, branches)])
    return Study(tuple(trials), np.reshape(basins, (-1, 2)))


def _conduct(
    population: Population, noise: Floats, plan: StudyPlan, offset: float
) -> tuple[PopulationWalk, PulseTrains]:
    """
    Walk the baseline, plan the pulses from it as a protocol does, then walk the trial with them.

    ``noise`` (n,) is that of each walker's push-offs (`noise_for`); each pulse period is the
    measured stride period plus ``offset`` [s].
    """
    steps = 2 * (plan.baseline + plan.pulses + plan.washout)
    seed = (plan.seed, _TRIAL, nanoseconds(offset) % 2**64)
    noise = noise * step_noise(seed, steps + 2, population.size, plan.hurst)
    baseline = population.walk(noise[: 2 * (plan.baseline - 1)])
    measured = baseline.stride_periods.mean(axis=0)
    trains = PulseTrains(
        first_onset=baseline.heel_strikes[-1] + (1 + plan.initial_phase) * measured,
        period=measured + offset,
        count=plan.pulses,
        torque=np.full(population.size, plan.torque),
        width=plan.width,
    )
    return population.walk(noise[:steps], trains), trains


def _trial(
    walk: PopulationWalk, trains: PulseTrains, subject: int, offset: float, lock: float
) -> Trial:
    period = float(trains.period[subject])
    measured = period - offset
    if (ending := walk.endings[subject]) is not None:
        return Trial(subject, offset, measured, ENDINGS[ending].value)
    onsets = trains.first_onset[subject] + np.arange(trains.count) * period
    events = events_of(walk.heel_strikes[:, subject], walk.toe_offs[:, subject])
    analysis = analyze(events, [nanoseconds(float(t)) for t in onsets], Side.RIGHT)
    last = analysis.entrainments[-1].verdict if analysis.entrainments else Verdict.UNDECIDED
    lags = np.array([pulse.phase_lag for pulse in analysis.pulses])
    fraction, runs = math.nan, list[int]()
    if np.isfinite(lock):
        fraction, runs = locked_runs(lags, lock, _LOCKED_WITHIN * measured)
    mean_run = float(np.mean(runs)) if runs else math.nan
    lag = float(np.median(lags[-20:])) if lags.size else math.nan
    return Trial(subject, offset, measured, last.name.lower(), fraction, mean_run, lag)


def events_of(strikes: Floats, toe_offs: Floats) -> list[GaitEvent]:
    """Return the events of a walk up to its end; heel strike 0 is the right, perturbed leg's."""
    events = [GaitEvent(0, EventKind.HEEL_STRIKE, Side.RIGHT, 0)]
    for step, (off, strike) in enumerate(zip(toe_offs, strikes[1:], strict=True), start=1):
        if not np.isfinite(strike):  # it fell or flew off
            break
        side = Side.LEFT if step % 2 else Side.RIGHT
        events.append(GaitEvent(nanoseconds(float(off)), EventKind.TOE_OFF, side, step))
        events.append(GaitEvent(nanoseconds(float(strike)), EventKind.HEEL_STRIKE, side, step))
    return events


def verdicts(study: Study, offset: float) -> dict[str, int]:
    """Count the verdicts at one pulse period; they add up to the number of subjects."""
    return dict(Counter(t.verdict for t in study.trials if t.period_offset == offset))


def measured_basin_percent(study: Study) -> Floats:
    """Each subject's largest distance from its own period at which it was found entrained [%]."""
    widest = np.zeros(1 + max(trial.subject for trial in study.trials))
    for trial in study.trials:
        if trial.verdict == "entrained":
            reached = abs(trial.period_offset) / trial.measured_period
            widest[trial.subject] = max(widest[trial.subject], reached)
    return 100 * widest
