# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Vertical force: a real belt, closed forms, steps on the wrong belt, implausible signals."""

import math
import random
from itertools import pairwise

import pytest
from public_data import belt
from walks import OFFSET, STANCE, STRIDE, fed, force, sampled, times

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import SettingError
from gait_entrainment_sensors.vertical_force import VerticalForceDetector, VerticalForceSettings

STRIKE, TOE_OFF = EventKind
UNTIL = 12.0


def detected(signal, rate=1000.0, side=Side.RIGHT):
    detector = VerticalForceDetector(side)
    return detector, fed(detector, sampled(signal, UNTIL, rate))


def test_every_strike_on_a_real_belt_is_found_and_no_other():
    detector = VerticalForceDetector(Side.LEFT)
    found = fed(detector, belt())
    strikes = times(found, STRIKE)
    assert len(strikes) == 46
    # The walk has no gap: strides differ by less than 10 %.
    strides = [b - a for a, b in pairwise(strikes)]
    assert max(strides) < 1.1 * min(strides)
    assert len(times(found, TOE_OFF)) == 47  # the record begins in stance
    assert all(d.detected_at - d.time <= detector.latency + 0.0101 for d in found)


@pytest.mark.parametrize("rate", [100.0, 400.0, 1000.0])
def test_crossings_of_a_half_sine_are_interpolated(rate):
    _, found = detected(lambda t: (force(t),), rate)
    # 20 N are crossed this long after the sine begins and before it ends.
    late = STANCE / 3.14159 * 20.0 / 800.0
    for n, time in enumerate(times(found, STRIKE)):
        assert time == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + late, abs=0.15 / rate)
    for n, time in enumerate(times(found, TOE_OFF)):
        assert time == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + STANCE - late, abs=1 / rate)
    assert (len(times(found, STRIKE)), len(times(found, TOE_OFF))) == (11, 10)


def test_the_zero_follows_drift_during_swing():
    detector, found = detected(lambda t: (force(t) + 15.0 + 6.0 * t,))
    assert len(times(found, STRIKE)) >= 10
    assert detector._zero > 60.0


def test_a_belt_that_was_never_zeroed_is_zeroed():
    _, found = detected(lambda t: (force(t) + 90.0,))
    assert len(times(found, STRIKE)) >= 8
    _, found = detected(lambda t: (force(t) - 60.0,))
    late = STANCE / 3.14159 * 20.0 / 800.0
    for n, time in list(enumerate(times(found, STRIKE)))[3:]:
        assert time == pytest.approx(OFFSET[Side.RIGHT] + n * STRIDE + late, abs=2e-3)


def test_a_step_of_the_other_foot_on_this_belt_is_not_an_event():
    other = 5 * STRIDE + OFFSET[Side.RIGHT] + STANCE + 0.05

    def signal(time):  # the other foot comes down on this belt in the middle of the swing
        return (force(time) + (600.0 if other < time < other + 0.5 * STANCE else 0.0),)

    detector, found = detected(signal)
    plain = detected(lambda t: (force(t),))[1]
    assert detector.counts.rejected == 2  # its strike and its toe-off
    assert times(found, STRIKE) == pytest.approx(times(plain, STRIKE), abs=1e-3)
    assert times(found, TOE_OFF) == pytest.approx(times(plain, TOE_OFF), abs=1e-3)


def test_a_stance_that_both_feet_share_ends_without_a_toe_off():
    start = OFFSET[Side.RIGHT] + 5 * STRIDE

    def signal(time):  # the other foot keeps this belt loaded until the next strike
        shared = start + 0.9 * STANCE < time < start + 1.5 * STANCE
        return (max(force(time), 300.0 if shared else 0.0),)

    _, found = detected(signal)
    plain = detected(lambda t: (force(t),))[1]
    ends = [t for t in times(plain, TOE_OFF) if not start < t < start + STRIDE]
    assert times(found, TOE_OFF) == pytest.approx(ends, abs=1e-3)
    assert times(found, STRIKE) == pytest.approx(times(plain, STRIKE), abs=1e-3)


def test_single_samples_are_not_a_foot():
    """Every 50th sample is lost and reads zero, every 50th is a spike; the noise is 25 N."""
    generator = random.Random(1)

    def signal(time):
        odd = {7: 0.0, 32: 500.0}.get(round(1000 * time) % 50)
        return (force(time) + generator.gauss(0.0, 25.0) if odd is None else odd,)

    detector, found = detected(signal)
    plain = detected(lambda t: (force(t),))[1]
    assert times(found, STRIKE) == pytest.approx(times(plain, STRIKE), abs=0.02)
    assert times(found, TOE_OFF) == pytest.approx(times(plain, TOE_OFF), abs=0.03)
    assert detector.counts.rejected == 0


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_toe_offs_are_timed_in_slow_walking_and_after_standing(factor):
    """Strides of 4.4 s, or a foot that stands for five strides in mid-walk under varying load."""
    stands = OFFSET[Side.RIGHT] + 3 * STRIDE, OFFSET[Side.RIGHT] + 8 * STRIDE + STANCE

    def signal(time):
        time /= factor
        if factor == 1.0 and stands[0] + 0.2 < time < stands[1] - 0.2:
            return (400.0 + 150.0 * math.sin(time),)
        return (force(time),)

    detector, found = detected(signal)
    ends = [OFFSET[Side.RIGHT] + n * STRIDE + STANCE for n in range(11)]
    if factor == 1.0:
        ends = [end for end in ends if not stands[0] < end < stands[1] - 0.1]
    ends = [end * factor for end in ends if end * factor < UNTIL]
    assert times(found, TOE_OFF) == pytest.approx(ends, abs=0.03)
    assert detector._zero == pytest.approx(0.0, abs=5.0)


def test_standing_on_the_other_leg_is_not_mistaken_for_a_belt_that_is_not_zeroed():
    """The foot bears 120 N for three seconds and then walks."""
    stands = OFFSET[Side.RIGHT] + 2 * STRIDE + 0.3, OFFSET[Side.RIGHT] + 5 * STRIDE + 0.3

    def signal(time):
        standing = 120.0 + 5.0 * math.sin(9.0 * time)
        return (standing if stands[0] < time < stands[1] else force(time),)

    detector, found = detected(signal)
    assert abs(detector._zero) < 5.0
    assert detector.troubles() == ()
    strikes = [OFFSET[Side.RIGHT] + n * STRIDE for n in (7, 8, 9, 10)]
    assert times(found, STRIKE)[-4:] == pytest.approx(strikes, abs=0.02)


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        (lambda t: (force(t) + 300.0,), "never unloaded: zero it"),
        (lambda t: (-force(t),), "upwards positive"),
        (lambda t: (force(t) / 1e3,), "not in kN"),
        (lambda t: (30.0 * force(t),), "are impossible"),
        (lambda t: (min(force(t), 500.0),), "stuck in mid-movement"),
    ],
)
def test_implausible_signals_are_reported(signal, words):
    detector, _ = detected(signal)
    assert any(words in line for line in detector.troubles())


def test_thresholds_without_hysteresis_are_refused():
    with pytest.raises(SettingError, match="toe_off_force"):
        VerticalForceSettings(strike_force=20.0, toe_off_force=30.0)
