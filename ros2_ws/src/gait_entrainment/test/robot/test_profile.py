# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A torque profile: its pieces, and breaches of its contract."""

import math

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.robot import ProfileError, TorqueProfile


@pytest.mark.parametrize(
    ("times", "torques", "until", "words"),
    [
        ((), (), 10, "at least one"),
        ((0, 5), (1.0,), 10, "one torque for each"),
        ((1,), (0.0,), 10, "does not adjoin"),
        ((0,), (0.0,), 11, "beyond"),
        ((0, 5, 5), (0.0, 1.0, 0.0), 10, "ascending"),
        ((0, 10), (0.0, 1.0), 10, "ascending"),
        ((0, 3), (0.0, 1.0), 0, "ascending"),
        ((0,), (math.nan,), 10, "finite"),
        ((0,), (0.0,), 10, ""),
        ((0,), (0.0,), 0, ""),
    ],
)
def test_breaches_of_a_profiles_contract(times, torques, until, words):
    profile = TorqueProfile(Side.LEFT, times, torques, (), until)
    if not words:
        profile.check(0, 10)
        return
    with pytest.raises(ProfileError, match=words):
        profile.check(0, 10)


def test_pieces_cover_the_profile():
    profile = TorqueProfile(Side.LEFT, (0, 5), (0.0, 1.0), (5,), 10)
    assert profile.pieces == ((0, 5, 0.0), (5, 10, 1.0))
    assert profile.has_length
    assert not TorqueProfile(Side.LEFT, (10,), (0.0,), (), 10).has_length
