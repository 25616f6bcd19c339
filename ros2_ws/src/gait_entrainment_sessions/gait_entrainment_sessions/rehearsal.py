# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A study rehearsed: the blocks of a session file on simulated persons, judged as real ones.

Each person is a walker of the model with a body, a peak torque and a variation of its own, and
walks each block from a fresh start: no order of blocks matters to them, and none gets tired.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.gait import analyze
from gait_entrainment.protocol import PulsePlan
from gait_entrainment.run import Run
from gait_entrainment_sessions.runs import Place, PlacedRun
from gait_entrainment_sessions.session_file import Block, Session, SessionError
from gait_entrainment_studies.cohort.population import Population, noise_for
from gait_entrainment_studies.cohort.study import StudyPlan, conduct, events_of
from gait_entrainment_studies.cohort.subjects import Subjects

# A stream of noise beside those of the subjects and of the cohort's own trials.
_PILOT = 1


def rehearse(
    session: Session, subjects: Subjects, *, seed: int, hurst: float
) -> Iterator[PlacedRun]:
    """
    Give each block of a session on each subject.

    Raises SessionError for a block whose pulses have no fixed offset from the stride period.
    """
    population = Population(subjects.walkers)
    noise = noise_for(population, subjects.variation, (seed, _PILOT), hurst)
    for number, block in enumerate(session.blocks, start=1):
        plan, offset = _plan(block, seed + number, hurst)
        torques = [
            replace(block.protocol, walker=walker).pulse_torque for walker in subjects.walkers
        ]
        walk, trains = conduct(population, noise, plan, offset, np.array(torques))
        for subject, walker in enumerate(subjects.walkers):
            events = events_of(walk.heel_strikes[:, subject], walk.toe_offs[:, subject])
            period = float(trains.period[subject])
            first = float(trains.first_onset[subject])
            known = math.isfinite(first)  # else it fell in the baseline
            onsets = [first + n * period for n in range(plan.pulses)] if known else []
            stamps = [nanoseconds(onset) for onset in onsets]
            run = Run(
                protocol=replace(block.protocol, side=Side.RIGHT, walker=walker),
                events=tuple(events),
                onsets=tuple(t for t in stamps if t <= events[-1].stamp),
                timings=(),
                measured_period=period - offset,
                pulse_period=period,
                analysis=analyze(events, stamps, Side.RIGHT),
                blocks=(),
            )
            code = f"S{subject + 1:02d}"
            place = Place(session.file, session.study, code, "1", number, block.name)
            yield PlacedRun(place, run)


def _plan(block: Block, seed: int, hurst: float) -> tuple[StudyPlan, float]:
    """Return what the cohort's experiment calls a block, and its pulse period's offset [s]."""
    protocol, pulses = block.protocol, block.protocol.pulses
    # What the cohort's experiment has no word for, as it is by itself.
    unsaid: dict[str, Any] = {
        name: getattr(PulsePlan, name)
        for name in ("sweep", "jitter", "shape", "rising", "catch_share", "catch_pulses")
    }
    simple = replace(pulses, **unsaid) == pulses
    simple = simple and not (protocol.blocks or protocol.open_ended)
    if pulses.period_offset is None or not simple:
        raise SessionError(
            f"{block.place}: pulses: no rehearsal of these; allowed: square pulses at a fixed "
            "period_offset, in a protocol without blocks of its own, all parts counted in strides"
        )
    plan = StudyPlan(
        width=pulses.width,
        baseline=protocol.baseline,
        pulses=pulses.count,
        washout=protocol.washout,
        initial_phase=pulses.initial_phase,
        seed=seed,
        hurst=hurst,
    )
    return plan, pulses.period_offset
