# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import math
from dataclasses import replace

import numpy as np
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import ParameterError, WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_studies.existence.stiffness_range import (
    Limit,
    existence_map,
    stiffness_range,
)

TABLE_1 = WalkerParameters()


def walked(parameters):
    """Return slowest angular velocity, least force, samples, and the index of the least force."""
    walker = Walker(parameters, Side.RIGHT)
    for side in Side:
        walker.extend_torque(side, [], [], 10**11)
    times = np.arange(0, 5 * 10**9, 10**6)
    walker.advance(int(times[-1]))
    samples = walker.sample(times)
    index = np.arange(times.size)
    force = samples.force[index, samples.leading]
    rate = samples.velocity[index, samples.leading]
    return np.abs(rate).min(), force.min(), samples, int(np.argmin(force))


def test_lower_end_is_the_papers_closed_form():
    p = TABLE_1
    numerator = 2 * p.leg_length * p.mass * p.gravity * (1 - math.cos(p.leg_angle))
    numerator *= 1 - math.cos(2 * p.leg_angle) ** 2
    k_c = numerator / (p.leg_angle + p.max_plantarflexion - math.pi / 2) ** 2
    found = stiffness_range(p)
    assert found.just_vault_over == pytest.approx(k_c, rel=1e-12)
    assert found.falls_at is Limit.APEX


@pytest.mark.parametrize("leg_angle", [0.33, 0.42, math.pi / 6, 0.7])
def test_the_walker_nearly_stalls_at_the_lower_end(leg_angle):
    found = stiffness_range(TABLE_1, leg_angle)
    p = replace(TABLE_1, leg_angle=leg_angle, ankle_stiffness=found.just_vault_over * (1 + 1e-6))
    slowest, _, _, _ = walked(p)
    assert slowest < 0.02


@pytest.mark.parametrize("leg_angle", [0.33, math.pi / 6, 0.75])
def test_the_leading_leg_nearly_lifts_off_at_the_upper_end(leg_angle):
    found = stiffness_range(TABLE_1, leg_angle)
    p = replace(TABLE_1, leg_angle=leg_angle, ankle_stiffness=found.just_fly_off * (1 - 1e-6))
    _, least, samples, index = walked(p)
    # Sampled every millisecond, over which the force changes by a few newtons.
    assert 0 <= least < 6
    at_strike = abs(samples.position[index, samples.leading[index]]) > leg_angle - 0.01
    assert at_strike
    assert samples.double_stance[index] == (found.flies_off_at is Limit.HEEL_STRIKE)


def test_map_covers_the_leg_angles_with_a_linkage_and_ignores_the_stiffness():
    ranges = existence_map(TABLE_1, 40)
    assert [r.leg_angle for r in ranges] == sorted(r.leg_angle for r in ranges)
    assert ranges == existence_map(replace(TABLE_1, ankle_stiffness=100.0), 40)
    assert all(r.exists for r in ranges)
    with pytest.raises(ParameterError, match="leg_angle"):
        stiffness_range(TABLE_1, 0.9)
