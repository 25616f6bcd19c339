# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Strides per second of the exact walker on one core, next to those of the paper's integrator."""

import time

import numpy as np
import paper_integrator
import pytest

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment.walker.model import make_model
from gait_entrainment_studies.walks import Pulses, walk

pytestmark = pytest.mark.benchmark

WALKER = WalkerParameters()
STRIDES = 100_000
PAPER_STRIDES = 50
WIDTH = NANOSECONDS_PER_SECOND // 10
TORQUE = 0.1 * WALKER.peak_torque


def fastest(work, rounds):
    """Shortest time of several rounds: what the machine does when nothing else runs."""
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def pulses(period):
    onsets = np.rint((0.3 + period * np.arange(STRIDES + 100)) * NANOSECONDS_PER_SECOND)
    return Pulses(onsets.astype(np.int64), WIDTH, TORQUE)


def strides_per_second(train):
    # The first walk loads the compiled functions; making the model is part of every walk.
    assert walk(make_model(WALKER), 2 * STRIDES, train).toe_offs.size == 2 * STRIDES
    return STRIDES / fastest(lambda: walk(make_model(WALKER), 2 * STRIDES, train), 15)


def paper_strides_per_second():
    def work():
        return paper_integrator.walk(
            PAPER_STRIDES, -WALKER.speed_after_collision / WALKER.leg_length, 0.3, 1.883, 0.1,
            TORQUE, WALKER.mass, WALKER.leg_length, WALKER.foot_length, WALKER.gravity,
            WALKER.leg_angle, WALKER.max_plantarflexion, WALKER.ankle_stiffness,
        )  # fmt: skip

    work()
    return PAPER_STRIDES / fastest(work, 5)


def test_strides():
    stride = float(walk(make_model(WALKER), 2).heel_strikes[2])
    paper = paper_strides_per_second()
    # At a period a little off the stride's own, the pulses pass through every phase repeatedly.
    cases = {
        "no pulses": None,
        "a pulse in every stride, locked (period 50 ms short)": pulses(stride - 0.05),
        "a pulse in every stride, mean over all phases": pulses(stride * 0.93),
    }
    print(f"\nthe paper's method, compiled (Runge-Kutta, step 1e-4): {paper:.0f} strides/s")
    for name, train in cases.items():
        rate = strides_per_second(train)
        print(f"{name}: {rate:,.0f} strides/s, {rate / paper:,.0f} times the paper's method")


def test_samples():
    walker = Walker(WALKER)
    onsets = np.arange(6) * 1_883_000_000 + 1_250_000_000
    borders = np.stack([onsets, onsets + WIDTH], axis=1).ravel()
    until = 12 * NANOSECONDS_PER_SECOND
    walker.extend_torque(Side.RIGHT, borders, np.tile([TORQUE, 0.0], onsets.size), until)
    walker.advance(until)
    grid = np.arange(0, until, NANOSECONDS_PER_SECOND // 1000)
    walker.sample(grid)
    took = fastest(lambda: walker.sample(grid), 10) / grid.size
    print(f"\nsamples at 1 kHz: {took * 1e6:.2f} us each")


def test_events_in_lock_step():
    def work():
        walker = Walker(WALKER)
        for grant in range(1, 201):
            walker.extend_torque(Side.RIGHT, [], [], grant * NANOSECONDS_PER_SECOND)
            walker.advance(grant * NANOSECONDS_PER_SECOND)

    work()
    print(f"\none grant of 1 s, events only: {fastest(work, 5) / 200 * 1e6:.0f} us")
