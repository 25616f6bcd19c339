# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The experiment in one process: the paper's example entrains, and so does its mirror image."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment import experiment
from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import Verdict, analyze
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import Protocol, PulsePlan
from gait_entrainment.robot import LimitError
from gait_entrainment.simulation import simulate
from gait_entrainment.walker import Walker


@pytest.fixture(scope="module")
def default():
    return simulate(Protocol())


def test_the_papers_example_entrains_at_the_end_of_double_stance(default):
    last = default.analysis.entrainments[-1]
    assert last.verdict is Verdict.ENTRAINED
    assert default.ending is None
    strides = [s for s in default.analysis.strides if s.number <= 80]
    assert len(strides) == 80
    assert default.pulse_period == default.measured_period - 0.05
    # Locked: the stride period equals the pulse period, up to rounding to nanoseconds.
    locked = [s.period for s in strides if 55 <= s.number <= 64]
    assert locked == pytest.approx([default.pulse_period] * len(locked), abs=2e-9)
    # The pulse meets toe-off: it begins before, and would end after it.
    for pulse in default.analysis.pulses[-10:]:
        assert -0.1 < pulse.phase_lag < 0
    # Washout: back to the unperturbed period, and the verdict stands.
    assert strides[-1].period == pytest.approx(default.measured_period, abs=1e-6)


@pytest.mark.parametrize("irregular", [{"jitter": 0.8}, {"sweep": -0.9}])
def test_pulses_planned_irregularly_are_one_train_without_holes(irregular):
    plan = PulsePlan(count=40, period_offset=0.0, **irregular)
    run = simulate(Protocol(pulses=plan))
    assert [pulse.number for pulse in run.analysis.pulses] == list(range(1, 41))
    assert {e.stretch for e in run.analysis.entrainments} == {1}
    assert run.analysis.holes == ()
    alone = analyze(run.events, run.onsets, Side.RIGHT)  # without the plan
    assert alone.entrainments[-1].stretch > 1


def test_the_stride_count_does_not_depend_on_the_pulse_period():
    for offset in (-0.2, 0.1):
        protocol = Protocol(
            baseline=3, washout=4, pulses=PulsePlan(count=20, period_offset=offset)
        )
        strides = simulate(protocol).analysis.strides
        assert max(s.number for s in strides) >= 27
        closing = [s.end for s in strides if s.number == 27]
        assert len(closing) == 1


def test_the_other_leg_gives_the_mirror_image(default):
    mirrored = simulate(Protocol(side=Side.LEFT))
    assert [(e.stamp, e.kind, e.side.other, e.step) for e in mirrored.events] == [
        (e.stamp, e.kind, e.side, e.step) for e in default.events
    ]


def test_events_alternate_and_are_numbered(default):
    places = [e.place for e in default.events]
    assert places == list(range(len(places)))
    assert default.events[0].stamp == 0
    assert default.events[0].kind is EventKind.HEEL_STRIKE


@settings(derandomize=True, deadline=None, max_examples=8)
@given(
    phase=st.floats(0, 1, exclude_max=True),
    offset=st.floats(-0.07, -0.02),
    part=st.integers(1, 10),
)
def test_a_run_equals_one_uncut_walk_under_the_same_torque(phase, offset, part):
    """Cutting into grants and requests changes nothing: one uncut walk gives the same stamps."""
    import numpy as np

    protocol = Protocol(
        baseline=3,
        washout=2,
        pulses=PulsePlan(count=10, period_offset=offset, initial_phase=phase),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "PART_PULSES", part)
        cut = simulate(protocol)
    end = cut.events[-1].stamp
    train = cut.train
    times, torques = [0], [0.0]
    for pulse in train.pulses:
        times += [pulse.onset, pulse.end]
        torques += [pulse.torque, 0.0]
    walker = Walker(protocol.walker, protocol.side)
    walker.extend_torque(
        protocol.side, np.array(times), np.array(torques), max(end, times[-1]) + 1
    )
    uncut = walker.advance(end)
    assert [(t.stamp, t.kind, t.side, t.step) for t in uncut] == [
        (e.stamp, e.kind, e.side, e.step) for e in cut.events
    ]


def test_torque_beyond_the_limits_is_refused_before_anything_moves():
    with pytest.raises(LimitError, match=r"torque: 45 N m.*-30 to 30"):
        simulate(Protocol(pulses=PulsePlan(torque=45.0, torque_fraction=None)))


def test_a_walk_that_ends_by_itself_is_reported():
    """A strong dorsiflexion pulse in early double stance takes the energy to vault over."""
    protocol = Protocol(
        baseline=2,
        washout=2,
        pulses=PulsePlan(
            count=20, width=0.4, torque=-29.0, torque_fraction=None, initial_phase=0.5
        ),
    )
    simulation = simulate(protocol)
    assert simulation.ending is not None
    assert simulation.ending.missing > 0
    assert len(simulation.analysis.strides) < protocol.strides


def test_the_same_seed_gives_the_same_walk_and_another_does_not():
    runs = [
        simulate(Protocol(driver="emulated", seed=seed, pulses=PulsePlan(count=30)))
        for seed in (7, 7, 8)
    ]
    assert runs[0].events == runs[1].events
    assert runs[0].events != runs[2].events


def test_a_real_device_cannot_be_simulated():
    with pytest.raises(LimitError, match="real time only"):
        simulate(Protocol(driver="ak_mit_can"))


@pytest.mark.parametrize("leg_length", [0.8, 0.92, 1.0, 1.1])
def test_first_pulse_lies_in_the_stride_after_the_baseline(leg_length):
    walker = WalkerParameters(leg_length=leg_length, foot_length=0.2 * leg_length)
    protocol = Protocol(baseline=4, washout=1, pulses=PulsePlan(count=2), walker=walker)
    first = simulate(protocol).analysis.pulses[0]
    assert first.stride == 5
    assert first.phase < 1e-8
