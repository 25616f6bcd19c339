# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Foot switch, shank gyroscope and ankle encoder: signals in closed form."""

import math
from itertools import pairwise

import pytest
from walks import OFFSET, STANCE, STRIDE, fed, sampled, times

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import SettingError
from gait_entrainment_sensors.ankle_encoder import AnkleEncoderDetector
from gait_entrainment_sensors.foot_switch import FootSwitchDetector, FootSwitchSettings
from gait_entrainment_sensors.shank_gyroscope import ShankGyroscopeDetector

STRIKE, TOE_OFF = EventKind
UNTIL = 12.0


def phase_of(time):
    return (time - OFFSET[Side.RIGHT]) % STRIDE


def contacts(time):
    phase = phase_of(time)
    return float(phase < 0.6 * STANCE), float(0.15 < phase < STANCE)


def test_contacts_are_timed_to_within_half_a_sample():
    detector = FootSwitchDetector(Side.RIGHT)
    found = fed(detector, sampled(contacts, UNTIL, 200.0))
    for kind, late in ((STRIKE, 0.0), (TOE_OFF, STANCE)):
        assert len(times(found, kind)) >= 10
        for time in times(found, kind):
            off = (time - OFFSET[Side.RIGHT] - late + STRIDE / 2) % STRIDE - STRIDE / 2
            assert abs(off) <= 0.0026
    assert all(d.detected_at - d.time <= detector.latency + 0.005 for d in found)


def test_a_contact_that_bounces_counts_once():
    def bouncing(time):
        phase = phase_of(time)
        bounces = (phase < 0.01 or 0 < phase - STANCE < 0.01) and int(time * 1000) % 4 < 2
        heel, toe = contacts(time)
        return (1.0 - heel, toe) if bounces else (heel, toe)

    found = fed(FootSwitchDetector(Side.RIGHT), sampled(bouncing, UNTIL, 1000.0))
    assert abs(len(times(found, STRIKE)) - len(times(found, TOE_OFF))) <= 1
    assert len(times(found, STRIKE)) in (10, 11)


def test_a_contact_that_stays_closed_in_the_shoe_is_reported():
    detector = FootSwitchDetector(Side.RIGHT)
    assert fed(detector, sampled(lambda _: (1.0, 1.0), UNTIL)) == []
    assert any("did not change" in line for line in detector.troubles())


def test_volts_are_reported_and_thresholds_without_hysteresis_refused():
    detector = FootSwitchDetector(Side.RIGHT)
    fed(detector, sampled(lambda t: tuple(5.0 * c for c in contacts(t)), UNTIL))
    assert any("not volts" in line for line in detector.troubles())
    with pytest.raises(SettingError, match="open_below"):
        FootSwitchSettings(closed_above=0.3)


def shank_rate(time):
    """Return a rate [rad/s]: forward lean in stance, peaks at toe-off and strike, a swing back."""
    phase = phase_of(time)
    if time < OFFSET[Side.RIGHT]:
        return 0.0
    strike = 2.5 * math.exp(-((min(phase, STRIDE - phase) / 0.015) ** 2))
    push = 3.0 * math.exp(-(((phase - STANCE) / 0.05) ** 2))
    stance = 1.0 if phase < STANCE else 0.0
    swing = -6.0 * math.sin(math.pi * (phase - STANCE) / (STRIDE - STANCE))
    return stance + push + (swing if phase > STANCE else 0.0) + strike


def test_peaks_of_the_shank_rate_are_events():
    settings = ShankGyroscopeDetector.Settings(axis_y=1.0)
    detector = ShankGyroscopeDetector(Side.RIGHT, settings)
    found = fed(detector, sampled(lambda t: (0.0, shank_rate(t), 0.0), UNTIL))
    for kind, late in ((STRIKE, 0.0), (TOE_OFF, STANCE)):
        assert len(times(found, kind)) >= 9
        for time in times(found, kind):
            off = (time - OFFSET[Side.RIGHT] - late + STRIDE / 2) % STRIDE - STRIDE / 2
            assert abs(off) < 0.02
    assert all(d.detected_at - d.time <= detector.latency + 0.005 for d in found)


def test_toe_off_ends_the_push_off_plateau_and_a_jump_is_a_strike():
    def plateau(time):
        phase = phase_of(time)
        if time < OFFSET[Side.RIGHT] or phase < STANCE - 0.16:
            return (0.0, 1.2 if time > OFFSET[Side.RIGHT] else 0.0, 0.0)
        if phase < STANCE:  # the peak comes well before the end
            return (0.0, 3.0 - 2.0 * (phase - STANCE + 0.16), 0.0)
        return (0.0, -6.0 * math.sin(math.pi * (phase - STANCE) / (STRIDE - STANCE)) - 0.3, 0.0)

    detector = ShankGyroscopeDetector(
        Side.RIGHT, ShankGyroscopeDetector.Settings(axis_y=1.0, decision=0.05)
    )
    found = fed(detector, sampled(plateau, UNTIL))
    for kind, late in ((STRIKE, 0.0), (TOE_OFF, STANCE)):
        assert len(times(found, kind)) >= 9
        for time in times(found, kind):
            off = (time - OFFSET[Side.RIGHT] - late + STRIDE / 2) % STRIDE - STRIDE / 2
            assert abs(off) < 0.008


@pytest.mark.parametrize("sign", [1, -1])
def test_the_mounting_on_the_shank_is_found(sign):
    detector = ShankGyroscopeDetector(Side.RIGHT)
    found = fed(detector, sampled(lambda t: (0.0, 0.0, sign * shank_rate(t)), UNTIL))
    assert detector._axis == (0.0, 0.0, sign)
    assert len(times(found, STRIKE)) >= 5


def ankle(time, amplitude=0.3):
    return amplitude * math.cos(2 * math.pi * (time - OFFSET[Side.RIGHT]) / STRIDE)


def test_the_encoder_follows_the_period_and_is_reported_as_a_fallback():
    detector = AnkleEncoderDetector(Side.RIGHT)
    found = fed(detector, sampled(lambda t: (ankle(t), 0.0), UNTIL))
    strikes = times(found, STRIKE)
    assert len(strikes) >= 8
    for a, b in pairwise(strikes):
        assert b - a == pytest.approx(STRIDE, abs=0.011)
    assert times(found, TOE_OFF) == []
    assert any("a fallback" in line for line in detector.troubles())


def test_the_encoder_is_ignored_while_torque_moves_the_ankle():
    def pulsed(time):
        pushed = 0.3 < phase_of(time) < 0.4
        return ankle(time) + (0.5 if pushed else 0.0), 10.0 if pushed else 0.0

    plain = fed(AnkleEncoderDetector(Side.RIGHT), sampled(lambda t: (ankle(t), 0.0), UNTIL))
    found = fed(AnkleEncoderDetector(Side.RIGHT), sampled(pulsed, UNTIL))
    assert times(found, STRIKE) == times(plain, STRIKE)


def test_an_angle_in_degrees_is_reported():
    detector = AnkleEncoderDetector(Side.RIGHT)
    fed(detector, sampled(lambda t: (math.degrees(ankle(t)), 0.0), UNTIL))
    assert any("in degrees?" in line for line in detector.troubles())


@pytest.mark.parametrize("sign", [1, -1])
def test_an_encoder_with_the_wrong_sign_is_reported(sign):
    def pushed_off(time):
        place = phase_of(time) / STRIDE
        return sign * min(place / 0.2, (1 - place) / 0.8) * 0.3, 0.0

    detector = AnkleEncoderDetector(Side.RIGHT)
    fed(detector, sampled(pushed_off, UNTIL))
    reported = any("plantarflexion must be positive" in line for line in detector.troubles())
    assert reported == (sign < 0)
