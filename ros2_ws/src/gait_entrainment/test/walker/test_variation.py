# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A walker that varies: as much as requested, the same however it is driven, and seeded."""

from dataclasses import replace

import numpy as np
import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.protocol import DEFAULT_PROTOCOL
from gait_entrainment.simulation import simulate
from gait_entrainment.walker import EndingKind, Walker

BODY = WalkerParameters()
OTHER = WalkerParameters(leg_length=0.92, foot_length=0.184, mass=70, ankle_stiffness=70.3)
SECOND = 10**9


def strides_of(walker, until):
    strikes = [
        event.stamp / 1e9
        for event in walker.advance(until)
        if event.kind is EventKind.HEEL_STRIKE and event.side is Side.RIGHT
    ]
    return np.diff(strikes)


@pytest.mark.parametrize(
    ("body", "requested", "exponent"), [(BODY, 0.02, 0.5), (BODY, 0.01, 0.75), (OTHER, 0.03, 0.6)]
)
def test_strides_vary_as_much_as_requested(body, requested, exponent):
    walker = Walker(body, variation=Variation(requested, exponent), seed=2)
    periods = strides_of(walker, 2400 * SECOND)
    assert periods.size > 1200
    # A record of n strides has less variance than the process, by a share of n^(2H - 2).
    expected = requested * np.sqrt(1 - periods.size ** (2 * exponent - 2))
    # From 1200 strides the figure is known to 1 / sqrt(2 n), or 2 %; less well if long-range.
    assert periods.std() / periods.mean() == pytest.approx(expected, rel=0.08)


def test_neighbouring_strides_correlate_with_the_exponent():
    def correlation(exponent):
        walker = Walker(BODY, variation=Variation(0.01, exponent), seed=5)
        periods = strides_of(walker, 2000 * SECOND)[5:]
        return np.corrcoef(periods[:-4], periods[4:])[0, 1]

    white, long_range = correlation(0.5), correlation(0.9)
    assert abs(white) < 0.15
    assert long_range > 0.3


def test_cuts_change_neither_events_nor_samples():
    uncut, cut = (Walker(BODY, variation=Variation(0.05), seed=1) for _ in range(2))
    events = uncut.advance(9 * SECOND)
    times = np.arange(0, 9 * SECOND, SECOND // 40)
    samples = uncut.sample(times)
    found, torques = [], []
    for end in (1, 1_234_567_890, 1_234_567_891, 5 * SECOND, 9 * SECOND):
        begin = cut.time_reached
        found += cut.advance(end)
        inside = times[(times >= begin) & (times < end)]
        torques.append(cut.sample(inside).intrinsic_torque)
    assert found == events
    assert np.array_equal(np.concatenate(torques), samples.intrinsic_torque)


def test_each_push_off_has_its_own_stiffness():
    walker = Walker(BODY, variation=Variation(0.05), seed=1)
    events = walker.advance(12 * SECOND)
    strikes = [event for event in events if event.kind is EventKind.HEEL_STRIKE][:-1]
    stiffness = []
    for strike in strikes:
        samples = walker.sample(np.array([strike.stamp + SECOND // 10]))
        trailing = strike.side.other
        turn = BODY.max_plantarflexion - np.pi / 2 - samples.position[0, 2 + trailing]
        stiffness.append(samples.intrinsic_torque[0, trailing] / turn)
    assert len(set(np.round(stiffness, 6))) == len(strikes)
    assert np.mean(stiffness) == pytest.approx(BODY.ankle_stiffness, rel=0.2)


def test_seeds_differ_and_no_variation_gives_the_papers_gait():
    protocol = replace(
        DEFAULT_PROTOCOL, baseline=4, pulses=replace(DEFAULT_PROTOCOL.pulses, count=3)
    )
    paper = simulate(protocol).events
    assert simulate(replace(protocol, variation=Variation(0.0, 0.9), seed=3)).events == paper
    varied = replace(protocol, variation=Variation(0.02))
    first, again, other = (simulate(replace(varied, seed=seed)).events for seed in (1, 1, 2))
    assert first == again != other


def test_a_walker_that_varies_too_much_falls_and_reports_it():
    walker = Walker(BODY, variation=Variation(0.2, 0.5))
    walker.advance(600 * SECOND)
    assert walker.ending is not None
    assert walker.ending.kind in (EndingKind.FALL, EndingKind.FLY_OFF)
    assert walker.ending.message
