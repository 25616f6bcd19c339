# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Rehearsal of a study: a session file's blocks on simulated persons, judged like real ones.

Each person is a walker of the model with its own body, peak torque and variation. Every block is a
fresh start, so their order has no effect and no person gets tired. A real robot is replaced by an
ideal one.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from gait_entrainment.parameters import Variation
from gait_entrainment.robot import LimitError, find_driver
from gait_entrainment.simulation import simulate
from gait_entrainment_sessions.runs import Place, PlacedRun
from gait_entrainment_sessions.session_file import Session
from gait_entrainment_studies.cohort.subjects import Subjects
from gait_entrainment_studies.sweep.engine import by_processes


def rehearse(
    session: Session, subjects: Subjects, *, seed: int, hurst: float, jobs: int
) -> Iterator[PlacedRun]:
    """
    Yield each block of a session on each subject, from ``jobs`` processes, in any order.

    Raises LimitError for a block that the limits forbid for a subject, as a run of it does.
    """
    conduct = partial(_conduct, session, subjects, seed, hurst)
    numbers = range(len(subjects.walkers) * len(session.blocks))
    for _, placed in by_processes(conduct, numbers, jobs):
        yield placed


def _conduct(
    session: Session, subjects: Subjects, seed: int, hurst: float, number: int
) -> PlacedRun:
    subject, place = divmod(number, len(session.blocks))
    block, code = session.blocks[place], f"S{subject + 1:02d}"
    drawn = np.random.SeedSequence((seed, number)).generate_state(1)
    protocol = replace(
        block.protocol,
        walker=subjects.walkers[subject],
        variation=Variation(float(subjects.variation[subject]), hurst),
        seed=int(drawn[0]),
    )
    if not find_driver(protocol.driver).simulated:
        protocol = replace(protocol, driver="ideal")
    try:
        run = simulate(protocol)
    except LimitError as error:
        raise LimitError(f"{block.place}: {code}: {error}") from None
    return PlacedRun(Place(session.file, session.study, code, "1", place + 1, block.name), run)
