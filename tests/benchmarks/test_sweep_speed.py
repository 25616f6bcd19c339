# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How fast the tongue is swept on one core and on up to two, next to the paper's integrator."""

import os
import time
from functools import partial

import numpy as np
import paper_integrator
import pytest

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.sweep.engine import by_processes
from gait_entrainment_studies.sweep.plan import Axis, SweepPlan
from gait_entrainment_studies.sweep.row import exact_borders, sweep_row

pytestmark = pytest.mark.benchmark

WALKER = WalkerParameters()
PLAN = SweepPlan(
    walker=WALKER,
    period_offsets=Axis(-0.12, 0.02, 100),
    torque_fractions=Axis(0.005, 0.25, 50),
    phases=16,
    strides=100,
    width=0.1,
)
SAMPLE_STRIDES = 200


def seconds(work):
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def sweep(jobs):
    rows = range(PLAN.torque_fractions.count)
    assert len(list(by_processes(partial(sweep_row, PLAN), rows, jobs))) == len(rows)


def by_the_papers_method(strides):
    w = WALKER
    return paper_integrator.walk(
        strides, -w.speed_after_collision / w.leg_length, 0.3, 1.883, 0.1, 0.1 * w.peak_torque,
        w.mass, w.leg_length, w.foot_length, w.gravity, w.leg_angle, w.max_plantarflexion,
        w.ankle_stiffness,
    )  # fmt: skip


def test_tongue():
    cores = min(len(os.sched_getaffinity(0)), 2)
    alone, together = seconds(lambda: sweep(1)), seconds(lambda: sweep(cores))
    strides = PLAN.walks * PLAN.strides
    # The sample must be the same gait: its mean stride period is between the pulses' and its own.
    assert 1.88 < by_the_papers_method(20) / 20 < 1.94
    sample = seconds(lambda: by_the_papers_method(SAMPLE_STRIDES))
    paper = sample / SAMPLE_STRIDES * strides
    print(f"\n{strides / 1e6:.1f} million strides: {together:.1f} s on {cores} cores,")
    print(f"{alone:.1f} s on one: parallel efficiency {alone / together / cores:.0%}")
    print(
        f"the paper's integrator, compiled, one core: {paper:.0f} s extrapolated from"
        f" {SAMPLE_STRIDES} strides in {sample:.2f} s: {paper / alone:.0f} times as long"
    )


def test_exact_borders():
    torques = np.linspace(0.005, 0.25, 50)
    took = seconds(lambda: exact_borders(WALKER, torques, 0.1))
    print(f"\nexact borders at 50 torques: {took:.2f} s")
