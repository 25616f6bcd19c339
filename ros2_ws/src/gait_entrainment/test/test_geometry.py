# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The linkage, laid out in the plane: positions of toe, ankle and mass must close it."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment import geometry

L, FOOT, D = 1.0, 0.2, 0.8
BODY = SimpleNamespace(leg_length=L, foot_length=FOOT, toe_separation=D)
POSTURES = given(psi=st.floats(1.05, 2.57))
SETTINGS = settings(derandomize=True, deadline=None, max_examples=50)


def sine(psi):
    return geometry.leg_sine(BODY, math.cos(psi))


def points(psi):
    """Toe, ankle and mass, with the ankle placed from the mass by the trailing leg's angle."""
    s = sine(psi)
    mass = (-L * s, L * math.sqrt(1 - s * s))
    hip = geometry.trailing_leg_angle(BODY, psi, s)
    ankle = (mass[0] + L * math.sin(hip), mass[1] - L * math.cos(hip))
    return (-D, 0.0), ankle, mass


@SETTINGS
@POSTURES
def test_linkage_closes(psi):
    toe, ankle, mass = points(psi)
    assert math.dist(toe, ankle) == pytest.approx(FOOT, abs=1e-12)
    assert math.dist((0, 0), mass) == pytest.approx(L, abs=1e-12)
    assert math.dist(toe, mass) == pytest.approx(
        geometry.trailing_reach(BODY, math.cos(psi)), abs=1e-12
    )
    to_toe = (toe[0] - ankle[0], toe[1] - ankle[1])
    to_mass = (mass[0] - ankle[0], mass[1] - ankle[1])
    dot = to_toe[0] * to_mass[0] + to_toe[1] * to_mass[1]
    assert dot / (FOOT * L) == pytest.approx(math.cos(psi), abs=1e-11)
    # The ankle rises above the ground, behind the line from the toe to the mass.
    assert ankle[1] >= -1e-12
    assert to_toe[0] * to_mass[1] - to_toe[1] * to_mass[0] > 0


def test_linkage_at_heel_strike_has_both_feet_flat():
    alpha = math.pi / 6
    start = math.pi / 2 - alpha
    assert sine(start) == pytest.approx(math.sin(alpha), abs=1e-12)
    assert geometry.trailing_leg_angle(BODY, start, sine(start)) == pytest.approx(-alpha)


@SETTINGS
@POSTURES
def test_cosine_and_sine_are_inverse(psi):
    assert geometry.ankle_cosine(BODY, sine(psi)) == pytest.approx(math.cos(psi), abs=1e-12)


@SETTINGS
@POSTURES
def test_derivatives_are_those_of_the_angles(psi):
    h = 1e-5
    s = sine(psi)
    slope = geometry.leg_per_ankle(BODY, math.sin(psi), math.sqrt(1 - s * s))
    difference = (math.asin(sine(psi - h)) - math.asin(sine(psi + h))) / (2 * h)
    assert slope == pytest.approx(difference, abs=1e-8)

    def hip(x):
        return geometry.trailing_leg_angle(BODY, x, sine(x))

    reach = geometry.trailing_reach(BODY, math.cos(psi))
    rate = geometry.trailing_leg_per_ankle(BODY, psi, s, slope, reach)
    assert rate == pytest.approx((hip(psi + h) - hip(psi - h)) / (2 * h), abs=1e-8)


@SETTINGS
@given(psi=st.floats(1.05, 2.57), torque=st.floats(0, 200))
def test_forces_balance_foot_and_mass(psi, torque):
    """F_A times its lever about the ankle is T; F_B follows from Newton along the leading leg."""
    toe, ankle, mass = points(psi)
    reach = geometry.trailing_reach(BODY, math.cos(psi))
    force = geometry.trailing_force(BODY, torque, math.sin(psi), reach)
    direction = ((mass[0] - toe[0]) / reach, (mass[1] - toe[1]) / reach)
    lever = (toe[0] - ankle[0]) * direction[1] - (toe[1] - ankle[1]) * direction[0]
    assert force * lever == pytest.approx(torque, rel=1e-9, abs=1e-12)
    # The part of F_A along the leading leg is the force that this leg need not carry.
    along = (direction[0] * mass[0] + direction[1] * mass[1]) / L
    arm = geometry.unloading_arm(BODY, math.sin(psi), sine(psi))
    assert arm * torque == pytest.approx(force * along, rel=1e-9, abs=1e-12)


def test_small_drop_keeps_its_digits():
    angle = 1e-9
    assert geometry.drop(math.sin(angle), math.cos(angle)) == pytest.approx(5e-19, rel=1e-12)


def test_work_is_the_area_under_the_torque():
    start, end = 1.1, 2.0
    spring = SimpleNamespace(ankle_stiffness=87.3, max_plantarflexion=2.576)
    torque, stiffness = geometry.spring_torque(spring, start), 87.3
    mean = 0.5 * (torque + geometry.spring_torque(spring, end))
    assert geometry.torque_work(end - start, torque, stiffness) == pytest.approx(
        mean * (end - start)
    )


def test_pendulum_at_rest_carries_the_weight():
    body = SimpleNamespace(mass=80.0, gravity=9.81, leg_length=1.0)
    assert geometry.pendulum_force(body, 1.0, 0.0) == pytest.approx(784.8)
    assert geometry.pendulum_force(body, 1.0, 9.81) == pytest.approx(0, abs=1e-12)
