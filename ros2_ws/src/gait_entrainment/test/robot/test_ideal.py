# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The ideal ankle robot: its promises give the commanded pulses, however they are cut."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceLimits, LimitError, PulseTrain, find_driver

SECOND = 1_000_000_000


def train(**changes):
    values = {
        "side": Side.LEFT,
        "first_onset": 3 * SECOND,
        "period": 1.9,
        "count": 4,
        "torque": 13.0,
        "duration": 0.1,
    }
    return PulseTrain.periodic(**{**values, **changes})


def ideal_robot(start=0, limits=None):
    robot = find_driver("ideal").make(Side.LEFT, limits)
    robot.configure()
    robot.activate()
    robot.begin(start)
    return robot


def torque_at(profiles, stamp):
    """Torque that adjoining profiles promise for a stamp, straight from their definition."""
    for profile in profiles:
        if profile.times[0] <= stamp < profile.valid_until:
            return [
                torque
                for time, torque in zip(profile.times, profile.torques, strict=True)
                if time <= stamp
            ][-1]
    raise AssertionError("not promised")


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    cuts=st.lists(st.integers(0, 12 * SECOND), max_size=30),
    first=st.integers(0, 5 * SECOND),
    period=st.floats(0.11, 3.0),
    duration=st.floats(0.001, 0.1),
    probes=st.lists(st.integers(0, 12 * SECOND - 1), min_size=5, max_size=20),
)
def test_promises_give_the_pulses_however_they_are_cut(cuts, first, period, duration, probes):
    robot = ideal_robot(limits=DeviceLimits(duty=1.0, impulse=1e3))
    pulses = train(first_onset=first, period=period, duration=duration)
    robot.schedule(pulses)
    profiles = [robot.promise(until) for until in [*sorted(cuts), 12 * SECOND]]
    spans = [
        (
            first + round(n * period * 1e9),
            first + round(n * period * 1e9) + round(duration * 1e9),
        )
        for n in range(4)
    ]
    # Both sides of every edge, where a cut could go wrong, and stamps anywhere.
    edges = [edge + d for span in spans for edge in span for d in (-1, 0)]
    for stamp in [*probes, *(e for e in edges if 0 <= e < 12 * SECOND)]:
        on = any(begin <= stamp < end for begin, end in spans)
        assert torque_at(profiles, stamp) == (13.0 if on else 0.0)
    promised = [onset for profile in profiles for onset in profile.onsets]
    assert promised == [begin for begin, _ in spans if begin < 12 * SECOND]
    for before, after in itertools.pairwise(profiles):
        assert after.times[0] == before.valid_until
    assert robot.delivered == len(promised)


def test_onsets_are_rounded_from_the_first_one():
    period = 1.8832295304285713
    onsets = train(period=period, count=1001).onsets
    assert onsets[1000] == 3 * SECOND + round(1000 * period * 1e9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"torque": 30.1}, "torque: 30.1 N m.*-30 to 30"),
        ({"torque": -31.0}, "torque: -31 N m"),
        ({"torque": math.nan}, "torque: nan"),
        ({"duration": 0.0}, "width: 0 s.*at most 0.5"),
        ({"duration": 0.51}, "width"),
        ({"duration": math.nan, "count": 1}, "width"),
        ({"period": 0.1}, "period.*overlap"),
        ({"count": 0}, "count: 0; allowed: 1 to 10000 at a time"),
        ({"side": Side.RIGHT}, "side"),
        ({"first_onset": 1}, "already promised"),
    ],
)
def test_a_forbidden_train_is_refused_and_changes_nothing(changes, words):
    robot = ideal_robot()
    robot.promise(SECOND)
    with pytest.raises(LimitError, match=words):
        robot.schedule(train(**changes))
    assert robot.train is None
    assert robot.promise(20 * SECOND).torques == (0.0,)


def test_first_pulses_rise_in_equal_steps():
    robot = ideal_robot(limits=DeviceLimits(rising=3))
    robot.schedule(train(count=6, torque=-12.0))
    heights = [torque for torque in robot.promise(20 * SECOND).torques if torque]
    assert heights == [-3.0, -6.0, -9.0, -12.0, -12.0, -12.0]


def test_one_train_follows_another():
    robot, first, second = ideal_robot(), train(), train(first_onset=11 * SECOND, torque=6.0)
    robot.schedule(first)
    with pytest.raises(LimitError, match="overlap"):
        robot.schedule(first)
    robot.promise(first.onsets[2] + 1)
    robot.schedule(second)
    profile = robot.promise(30 * SECOND)
    assert profile.onsets == (first.onsets[3], *second.onsets)
    assert [torque for torque in profile.torques if torque] == [13.0] * 2 + [6.0] * 4


def test_nothing_is_delivered_after_a_cancel():
    robot = ideal_robot()
    robot.schedule(train())
    robot.promise(3 * SECOND + 1)
    robot.cancel()
    assert robot.promise(20 * SECOND).torques == (0.0,)


def test_a_promise_is_not_taken_back():
    robot = ideal_robot(5)
    robot.promise(10)
    with pytest.raises(ValueError, match="take back"):
        robot.promise(9)


def test_the_limits_are_the_users_own():
    DeviceLimits(torque=50.0).check(train(torque=45.0))
