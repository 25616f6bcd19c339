# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Samples: postures, velocities, torques, forces and energy of the walker between events."""

import math
from itertools import pairwise

import numpy as np
import pytest
from driving import (
    LATE_TOE_OFF,
    SECOND,
    TABLE_1,
    leg_angle,
    paper_form,
    pulse_trains,
    walked,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.walker import Walker

SETTINGS = settings(derandomize=True, deadline=None, max_examples=25)
RUN = 5 * SECOND
TRAINS = pulse_trains(seconds=5.0)
WALKERS = st.sampled_from([TABLE_1, LATE_TOE_OFF])


def sampled(parameters, pulses, step=3_700_011):
    walker, events = walked(pulses, 5.0, parameters)
    grid = np.arange(0, walker.time_reached, step)
    return grid, walker.sample(grid), events


@SETTINGS
@given(parameters=WALKERS, left=TRAINS, right=TRAINS)
def test_forces_are_those_of_the_paper(parameters, left, right):
    _, s, _ = sampled(parameters, (left, right))
    paper = paper_form(parameters)
    theta, rate = leg_angle(s)
    row = np.arange(theta.size)
    both = s.double_stance
    pulse = s.delivered_torque[row, 1 - s.leading]
    # The linkage exists only in double stance.
    closed = np.where(both, theta, paper.alpha)
    trailing = paper.trailing_force(closed, paper.torque(closed, pulse))
    assert s.force[row, 1 - s.leading][both] == pytest.approx(trailing[both], rel=1e-7, abs=1e-6)
    leading = paper.leading_force(closed, rate, pulse)
    pendulum = paper.m * paper.g * np.cos(theta) - paper.m * paper.L * rate**2
    expected = np.where(both, leading, pendulum)
    assert s.force[row, s.leading] == pytest.approx(expected, rel=1e-7, abs=1e-6)


@SETTINGS
@given(parameters=WALKERS, left=TRAINS, right=TRAINS)
def test_ground_reactions_accelerate_the_mass_as_the_equation_of_motion_says(
    parameters, left, right
):
    _, s, _ = sampled(parameters, (left, right))
    paper = paper_form(parameters)
    theta, rate = leg_angle(s)
    row = np.arange(theta.size)
    pulse = s.delivered_torque[row, 1 - s.leading]
    closed = np.where(s.double_stance, theta, paper.alpha)
    swing = paper.g / paper.L * np.sin(theta)
    bend = np.where(s.double_stance, paper.acceleration(closed, pulse), swing)
    ax = -paper.L * bend * np.cos(theta) + paper.L * rate**2 * np.sin(theta)
    az = -paper.L * bend * np.sin(theta) - paper.L * rate**2 * np.cos(theta)
    total = s.ground_reaction.sum(axis=1)
    assert total[:, 0] == pytest.approx(paper.m * ax, rel=1e-7, abs=1e-6)
    assert total[:, 1] == pytest.approx(paper.m * (az + paper.g), rel=1e-7, abs=1e-6)
    assert pytest.approx(np.abs(s.force)) == np.hypot(*s.ground_reaction.T).T


@SETTINGS
@given(parameters=WALKERS, left=TRAINS, right=TRAINS)
def test_energy_changes_by_the_work_of_the_torque_alone(parameters, left, right):
    """Kinetic and potential energy within each double stance, against the area under T(psi)."""
    grid, s, events = sampled(parameters, (left, right), step=499_979)
    theta, rate = leg_angle(s)
    p = parameters
    energy = p.mass * (0.5 * (p.leg_length * rate) ** 2 + p.gravity * p.leg_length * np.cos(theta))
    row = np.arange(theta.size)
    psi = s.position[row, 3 - s.leading]
    effort = s.effort[row, 3 - s.leading]
    strikes = np.array([e.stamp for e in events if e.kind == 0])
    for begin, end in pairwise(strikes):
        inside = (grid >= begin) & (grid < end)
        stance = np.flatnonzero(inside & s.double_stance)
        swing = np.flatnonzero(inside & ~s.double_stance)
        assert np.ptp(energy[swing]) < 1e-10
        work = np.sum(0.5 * (effort[stance][1:] + effort[stance][:-1]) * np.diff(psi[stance]))
        # The trapezia miss edges of pulses between two samples, and the bend where
        # the ankle, which can only push, stops pushing.
        widest = np.diff(psi[stance]).max()
        jumps = np.abs(np.diff(s.delivered_torque[stance][:, 1 - s.leading[stance[0]]])).sum()
        slack = 1e-9 + p.ankle_stiffness * widest**2 / 8 + jumps * widest
        assert energy[stance[-1]] - energy[stance[0]] == pytest.approx(work, abs=slack)


@SETTINGS
@given(right=TRAINS)
def test_velocities_are_the_slopes_of_the_positions(right):
    walker, events = walked(((), right), 5.0)
    h = 1000
    grid = np.arange(10_000, walker.time_reached - h, 7_300_019)
    edges = [e.stamp for e in events] + [t for a, b, _ in right for t in (a, b)]
    near = np.min(np.abs(grid[:, None] - np.array(edges)[None, :]), axis=1) <= 2 * h
    grid = grid[~near]
    slope = (walker.sample(grid + h).position - walker.sample(grid - h).position) / (2e-9 * h)
    assert walker.sample(grid).velocity == pytest.approx(slope, abs=1e-6)


def test_postures_are_continuous_through_toe_off_and_heel_strike():
    walker, events = walked(seconds=5)
    for event in events[1:]:
        before, after = (walker.sample(np.array([event.stamp + dt])) for dt in (-1, 1))
        assert after.position == pytest.approx(before.position, abs=1e-7)
        if event.kind == 1:
            # The swing leg leaves with the rates of toe-off.
            assert after.velocity == pytest.approx(before.velocity, abs=1e-5)


def test_posture_at_heel_strike():
    walker, _ = walked(seconds=2)
    s = walker.sample(np.array([0]))
    alpha = math.pi / 6
    assert s.position[0] == pytest.approx([-alpha, alpha, -alpha, alpha], abs=1e-12)
    assert s.double_stance[0]
    assert s.leading[0] == Side.RIGHT
    assert s.effort[0] == pytest.approx([0, 0, TABLE_1.peak_torque, 0])
    rate = TABLE_1.speed_after_collision
    assert s.velocity[0, [1, 3]] == pytest.approx([-rate, -rate])


def test_a_sample_shows_the_event_of_its_own_stamp():
    walker, events = walked(seconds=2)
    toe_off, strike = events[1], events[2]
    assert not walker.sample(np.array([toe_off.stamp])).double_stance[0]
    after = walker.sample(np.array([strike.stamp, strike.stamp - 1]))
    assert after.double_stance.tolist() == [True, False]
    assert after.leading.tolist() == [Side.LEFT, Side.RIGHT]


def test_a_sample_shows_the_torque_up_to_its_own_stamp():
    walker, _ = walked(((), ((SECOND, 2 * SECOND, 5.0),)), 3.0)
    s = walker.sample(np.array([SECOND, SECOND + 1, 2 * SECOND, 2 * SECOND + 1]))
    assert s.delivered_torque[:, Side.RIGHT].tolist() == [0, 5, 5, 0]
    assert s.delivered_torque[:, Side.LEFT].tolist() == [0, 0, 0, 0]


def test_times_outside_the_last_stretch_are_refused():
    walker = Walker(TABLE_1)
    walker.advance(SECOND)
    walker.advance(2 * SECOND)
    walker.sample(np.array([SECOND, 2 * SECOND]))
    for outside in (SECOND - 1, 2 * SECOND + 1):
        with pytest.raises(ValueError, match="not all within the last stretch"):
            walker.sample(np.array([outside]))
    assert walker.sample(np.empty(0, np.int64)).position.shape == (0, 4)


def test_time_does_not_go_back():
    walker = Walker(TABLE_1)
    walker.advance(SECOND)
    with pytest.raises(ValueError, match="past"):
        walker.advance(SECOND - 1)
