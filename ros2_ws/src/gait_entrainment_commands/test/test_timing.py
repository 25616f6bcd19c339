# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Measured onsets, checked against flanks with a crossing in closed form."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Verdict
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import (
    PulseTiming,
    PulseTrain,
    RobotState,
    find_driver,
)
from gait_entrainment.simulation import simulate
from gait_entrainment_commands.timing import MeasuredOnsets, measured_onset, quantile, timings_of

MS = 1_000_000


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    onset=st.floats(20.0, 60.0),
    rise=st.floats(2.0, 40.0),
    height=st.sampled_from([12.0, -3.0]),
    step=st.floats(0.3, 9.0),
    fraction=st.floats(0.05, 0.95),
)
def test_a_linear_flank_is_crossed_exactly_between_samples(onset, rise, height, step, fraction):
    times = [k * step for k in range(1, int(150 / step))]  # [ms]
    torques = [height * min(max((t - onset) / rise, 0.0), 1.0) for t in times]
    index, found = measured_onset([round(t * MS) for t in times], torques, height, fraction)
    assert times[index] * MS >= found - 1
    crossing = onset + fraction * rise
    # Interpolation is exact on the flank itself; otherwise the result lies within its sample.
    earlier = max(t for t in times if t < crossing)
    if earlier >= onset and earlier + step <= onset + rise:
        assert found == pytest.approx(crossing * MS, abs=3)
    else:
        assert earlier * MS - 1 <= found <= (earlier + step) * MS + 1


def test_a_torque_that_never_rises_or_was_never_low_has_no_onset():
    assert measured_onset([0, MS, 2 * MS], [0.0, 4.9, 4.0], 10.0) is None
    assert measured_onset([0, MS], [9.0, 10.0], 10.0) is None
    assert measured_onset([0, MS], [math.nan, math.nan], 10.0) is None
    assert measured_onset([], [], 10.0) is None


def test_a_torque_that_is_known_only_at_its_jumps_is_not_interpolated():
    assert measured_onset([0, 500 * MS], [0.0, 10.0], 10.0) == (1, 500 * MS)


def test_the_audit_of_an_emulated_robot_finds_its_delay_and_lag():
    options = "bandwidth=10,delay=0.007,jitter=0,noise=0,loss=0,torque_rate=1e6,state_rate=1000"
    robot = find_driver(f"emulated:{options}").make(Side.LEFT)
    robot.configure()
    robot.activate()
    robot.begin(0)
    robot.schedule(PulseTrain.periodic(Side.LEFT, 500 * MS, 1.0, 3, 10.0, 0.2))
    onsets = MeasuredOnsets()
    for until in range(100 * MS, 4000 * MS, 130 * MS):
        promised = robot.promise(until).onsets
        onsets.add_promise(promised, until)
        for onset in promised:
            onsets.add_pulse(onset, 10.0, 0.2)
        for state in robot.read():
            onsets.add_state(state)
    onsets.finish()
    timings = onsets.timings
    assert [t.commanded for t in timings] == [500 * MS, 1500 * MS, 2500 * MS]
    # Sent after the delay; half the height is reached ln 2 time constants later.
    half = 7 + 1e3 * math.log(2) / (2 * math.pi * 10)
    for timing in timings:
        assert timing.sent - timing.commanded == 7 * MS
        assert (timing.measured - timing.commanded) / MS == pytest.approx(half - 1, abs=0.2)


def test_a_pulse_that_never_came_is_reported_as_missing():
    onsets = MeasuredOnsets()
    onsets.add_promise([100 * MS], 1000 * MS)
    onsets.add_pulse(100 * MS, 5.0, 0.1)
    for t in range(0, 1000, 5):
        onsets.add_state(RobotState(t * MS, 0.0, 0.0, math.nan))
    assert onsets.timings == [PulseTiming(100 * MS, None, None, 5.0, 0.1)]


@pytest.mark.parametrize(("share", "value"), [(0.5, 2), (0.51, 3), (1.0, 4), (0.0, 1)])
def test_quantile_is_the_nearest_rank(share, value):
    assert quantile([1, 2, 3, 4], share) == value


@pytest.fixture(scope="module")
def default():
    return simulate(Protocol(), timings_of=timings_of)


def test_a_device_of_realistic_bandwidth_still_entrains(default):
    """Its pulses come later, so the gait locks to pulses commanded earlier by the same time."""
    emulated = simulate(Protocol(driver="emulated"), timings_of=timings_of)
    assert emulated.analysis.entrainments[-1].verdict is Verdict.ENTRAINED
    late = [(t.measured - t.commanded) / 1e9 for t in emulated.timings]
    assert len(late) == 50
    assert min(late) > 0.005
    assert max(late) < 0.020
    lag, ideal = (s.analysis.pulses[-1].phase_lag for s in (emulated, default))
    assert lag < ideal - 0.005
    # With onsets from the measured torque, the lag is nearer to the ideal robot's.
    seen = simulate(Protocol(driver="emulated"), timings_of=timings_of, measured_onsets=True)
    assert seen.events == emulated.events
    assert abs(seen.analysis.pulses[-1].phase_lag - ideal) < abs(lag - ideal) / 2


def test_the_ideal_robot_is_on_time_to_the_nanosecond(default):
    assert [(t.sent, t.measured) for t in default.timings] == [
        (t.commanded, t.commanded) for t in default.timings
    ]
    assert tuple(t.commanded for t in default.timings) == default.onsets
