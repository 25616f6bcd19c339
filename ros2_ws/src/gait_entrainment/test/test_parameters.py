# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's numbers, and impossible parameters."""

import math
from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.parameters import ParameterError, WalkerParameters
from gait_entrainment.settings import settings_of


def test_table_1_gives_the_numbers_of_the_paper():
    p = WalkerParameters()
    # 17 % of body weight x leg length is 133.4 N m; k = 87.3 was rounded from it.
    assert p.peak_torque == pytest.approx(133.4, abs=0.1)
    assert p.just_vault_over_stiffness == pytest.approx(67.5, abs=0.05)
    assert p.floquet_multiplier == pytest.approx(0.25, abs=1e-12)
    # The paper prints 149.5 N; Table 1, whose digits are rounded, gives 149.3 N.
    assert p.least_leading_force == pytest.approx(149.5, abs=0.25)
    assert p.step_length == pytest.approx(1.0, abs=1e-12)


def test_closed_forms_of_the_paper():
    p = WalkerParameters()
    angle = p.leg_angle + p.max_plantarflexion - math.pi / 2
    c2 = math.cos(2 * p.leg_angle) ** 2
    assert p.push_off_work == pytest.approx(0.5 * p.ankle_stiffness * angle**2, rel=1e-14)
    k_c = 2 * 80 * 9.81 * (1 - math.cos(p.leg_angle)) * (1 - c2) / angle**2
    assert p.just_vault_over_stiffness == pytest.approx(k_c, rel=1e-12)
    eq_8 = math.sqrt(p.ankle_stiffness * angle**2 / (p.mass * (1 - c2)))
    assert p.collision_speed == pytest.approx(eq_8, rel=1e-14)


def test_gait_ends_exactly_at_its_two_limits():
    p = WalkerParameters()
    for limit, sign in ((p.just_vault_over_stiffness, 1), (p.just_fly_off_stiffness, -1)):
        WalkerParameters(ankle_stiffness=limit * (1 + sign * 1e-9))
        with pytest.raises(ParameterError, match="ankle_stiffness"):
            WalkerParameters(ankle_stiffness=limit * (1 - sign * 1e-9))


def test_energy_at_the_barrier_and_force_vanish_at_the_limits():
    p = WalkerParameters()
    weak = WalkerParameters(ankle_stiffness=p.just_vault_over_stiffness * (1 + 1e-12))
    assert weak.least_kinetic_energy == pytest.approx(0, abs=1e-9)
    strong = WalkerParameters(ankle_stiffness=p.just_fly_off_stiffness * (1 - 1e-12))
    assert strong.least_leading_force == pytest.approx(0, abs=1e-8)


def test_message_gives_the_energy_that_a_falling_walker_lacks():
    with pytest.raises(ParameterError) as refused:
        WalkerParameters(ankle_stiffness=60)
    # Each N m/rad below k_C costs angle^2 / 2 of work, divided by the share a collision takes.
    angle = math.pi / 6 + 2.576 - math.pi / 2
    missing = (67.4792 - 60) * angle**2 / 2 / 0.75
    assert f"because it lacks {missing:.3g} J" in str(refused.value)
    assert "allowed: 67.4792 to 111.878 N m/rad" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_message_gives_the_force_missing_when_the_walker_flies_off():
    with pytest.raises(ParameterError, match=r"would have to pull with [\d.]+ N; allowed"):
        WalkerParameters(ankle_stiffness=120)


def test_late_toe_off_counts_the_apex_in_double_stance():
    """With toe-off after the apex, single stance has no barrier: double stance has it."""
    p = WalkerParameters(max_plantarflexion=2.8, foot_length=0.35, ankle_stiffness=90)
    assert p.toe_off_angle < 0
    at_apex = 2 * p.mass * p.gravity * p.leg_length * (1 - math.cos(p.leg_angle))
    angle = p.leg_angle + p.max_plantarflexion - math.pi / 2
    eq_9 = at_apex * (1 - p.floquet_multiplier) / angle**2
    # The spring has not done all of its work at the apex, so Eq. 9 gives too little stiffness.
    assert p.just_vault_over_stiffness > eq_9 * 1.2


@pytest.mark.parametrize("name", [f.name for f in fields(WalkerParameters)])
@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 0.0, "1", None, True])
def test_each_field_must_be_a_positive_number(name, value):
    with pytest.raises(ParameterError, match=f"^{name}: .*; allowed: above 0"):
        WalkerParameters(**{name: value})


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"leg_angle": 0.1}, "leg_angle"),
        ({"leg_angle": 0.8}, "leg_angle"),
        ({"foot_length": 1.5}, "foot_length"),
        ({"max_plantarflexion": 1.0}, "max_plantarflexion"),
        ({"max_plantarflexion": 3.2}, "max_plantarflexion"),
        ({"leg_angle": 0.12}, "max_plantarflexion"),
        ({"mass": 800}, "ankle_stiffness"),
        ({"gravity": 1.6}, "ankle_stiffness"),
        ({"leg_angle": 0.7, "max_plantarflexion": 1.2}, "leg_angle"),
    ],
)
def test_refusals_of_impossible_walkers_name_the_field_to_change(changed, name):
    with pytest.raises(ParameterError, match=f"^{name}: ") as refused:
        WalkerParameters(**changed)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "changed",
    [
        {"leg_length": 1e200},
        {"leg_length": 1e-200, "foot_length": 2e-201},
        {"gravity": 1e200, "mass": 1e200, "leg_length": 1e50, "foot_length": 1e49},
    ],
)
def test_values_beyond_floating_point_are_refused(changed):
    with pytest.raises(ParameterError):
        WalkerParameters(**changed)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(scale=st.floats(0.3, 3), weight=st.floats(0.3, 3), pull=st.floats(0.3, 3))
def test_scaling_lengths_masses_and_gravity_scales_the_limits(scale, weight, pull):
    p = WalkerParameters()
    stiffness = weight * pull * scale
    other = WalkerParameters(
        mass=p.mass * weight,
        leg_length=p.leg_length * scale,
        foot_length=p.foot_length * scale,
        gravity=p.gravity * pull,
        ankle_stiffness=p.ankle_stiffness * stiffness,
    )
    limits = ("just_vault_over_stiffness", "just_fly_off_stiffness", "least_kinetic_energy")
    for limit in limits:
        assert getattr(other, limit) == pytest.approx(getattr(p, limit) * stiffness, rel=1e-9)


def test_every_field_has_a_meaning_and_a_unit():
    for setting in settings_of(WalkerParameters).values():
        assert setting.meaning
        assert setting.unit
