# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Emulated sensors: samples that do not depend on how a walk is cut, and each setting's effect."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import GaitEvent
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_sensors.emulated import KINDS, EmulatedSensor, EmulatedSettings

UNTIL = 6_000_000_000


def measured(kind, cuts=(), settings=None, seed=3, side=Side.RIGHT):
    walker, sensor, rows, events = Walker(WalkerParameters()), None, [], []
    sensor = EmulatedSensor(kind, side, settings, seed)
    for until in (*sorted(cuts), UNTIL):
        transitions = walker.advance(until)
        fresh = [GaitEvent(t.stamp, t.kind, t.side, t.step) for t in transitions]
        times = sensor.due(until)
        rows += sensor.measure(times, walker.sample(times), fresh)
        events += fresh
    return rows, events


@settings(max_examples=12, deadline=None)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    cuts=st.sets(st.integers(1, UNTIL - 1), max_size=5),
    jitter=st.sampled_from([0.0, 1e-3]),
)
def test_how_a_walk_is_cut_changes_no_bit(kind, cuts, jitter):
    usual = replace(KINDS[kind][1], jitter=jitter, dropouts=20.0)
    assert measured(kind, cuts, usual)[0] == measured(kind, (), usual)[0]


def test_samples_repeat_and_depend_on_seed_and_side():
    first, again = measured("insole_force")[0], measured("insole_force")[0]
    assert first == again
    assert measured("insole_force", seed=4)[0] != first
    assert measured("insole_force", side=Side.LEFT)[0] != first


def test_an_ideal_sensor_measures_the_walker():
    rows, _ = measured("treadmill_force", settings=EmulatedSettings(rate=1000.0))
    walker = Walker(WalkerParameters())
    walker.advance(UNTIL)
    times = np.array([round(t * 1e9) for t, _ in rows])
    exact = walker.sample(times).ground_reaction[:, Side.RIGHT, 1]
    assert [v for _, (v,) in rows] == exact.tolist()
    rows, _ = measured("ankle_encoder", settings=EmulatedSettings())
    times = np.array([round(t * 1e9) for t, _ in rows])
    assert [v for _, (v, _) in rows] == walker.sample(times).position[:, 2 + Side.RIGHT].tolist()


def test_noise_resolution_range_clock_and_dropouts_are_as_set():
    quiet = EmulatedSettings(rate=500.0)
    plain = np.array([v for _, (v,) in measured("treadmill_force", settings=quiet)[0]])
    disturbed = replace(quiet, noise=7.0, bias=3.0, drift=2.0)
    noisy = np.array([v for _, (v,) in measured("treadmill_force", settings=disturbed)[0]])
    times = np.arange(plain.size) / 500.0
    slope, offset = np.polyfit(times, noisy - plain, 1)
    assert slope == pytest.approx(2.0, abs=0.5)
    assert abs(offset) < 12.0
    assert np.std(noisy - plain - slope * times - offset) == pytest.approx(7.0, rel=0.05)
    clipped = [
        v
        for _, (v,) in measured(
            "treadmill_force", settings=replace(quiet, full_scale=400, resolution=8.0)
        )[0]
    ]
    assert max(clipped) == 400.0
    assert {v % 8.0 for v in clipped} == {0.0}
    rows, _ = measured(
        "treadmill_force", settings=replace(quiet, clock_offset=0.5, clock_drift=1e-3)
    )
    assert rows[1000][0] == pytest.approx(0.5 + 2.0 * 1.001)
    rows, _ = measured("treadmill_force", settings=replace(quiet, dropouts=30.0, dropout_time=0.2))
    gaps = np.diff([t for t, _ in rows])
    assert max(gaps) == pytest.approx(0.2, abs=0.005)


def test_a_foot_slaps_after_its_strike_and_is_released_at_toe_off():
    rows, events = measured("foot_gyroscope", settings=EmulatedSettings(rate=1000.0))
    rates = np.array([v[1] for _, v in rows])
    strikes = [e.stamp for e in events if (e.kind, e.side) == (EventKind.HEEL_STRIKE, Side.RIGHT)]
    for strike in strikes[1:-1]:
        after = rates[strike // 1_000_000 + 1 : strike // 1_000_000 + 101]
        assert np.sum(after) * 1e-3 == pytest.approx(0.25, abs=0.01)
    toe_offs = [e.stamp for e in events if (e.kind, e.side) == (EventKind.TOE_OFF, Side.RIGHT)]
    for toe_off in toe_offs:
        n = toe_off // 1_000_000
        assert rates[n] > 5.0
        assert rates[n + 60] < 0.2


def test_the_knee_leans_the_shank_forward_until_toe_off():
    plain = EmulatedSettings(rate=1000.0)
    bent, stiff = (
        np.array([v[1] for _, v in measured("shank_gyroscope", settings=each)[0]])
        for each in (plain, replace(plain, knee_angle=0.0))
    )
    _, events = measured("shank_gyroscope", settings=plain)
    knee = 2.0 * (bent - stiff)
    strikes = [e.stamp for e in events if (e.kind, e.side) == (EventKind.HEEL_STRIKE, Side.LEFT)]
    toe_offs = [e.stamp for e in events if (e.kind, e.side) == (EventKind.TOE_OFF, Side.RIGHT)]
    for strike, toe_off in zip(strikes, toe_offs[-len(strikes) :], strict=True):
        n, m = strike // 1_000_000, toe_off // 1_000_000
        # 35 degrees in push-off, 20 more afterwards; the shank turns by half of each.
        assert np.sum(knee[n + 1 : m + 1]) * 1e-3 == pytest.approx(0.6, abs=0.05)
        assert np.sum(knee[m + 1 : m + 500]) * 1e-3 == pytest.approx(0.35, abs=0.05)
        assert not np.any(knee[n - 300 : n])
        # Toe-off ends the plateau, and the swing follows soon after.
        assert min(bent[n + 1 : m]) > 0.0
        assert bent[m + 70] < 0.0


def test_switches_follow_the_feet():
    rows, events = measured("foot_switch", settings=EmulatedSettings(rate=1000.0, bounce=0.0))
    for time, (heel, toe) in rows:
        passed = [e for e in events if e.stamp <= round(time * 1e9)]
        swinging = [e for e in passed if e.side is Side.RIGHT][-1].kind is EventKind.TOE_OFF
        assert (heel or toe) != swinging
