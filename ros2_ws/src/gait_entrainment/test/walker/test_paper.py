# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The walker against the paper's numbers and against its equations, integrated as printed."""

import math

import numpy as np
import pytest
from driving import (
    LATE_TOE_OFF,
    SECOND,
    TABLE_1,
    heel_strikes,
    in_seconds,
    paper_form,
    pulse_trains,
    toe_offs,
    walked,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_equations import walk
from step_to_step import step_to_step

from gait_entrainment.conventions import Side

STEPS = 5
EVENT_TOLERANCE = 1e-9


def test_period_one_gait_of_the_paper():
    _, events = walked(seconds=20)
    periods = np.diff(heel_strikes(events))
    assert periods == pytest.approx(0.967, abs=5e-4)
    assert TABLE_1.step_length / periods == pytest.approx(1.03, abs=5e-3)
    assert np.ptp(periods) < 1e-14


def test_floquet_multiplier_by_differences():
    speed, h = TABLE_1.speed_after_collision, 1e-3
    after = step_to_step(TABLE_1, [speed - h, speed + h]).speed
    assert np.diff(after)[0] / (2 * h) == pytest.approx(0.25, abs=1e-6)


def test_floquet_multiplier_by_convergence():
    speeds = [TABLE_1.speed_after_collision * 1.02]
    for _ in range(6):
        speeds.append(float(step_to_step(TABLE_1, speeds[-1]).speed))
    errors = np.array(speeds) - TABLE_1.speed_after_collision
    ratios = errors[1:] / errors[:-1]
    assert np.all(np.abs(np.diff(ratios)) < 0.01)
    assert ratios[-1] == pytest.approx(0.25, abs=1e-5)


def test_smallest_force_of_the_leading_leg_is_at_the_start_of_double_stance():
    walker, _ = walked(seconds=0.966)
    samples = walker.sample(np.arange(0, int(0.966 * SECOND), 200_000))
    force = samples.force[:, Side.RIGHT]
    assert np.argmin(force) == 0
    assert force[0] == pytest.approx(149.5, abs=0.25)
    assert force[0] == pytest.approx(TABLE_1.least_leading_force, rel=1e-9)


def compare(parameters, pulses, speed):
    """Check events up to the end of either walk, and the end itself, within the tolerance."""
    rate = None if speed is None else -speed / parameters.leg_length
    reference = walk(paper_form(parameters), in_seconds(pulses), Side.RIGHT, STEPS, rate)
    walker, events = walked(pulses, 40.0, parameters, initial_speed=speed)
    strikes, offs = len(reference.heel_strikes), len(reference.toe_offs)
    assert heel_strikes(events)[:strikes] == pytest.approx(
        reference.heel_strikes, abs=EVENT_TOLERANCE
    )
    assert toe_offs(events)[:offs] == pytest.approx(reference.toe_offs, abs=EVENT_TOLERANCE)
    ending = walker.ending
    if reference.ending is None:
        assert ending is None or ending.time >= reference.heel_strikes[-1] - EVENT_TOLERANCE
    else:
        assert ending is not None
        assert ending.kind == reference.ending
        assert len(heel_strikes(events)) == strikes
        assert len(toe_offs(events)) == offs
        # If the walker stops, the reference finds the time no better than this.
        assert ending.time == pytest.approx(reference.end_time, abs=1e-7)
        assert ending.angle == pytest.approx(reference.end_angle, abs=1e-7)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(left=pulse_trains(), right=pulse_trains())
def test_events_under_pulses_on_both_legs(left, right):
    compare(TABLE_1, (left, right), None)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    left=pulse_trains(st.floats(-150, 80)),
    right=pulse_trains(st.floats(-150, 80)),
    speed=st.floats(0.5, 1.4),
)
def test_events_and_ends_under_large_pulses(left, right, speed):
    compare(TABLE_1, (left, right), speed)


@settings(derandomize=True, deadline=None, max_examples=25)
@given(left=pulse_trains(), right=pulse_trains(), speed=st.floats(0.7, 1.3))
def test_events_with_toe_off_after_the_apex(left, right, speed):
    compare(LATE_TOE_OFF, (left, right), speed)


@pytest.mark.parametrize("phase", np.linspace(0.0, 1.0, 21))
@pytest.mark.parametrize("torque", [13.35, -13.35])
def test_one_pulse_at_every_phase_of_the_stride(phase, torque):
    onset = int((0.5 + phase * 1.9332) * SECOND)
    compare(TABLE_1, ((), ((onset, onset + SECOND // 10, torque),)), None)


def test_slow_walk_near_the_stall_has_the_right_period():
    """Barely over the apex a step takes long; the pendulum's logarithm must be right."""
    climb = 2 * 9.81 * (1 - math.cos(math.pi / 6)) - 2 * TABLE_1.push_off_work / TABLE_1.mass
    compare(TABLE_1, ((), ()), math.sqrt(climb + 1e-4))
