# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Foot gyroscope: a real walk with motion capture, closed forms, and the mounting."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from public_data import foot_rates, foot_reference
from walks import OFFSET, STANCE, STRIDE, fed, foot_rate, sampled, times

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import find_detector
from gait_entrainment_sensors.foot_gyroscope import FootGyroscopeDetector
from gait_entrainment_sensors.offline import detect
from gait_entrainment_sensors.scoring import score

STRIKE, TOE_OFF = EventKind
UPRIGHT = FootGyroscopeDetector.Settings(axis_y=1.0)
UNTIL = 15.0


@pytest.mark.parametrize(
    "text", ["foot_gyroscope", "foot_gyroscope:axis_y=1"], ids=["axis found", "axis given"]
)
def test_a_real_walk_agrees_with_motion_capture(text):
    events, _ = detect(find_detector(text), foot_rates())
    found = [event.detection for event in events]
    reference = foot_reference()

    def scored(kind):
        by_side = {side: [d for d in found if d.side is side] for side in Side}
        return score((reference[kind, s], times(by_side[s], kind)) for s in Side)

    strikes, toe_offs = scored(STRIKE), scored(TOE_OFF)
    assert (strikes.events, toe_offs.events) == (59, 57)
    assert (strikes.found >= 58, toe_offs.found >= 56) == (True, True)
    assert (strikes.false, toe_offs.false) == (0, 0)
    assert abs(strikes.bias) < 5e-3
    assert strikes.deviation < 6e-3
    assert abs(toe_offs.bias) < 5e-3
    assert toe_offs.deviation < 12e-3
    assert max(d.detected_at - d.time for d in found) <= 0.04


@pytest.mark.parametrize("rate", [100.0, 200.0, 1000.0])
def test_events_of_a_closed_form_signal(rate):
    detector = FootGyroscopeDetector(Side.RIGHT, UPRIGHT)
    found = fed(detector, sampled(lambda t: (0.01, foot_rate(t), 0.0), UNTIL, rate))
    strikes, toe_offs = times(found, STRIKE), times(found, TOE_OFF)
    assert len(strikes) == 13  # not the first, as no swing comes before it
    assert len(toe_offs) == 13
    # The slap passes 0.25 rad/s 2 ms after the strike; push-off falls to three quarters in 5 ms.
    for n, time in enumerate(strikes, 1):
        assert time == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + 2e-3, abs=6e-3)
    for n, time in enumerate(toe_offs):
        assert time == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + STANCE + 5e-3, abs=8e-3)
    assert all(d.detected_at - d.time <= detector.latency + 1 / rate for d in found)
    assert detector.troubles() == ()


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_irregular_sampling_does_no_harm(seed):
    import random

    generator, time, samples = random.Random(seed), 0.0, []
    while time < UNTIL:
        samples.append((time, (0.0, foot_rate(time), 0.0)))
        time += generator.uniform(1e-3, 12e-3)
    found = fed(FootGyroscopeDetector(Side.RIGHT, UPRIGHT), samples)
    assert len(times(found, STRIKE)) == 13
    for n, strike in enumerate(times(found, STRIKE), 1):
        assert strike == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + 2e-3, abs=8e-3)


def rotated(rate, axis):
    return tuple(rate * component for component in axis)


AXES = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, -1), (0.6, 0.6, -0.53)]


@pytest.mark.parametrize("axis", AXES)
def test_the_mounting_is_found_in_the_first_steps(axis):
    length = math.hypot(*axis)
    axis = tuple(component / length for component in axis)
    detector = FootGyroscopeDetector(Side.RIGHT)
    assert any("not known yet" in line for line in detector.troubles())
    found = fed(detector, sampled(lambda t: rotated(foot_rate(t), axis), UNTIL))
    assert len(times(found, STRIKE)) >= 8
    assert sum(a * b for a, b in zip(detector._axis, axis, strict=True)) > 0.99


def test_a_sensor_mounted_the_wrong_way_round_is_reported():
    detector = FootGyroscopeDetector(Side.RIGHT, UPRIGHT)
    fed(detector, sampled(lambda t: (0.0, -foot_rate(t), 0.0), UNTIL))
    assert any("other way round: set axis_x" in line for line in detector.troubles())
    detector = FootGyroscopeDetector(Side.RIGHT, UPRIGHT)
    fed(detector, sampled(lambda t: (foot_rate(t), 0.0, 0.0), UNTIL))
    assert any("about another axis" in line for line in detector.troubles())


@pytest.mark.parametrize("stood", [3.5, 3.9, 4.3, 4.7])
def test_one_step_from_standing_does_not_determine_the_mounting(stood):
    """The first five seconds contain between half a step and one and a half steps."""
    start = OFFSET[Side.RIGHT] + STANCE - 0.15 - stood

    def signal(time):
        return (0.0, foot_rate(max(time + start, 0.0)), 0.0)

    detector = FootGyroscopeDetector(Side.RIGHT)
    found = fed(detector, sampled(signal, UNTIL))
    assert detector._axis == (0.0, 1.0, 0.0)
    assert len(times(found, STRIKE)) >= 4


def test_a_sensor_that_turns_over_in_mid_trial_is_reported():
    detector = FootGyroscopeDetector(Side.RIGHT)
    fed(detector, sampled(lambda t: (0.0, foot_rate(t) * (-1 if t > 10 else 1), 0.0), 25.0))
    assert any("the other way round: set" in line for line in detector.troubles())


def test_a_push_off_that_ends_between_two_samples_is_a_toe_off():
    def abrupt(time):
        phase = (time - OFFSET[Side.RIGHT]) % STRIDE
        swings = time > OFFSET[Side.RIGHT] and phase > STANCE
        return (0.0, -5.0 * (phase < STRIDE - 0.05) if swings else foot_rate(time), 0.0)

    found = fed(FootGyroscopeDetector(Side.RIGHT, UPRIGHT), sampled(abrupt, UNTIL, 50.0))
    ends = [OFFSET[Side.RIGHT] + n * STRIDE + STANCE for n in range(13)]
    assert times(found, TOE_OFF) == pytest.approx(ends, abs=0.02)


def test_a_first_step_without_a_push_off_does_not_hide_the_mounting():
    starts, ends = OFFSET[Side.RIGHT] + STANCE + 0.02, OFFSET[Side.RIGHT] + 4 * STRIDE + 0.2

    def short(time):
        return (0.0, foot_rate(time) if starts < time < ends else 0.0, 0.0)

    walk = sampled(short, ends + 1.0)
    axes = FootGyroscopeDetector.Settings()
    assert FootGyroscopeDetector.calibrated(axes, walk).axis == (0.0, 1.0, 0.0)


def test_the_axis_is_that_of_the_walk_even_if_turning_is_faster():
    def turning(time):
        rate = foot_rate(time)
        return (0.0, rate, 0.0) if time < 8.0 else (1.5 * foot_rate(time), 0.2 * rate, 0.0)

    walk = sampled(turning, 12.0)
    axes = FootGyroscopeDetector.Settings()
    assert FootGyroscopeDetector.calibrated(axes, walk).axis == (0.0, 1.0, 0.0)


def test_the_slap_of_a_slow_first_step_is_not_a_push_off():
    found = fed(
        FootGyroscopeDetector(Side.RIGHT, UPRIGHT),
        sampled(lambda t: (0.0, foot_rate(t / 4), 0.0), UNTIL),
    )
    ends = [4 * (OFFSET[Side.RIGHT] + n * STRIDE + STANCE) for n in range(3)]
    assert times(found, TOE_OFF) == pytest.approx([e for e in ends if e < UNTIL], abs=0.04)


def test_gaps_do_not_invert_the_mounting():
    for stream in foot_rates():
        kept = [(t, v) for t, v in zip(stream.times, stream.values, strict=True) if t % 9 < 6]
        settings = FootGyroscopeDetector.calibrated(UPRIGHT.__class__(), kept)
        assert settings.axis == (0.0, 1.0, 0.0)


def test_single_lost_samples_that_read_zero_are_not_events():
    samples = sampled(lambda t: (0.0, foot_rate(t) + 0.01, 0.0), UNTIL)
    whole = fed(FootGyroscopeDetector(Side.RIGHT, UPRIGHT), samples)
    for first in range(25):
        with_zeros = list(samples)
        with_zeros[first::25] = [(t, (0.0, 0.0, 0.0)) for t, _ in samples[first::25]]
        detector = FootGyroscopeDetector(Side.RIGHT, UPRIGHT)
        found = fed(detector, with_zeros)
        for kind in EventKind:
            assert times(found, kind) == pytest.approx(times(whole, kind), abs=0.01)
        assert any("zeros in mid-movement" in line for line in detector.troubles())


def test_sensors_on_the_wrong_feet_are_reported():
    for stream in foot_rates():
        for side in Side:
            detector = FootGyroscopeDetector(side, UPRIGHT)
            fed(detector, zip(stream.times[:2000], stream.values[:2000], strict=True))
            swapped = [line for line in detector.troubles() if "sensors swapped" in line]
            assert bool(swapped) == (side is not stream.side)


def test_degrees_per_second_are_reported():
    detector = FootGyroscopeDetector(Side.RIGHT, UPRIGHT)
    fed(detector, sampled(lambda t: (0.0, math.degrees(foot_rate(t)), 0.0), UNTIL))
    assert any("rad/s are expected" in line for line in detector.troubles())


def test_a_saturated_gyroscope_is_reported():
    detector = FootGyroscopeDetector(Side.RIGHT, FootGyroscopeDetector.Settings(axis_x=1.0))
    fed(detector, sampled(lambda t: (max(-2.0, min(foot_rate(t), 2.0)), 0.0, 0.0), UNTIL))
    assert any("increase the sensor's range" in line for line in detector.troubles())


def test_a_heel_that_is_lifted_and_put_down_is_not_a_step():
    def lifted(time):
        return (0.0, 0.6 * math.sin(2 * math.pi * time / 1.5), 0.0)

    assert fed(FootGyroscopeDetector(Side.RIGHT, UPRIGHT), sampled(lifted, UNTIL)) == []
