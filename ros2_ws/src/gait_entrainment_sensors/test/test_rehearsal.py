# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The whole chain: walker, emulated sensors, detectors, numbering, conductor, robot, walker."""

import statistics
from dataclasses import replace

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import Verdict
from gait_entrainment.parameters import Variation
from gait_entrainment.protocol import Protocol
from gait_entrainment_sensors.detection import find_detector
from gait_entrainment_sensors.emulated import find_sensor
from gait_entrainment_sensors.rehearsal import Sensors, rehearse
from gait_entrainment_sensors.scoring import score

CHAINS = [
    ("treadmill_force", "vertical_force"),
    ("insole_force", "vertical_force"),
    ("foot_switch", "foot_switch"),
    ("foot_gyroscope", "foot_gyroscope"),
    ("shank_gyroscope", "shank_gyroscope"),
]


def errors(rehearsal, kind):
    def times(events, side):
        return [e.stamp / 1e9 for e in events if (e.kind, e.side) == (kind, side)]

    return score((times(rehearsal.truth, s), times(rehearsal.events, s)) for s in Side)


@pytest.mark.parametrize(("kind", "detector"), CHAINS)
def test_the_gait_also_entrains_through_sensors(kind, detector):
    protocol = replace(Protocol(), variation=Variation(0.0))
    rehearsal = rehearse(protocol, Sensors(kind, find_detector(detector), protocol.side, seed=5))
    assert rehearsal.analysis.entrainments[-1].verdict is Verdict.ENTRAINED
    assert rehearsal.true_analysis.entrainments[-1].verdict is Verdict.ENTRAINED
    strikes, toe_offs = (errors(rehearsal, k) for k in EventKind)
    assert statistics.median(map(abs, strikes.errors)) < 5e-3
    assert (strikes.false, toe_offs.false) == (0, 0)
    # A gyroscope needs about three strides before its axis is found.
    assert strikes.missed <= 8
    # The lag is that of the exact events, shifted by the delay of the toe-offs.
    lags = [a.pulses[-1].phase_lag for a in (rehearsal.analysis, rehearsal.true_analysis)]
    assert lags[0] - lags[1] == pytest.approx(-toe_offs.bias, abs=4 * toe_offs.deviation + 2e-3)


def test_step_numbers_agree_with_the_walker():
    protocol = replace(Protocol(), variation=Variation(0.02), seed=1)
    sensors = Sensors("foot_switch", find_detector("foot_switch"), protocol.side, seed=1)
    rehearsal = rehearse(protocol, sensors)
    number = {(e.kind, e.side, e.step): e.stamp for e in rehearsal.truth}
    for event in rehearsal.events:
        exact = number[event.kind, event.side, event.step]
        assert event.stamp == pytest.approx(exact, abs=20_000_000)
    assert rehearsal.train is not None
    planned = set(rehearsal.train.onsets)
    assert set(rehearsal.onsets) <= planned


def test_without_toe_offs_the_verdict_rests_on_heel_strikes():
    protocol = replace(Protocol(), variation=Variation(0.0))
    kind, stiff = find_sensor("shank_gyroscope:knee_angle=0")
    chain = Sensors(kind, find_detector(kind), protocol.side, stiff, seed=5)
    rehearsal = rehearse(protocol, chain)
    assert EventKind.TOE_OFF not in {event.kind for event in rehearsal.events}
    assert rehearsal.analysis.entrainments[-1].verdict is Verdict.ENTRAINED
    last = rehearsal.analysis.pulses[-1]
    strikes = [stride.end for stride in rehearsal.true_analysis.strides]
    lags = [(last.onset - strike) / 1e9 for strike in strikes]
    # With a stiff knee heel strikes are 23 ms late (docs/sensors.md).
    assert last.phase_lag == pytest.approx(min(lags, key=abs), abs=0.03)
    assert last.toe_off is None
