# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Pulses of every shape: torque, impulse and slope by quadrature; trains by brute force."""

import math
from contextlib import nullcontext
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceLimits,
    LimitError,
    Pulse,
    PulseTrain,
    Shape,
    find_driver,
)

MS = 1_000_000
SHARES = (0.0, 0.2, 1.0, 0.4, 0.0)
SHAPES = st.one_of(
    st.just({"shape": Shape.HALF_SINE}),
    st.just({"shape": Shape.SAMPLES, "samples": SHARES}),
    st.tuples(st.floats(0.05, 0.5), st.floats(0.05, 0.5)).map(
        lambda flanks: {"shape": Shape.TRAPEZOID, "rise": flanks[0], "fall": flanks[1]}
    ),
)


def make_pulse(torque, duration, shape):
    """A pulse at 0; the flanks of a trapezoid are given as shares of its duration."""
    scaled = {k: v * duration if k in ("rise", "fall") else v for k, v in shape.items()}
    return Pulse(0, torque, duration, **scaled)


def definition(pulse, t):
    """The torque of a pulse at times [s], as Pulse.msg defines it."""
    if pulse.shape is Shape.HALF_SINE:
        share = np.sin(np.pi * t / pulse.duration)
    elif pulse.shape is Shape.TRAPEZOID:
        knots = [0, pulse.rise, pulse.duration - pulse.fall, pulse.duration]
        share = np.interp(t, knots, [0, 1, 1, 0])
    else:
        share = np.interp(t, np.linspace(0, pulse.duration, len(SHARES)), SHARES)
    return pulse.torque * share


@settings(derandomize=True, deadline=None, max_examples=60)
@given(shape=SHAPES, torque=st.sampled_from([-8.0, 13.0]), duration=st.floats(0.02, 0.4))
def test_torque_impulse_and_slope_are_those_of_the_shape(shape, torque, duration):
    pulse = make_pulse(torque, duration, shape)
    stamps = np.linspace(0, pulse.end - 1, 4001).astype(int)
    torques = np.array([pulse.torque_at(int(stamp)) for stamp in stamps])
    assert torques == pytest.approx(definition(pulse, stamps / 1e9), abs=1e-6 * abs(torque))
    assert pulse.impulse == pytest.approx(abs(np.trapezoid(torques, stamps / 1e9)), rel=1e-4)
    slopes = np.abs(np.diff(torques) / np.diff(stamps / 1e9))
    assert pulse.steepest == pytest.approx(slopes.max(), rel=1e-3)
    assert (pulse.torque_at(-1), pulse.torque_at(pulse.end)) == (0.0, 0.0)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    shape=SHAPES,
    duration=st.floats(0.05, 0.4),
    rate=st.sampled_from([100.0, 1000.0, 4000.0]),
    cut=st.integers(1, 300 * MS),
)
def test_the_ideal_robot_keeps_the_bounds_of_its_steps(shape, duration, rate, cut):
    robot = find_driver(f"ideal:rate={rate:g}").make(Side.LEFT, DeviceLimits(duty=1.0))
    robot.configure()
    robot.activate()
    robot.begin(0)
    pulse = make_pulse(10.0, duration, shape)
    robot.schedule(PulseTrain(Side.LEFT, (pulse,)))
    pieces = [p for until in (cut, 500 * MS) for p in robot.promise(until).pieces]
    for begin, end, torque in pieces:
        fine = np.linspace(begin, min(end, begin + round(1e9 / rate)), 7)[:-1] / 1e9
        requested = np.where(fine < duration, definition(pulse, fine), 0.0)
        assert np.abs(requested - torque).max() <= pulse.steepest * (0.5 / rate + 1e-9) + 1e-9
    impulse = sum(torque * (end - begin) / 1e9 for begin, end, torque in pieces)
    # A step of length h is wrong by at most s h^2 / 8 at a kink of slope s, and by c h^3 / 24 at
    # a curvature c.
    kinks = 2 * pulse.steepest * (len(SHARES) + 1) / rate**2 / 8
    curvature = 10.0 * (math.pi / duration) ** 2 * duration / rate**2 / 24
    assert abs(impulse - pulse.impulse) <= kinks + curvature


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    gaps=st.lists(st.integers(100, 900), min_size=1, max_size=5),
    widths=st.lists(st.integers(1, 300), min_size=5, max_size=5),
    torques=st.lists(st.sampled_from([1.0, -2.0, 5.0]), min_size=5, max_size=5),
    window=st.integers(300, 3000),
    split=st.integers(0, 4),
)
def test_impulse_in_a_window_is_the_largest_of_all_windows(gaps, widths, torques, window, split):
    pulses, onset = [], 0
    on = np.zeros(10_000)
    for gap, width, torque in zip(gaps, widths, torques, strict=False):
        pulses.append(Pulse(onset * MS, torque, width / 1e3))
        on[window + onset : window + onset + width] = abs(torque) / 1e3
        onset += width + gap
    sums = np.concatenate([[0.0], np.cumsum(on)])
    largest = (sums[window:] - sums[:-window]).max()
    parts = [
        PulseTrain(Side.LEFT, tuple(part)) for part in (pulses[:split], pulses[split:]) if part
    ]
    for factor, refused in ((0.999, True), (1.001, False)):
        limits = DeviceLimits(impulse=factor * largest, stride=window / 1e3, duty=1.0, duration=1)
        with pytest.raises(LimitError, match="impulse") if refused else nullcontext():
            before = ()
            for part in parts:
                limits.check(part, before)
                before = part.pulses


@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    first=st.integers(0, 2**62),
    period=st.floats(0.02, 3.0),
    number=st.integers(0, 39),
    share=st.floats(0.01, 0.99),
)
def test_each_pulse_begins_and_ends_at_its_nanosecond(first, period, number, share):
    train = PulseTrain.periodic(Side.LEFT, first, period, 40, 5.0, period * share)
    onset, end = train.onsets[number], train.pulses[number].end
    assert abs(onset - first - Fraction(period) * number * 10**9) <= Fraction(51, 100)
    assert (train.latest(onset - 1), train.latest(onset)) == (number - 1, number)
    assert train.onsets_within(onset, onset + 1) == (onset,)
    assert onset not in train.onsets_within(onset - 5, onset)
    assert (train.torque_at(end - 1), train.torque_at(end)) == (5.0, 0.0)
    moved = train.shifted(7)
    assert moved.torque_at(onset + 7) == 5.0
    assert train.followed_by(moved.shifted(10**12)).onsets[:40] == train.onsets


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ({"shape": Shape.TRAPEZOID, "rise": 0.06, "fall": 0.05}, "rise: 0.06 s, with fall 0.05"),
        ({"shape": Shape.TRAPEZOID, "rise": -0.01}, "rise"),
        ({"shape": Shape.SAMPLES, "samples": (1.0,)}, "samples"),
        ({"shape": Shape.SAMPLES, "samples": (0.0, math.nan, 0.0)}, "samples"),
        ({"shape": Shape.SAMPLES, "samples": (0.0, 1.1)}, "samples"),
    ],
)
def test_an_impossible_shape_is_refused(shape, words):
    with pytest.raises(LimitError, match=words):
        DeviceLimits().check_pulse(Pulse(0, 5.0, 0.1, **shape))
