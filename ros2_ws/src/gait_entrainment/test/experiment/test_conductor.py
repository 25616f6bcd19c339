# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The conductor: its plan, and the promises that must never cover an unplanned onset."""

import bisect
import itertools
import math
import statistics
from fractions import Fraction

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gait_entrainment import experiment
from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.experiment import Conductor, GaitError, Part
from gait_entrainment.gait import GaitEvent, GaitLimits
from gait_entrainment.protocol import Block, Protocol, ProtocolError, PulsePlan

# For gaits of any kind, however implausible.
ANY_GAIT = GaitLimits(
    stride_least=1e-6, stride_most=1e6, stride_change=1.0, silence=10.0, baseline_spread=1.0
)

# For a person who does not walk evenly.
UNSTEADY = GaitLimits(baseline_spread=1.0)


def walk(strides, toe_off=0.36):
    """Gait events of strides of the given periods [s]; the right leg strikes first, at 0."""
    events, strike = [GaitEvent(0, EventKind.HEEL_STRIKE, Side.RIGHT, 0)], 0
    for number, period in enumerate(strides):
        middle, end = strike + round(period * 5e8), strike + round(period * 1e9)
        for step, begin, side, close in (
            (2 * number + 1, strike, Side.LEFT, middle),
            (2 * number + 2, middle, Side.RIGHT, end),
        ):
            off = begin + round(toe_off * (close - begin))
            events.append(GaitEvent(off, EventKind.TOE_OFF, side, step))
            events.append(GaitEvent(close, EventKind.HEEL_STRIKE, side, step))
        strike = end
    return events


def conduct(conductor, events):
    """Drive a conductor as a walker would, never past a promise; return horizons and trains."""
    reached, rest, horizons, trains = 0, list(events), [], []
    while True:
        horizon = conductor.horizon(reached)
        assert horizon.until > reached, "lock-step would stand still"
        horizons.append(horizon)
        if horizon.last or not rest:
            return horizons, trains
        reached = horizon.until
        while rest and rest[0].stamp <= reached:
            conductor.add_event(rest.pop(0))
        while train := conductor.due(reached):
            trains.append(train)
            assert train.onsets[0] >= reached, "an onset within what was promised"


@settings(derandomize=True, deadline=None, max_examples=150)
@given(
    baseline=st.integers(2, 6),
    periods=st.lists(st.floats(0.9, 1.6), min_size=14, max_size=14),
    phase=st.floats(0, 1, exclude_max=True),
    longest=st.sampled_from([0.1, 0.3, math.inf]),
)
def test_no_promise_covers_an_onset_that_is_not_planned(baseline, periods, phase, longest):
    protocol = Protocol(
        baseline=baseline, washout=2, pulses=PulsePlan(count=3, initial_phase=phase)
    )
    conductor = Conductor(protocol, longest, ANY_GAIT)
    events = walk(periods)
    conduct(conductor, events)
    measured = statistics.fmean(round(p * 1e9) / 1e9 for p in periods[: baseline - 1])
    strikes = [e.stamp for e in events if e.kind is EventKind.HEEL_STRIKE and e.side is Side.RIGHT]
    train = conductor.block.train
    assert conductor.block.measured_period == pytest.approx(measured, abs=2e-9)
    # The definition, from the strike that starts the last baseline stride, in exact arithmetic:
    # at most a nanosecond late, plus a rounding error.
    mean = Fraction(strikes[baseline - 1] - strikes[0], baseline - 1)
    late = train.onsets[0] - strikes[baseline - 1] - (1 + Fraction(phase)) * mean
    assert 0 < late < 1.01
    assert conductor.block.pulse_period == conductor.block.measured_period - 0.05


@settings(derandomize=True, deadline=None, max_examples=50)
@given(
    periods=st.lists(st.floats(1.0, 1.4), min_size=9, max_size=9),
    longest=st.sampled_from([0.05, 0.21, 0.7]),
)
def test_the_end_comes_after_every_promise_and_after_the_last_stride(periods, longest):
    protocol = Protocol(baseline=2, washout=2, pulses=PulsePlan(count=3))
    conductor = Conductor(protocol, longest, ANY_GAIT)
    events = walk(periods)
    horizons, _ = conduct(conductor, events)
    strikes = [e.stamp for e in events if e.kind is EventKind.HEEL_STRIKE and e.side is Side.RIGHT]
    assert horizons[-1].last
    assert horizons[-1].until > strikes[protocol.strides]
    assert [h.until for h in horizons] == sorted(h.until for h in horizons)
    assert conductor.strides >= protocol.strides


@settings(derandomize=True, deadline=None, max_examples=200)
@given(baseline=st.integers(2, 30), period=st.floats(0.9, 1.6), start=st.floats(0, 1))
@example(baseline=2, period=1.012214016417482, start=0.0)
def test_first_pulse_of_a_constant_gait_is_never_before_the_stride_after_the_baseline(
    baseline, period, start
):
    conductor = Conductor(Protocol(baseline=baseline, pulses=PulsePlan(count=1)), limits=ANY_GAIT)
    strikes = [round((start + k * period) * 1e9) for k in range(baseline + 1)]
    for k, stamp in enumerate(strikes):
        conductor.add_event(GaitEvent(stamp, EventKind.HEEL_STRIKE, Side.RIGHT, 2 * k))
    assert 0 <= conductor.block.first_onset - strikes[baseline] <= 2


def test_an_absolute_period_needs_no_measurement():
    protocol = Protocol(
        baseline=1,
        washout=0,
        pulses=PulsePlan(count=2, period=1.5, period_offset=None, initial_phase=0.25),
    )
    conductor = Conductor(protocol)
    conduct(conductor, walk([1.4] * 4))
    assert conductor.block.train.onsets[0] == round(1.25 * 1.5e9)
    assert conductor.block.pulse_period == 1.5


def test_parts_follow_the_plan():
    protocol = Protocol(baseline=2, washout=1, pulses=PulsePlan(count=2))
    conductor = Conductor(protocol)
    events = walk([1.2] * 6)
    assert conductor.part(0) is Part.BASELINE
    for event in events[:9]:
        conductor.add_event(event)
    train = conductor.due(events[8].stamp)
    assert train is conductor.block.train
    assert conductor.due(events[8].stamp) is None
    assert conductor.part(train.onsets[0] - 1) is Part.BASELINE
    assert conductor.part(train.onsets[0]) is Part.PULSES
    assert conductor.part(train.end) is Part.WASHOUT
    for event in events[9:]:
        conductor.add_event(event)
    assert conductor.part(train.end) is Part.FINISHED


def test_a_baseline_without_a_complete_stride_is_reported():
    conductor = Conductor(Protocol(baseline=2, pulses=PulsePlan(count=2)))
    events = walk([1.2] * 4)
    # The strikes of stride 2 and 3 are missing: the baseline is over before any stride ends.
    conductor.add_event(events[0])
    third = [e for e in events if e.kind is EventKind.HEEL_STRIKE and e.step == 6]
    with pytest.raises(ProtocolError, match="no complete stride"):
        conductor.add_event(*third)


def strikes_of(events, side=Side.RIGHT):
    return [e.stamp for e in events if e.kind is EventKind.HEEL_STRIKE and e.side is side]


def by_phase(phase, **more):
    return PulsePlan(period_offset=None, phase=phase, **more)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    baseline=st.integers(3, 7),
    periods=st.lists(st.floats(0.95, 1.45), min_size=18, max_size=18),
    phase=st.floats(0, 0.06) | st.floats(0, 1, exclude_max=True),
    longest=st.sampled_from([0.1, 0.3, math.inf]),
)
def test_a_pulse_by_phase_lies_where_the_mean_of_five_strides_predicts(
    baseline, periods, phase, longest
):
    protocol = Protocol(baseline=baseline, washout=1, pulses=by_phase(phase, count=6))
    conductor = Conductor(protocol, longest, UNSTEADY)
    events = walk(periods)
    horizons, trains = conduct(conductor, events)
    assert horizons[-1].last
    strikes = strikes_of(events)
    walked = [(b - a) / 1e9 for a, b in itertools.pairwise(strikes)]
    # A pulse too soon after its own strike is planned at the strike before.
    early = phase < 0.05
    expected = [
        strikes[n] + round((early + phase) * statistics.fmean(walked[max(n - 5, 0) : n]) * 1e9)
        for n in range(baseline - early, baseline - early + 6)
    ]
    # Two may be requested together.
    assert [onset for train in trains for onset in train.onsets] == expected
    assert conductor.block.train.onsets == tuple(expected)
    assert conductor.block.end == strikes[baseline + 6 + 1]


BLOCKS = (
    Block("first", baseline=4, washout=2, pulses=PulsePlan(count=3), rest=5.0),
    Block("none", baseline=2, washout=1, pulses=PulsePlan(count=0)),
    Block("third", baseline=3, washout=0, pulses=by_phase(0.5, count=2)),
)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    periods=st.lists(st.floats(0.95, 1.45), min_size=32, max_size=32),
    longest=st.sampled_from([0.1, math.inf]),
)
def test_blocks_follow_each_other_each_with_its_own_baseline(periods, longest):
    conductor = Conductor(Protocol(blocks=BLOCKS), longest, UNSTEADY)
    events = walk(periods)
    horizons, trains = conduct(conductor, events)
    assert horizons[-1].last
    assert [len(train.pulses) for train in trains] == [3, 1, 1]
    strikes = strikes_of(events)
    first, second, third = conductor.blocks
    assert (first.start, second.end) == (0, third.start)
    # The first block ends with its strides, or with its pulses if these take longer.
    assert first.end == max(strikes[9], next(s for s in strikes if s >= first.train.end))
    assert second.start == next(s for s in strikes if s >= first.end + 5 * 10**9)
    for block in conductor.blocks:
        start, plan = strikes.index(block.start), block.plan
        assert block.strides_before == start
        baseline = strikes[start : start + plan.baseline]
        mean = (baseline[-1] - baseline[0]) / (plan.baseline - 1) / 1e9
        assert block.measured_period == pytest.approx(mean, abs=1e-9)
    assert strikes.index(second.end) - strikes.index(second.start) == 3
    assert strikes.index(third.end) - strikes.index(third.start) == 5


def test_a_person_may_stand_still_during_a_rest():
    conductor = Conductor(Protocol(blocks=BLOCKS))
    for event in walk([1.2] * 10):
        conductor.add_event(event)
    assert conductor.part(12 * 10**9) is Part.REST
    assert not conductor.horizon(60 * 10**9).last, "silence for longer than any stride"


def test_a_baseline_lasts_until_its_time_is_over_and_the_gait_is_steady():
    strides = [1.2, 1.3] * 8 + [1.25] * 14
    strikes = strikes_of(walk(strides))
    for more, first in (
        ({"baseline_time": 10.0}, strikes.index(next(s for s in strikes if s > 10 * 10**9 - 1))),
        ({"baseline_steady": 0.01}, 26),  # the last ten strides are equal
    ):
        protocol = Protocol(baseline=4, pulses=PulsePlan(count=2), **more)
        conductor = Conductor(protocol)
        conduct(conductor, walk(strides))
        assert conductor.block.baseline == pytest.approx(first, abs=1)
        assert conductor.block.measured_period == pytest.approx(
            statistics.fmean(strides[conductor.block.baseline - 4 : conductor.block.baseline - 1])
        )
    conductor = Conductor(Protocol(baseline_steady=0.01))
    with pytest.raises(GaitError, match="not steady after 201 strides; allowed: a higher"):
        conduct(conductor, walk([1.2, 1.3] * 110))


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    periods=st.lists(st.floats(0.95, 1.45), min_size=14, max_size=14),
    pulse_period=st.floats(0.11, 1.5),
    part=st.integers(1, 30),
    longest=st.sampled_from([0.1, math.inf]),
)
def test_many_pulses_are_requested_in_parts_each_before_a_promise_reaches_it(
    periods, pulse_period, part, longest
):
    plan = PulsePlan(count=40, period=pulse_period, period_offset=None, jitter=0.004)
    protocol = Protocol(baseline=3, washout=30, pulses=plan)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "PART_PULSES", part)
        conductor = Conductor(protocol, longest, ANY_GAIT)
        horizons, trains = conduct(conductor, walk(periods))
    block = conductor.block
    onsets = plan.onsets(block.first_onset, pulse_period, (0, 1))[:-1]
    requested = [onset for train in trains for onset in train.onsets]
    assert list(block.train.onsets) == requested == onsets[: len(requested)]
    assert {len(train.pulses) for train in trains} <= {part, 40 % part or part}
    # All promised pulses are requested; those far ahead are not yet.
    promised = sum(onset < horizons[-1].until for onset in onsets)
    assert promised <= len(requested) <= promised + 2 * part
    assert block.pulses_end == onsets[-1] + 10**8


def test_sweep_jitter_ramp_and_catch_pulses():
    plan = PulsePlan(count=9, sweep=-0.08, rising=2, catch_pulses="4, 6", torque=6.0,
                     torque_fraction=None)  # fmt: skip
    onsets = plan.onsets(0, 1.0, (0, 1))[:-1]
    steps = [b - a for a, b in itertools.pairwise(onsets)]
    assert steps == pytest.approx([1e9 - 8e7 * n / 7 for n in range(8)], abs=1)
    assert plan.heights(6.0, (0, 1)) == [2.0, 4.0, 6.0, 0.0, 6.0, 0.0, 6.0, 6.0, 6.0]
    jittered = PulsePlan(count=200, jitter=0.05)
    off = [o / 1e9 - n for n, o in enumerate(jittered.onsets(0, 1.0, (3, 1)))]
    assert off[0] == 0
    assert 0.04 < max(off) - min(off) <= 0.1
    assert jittered.onsets(0, 1.0, (3, 1)) == jittered.onsets(0, 1.0, (3, 1))
    assert jittered.onsets(0, 1.0, (3, 1)) != jittered.onsets(0, 1.0, (3, 2))
    left_out = PulsePlan(count=40, catch_share=0.25).heights(1.0, (3, 1))
    assert left_out.count(0.0) == 10


TWO_LEGS = (
    Block("first", baseline=3, washout=1, pulses=PulsePlan(count=3)),
    Block("other", baseline=3, washout=1, pulses=PulsePlan(count=2), side=Side.LEFT),
    Block("both", baseline=3, washout=0, pulses=PulsePlan(count=3, sweep=0.1), both_legs=True),
    Block("phase", baseline=3, washout=1, pulses=by_phase(0.3, count=3), both_legs=True),
)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    periods=st.lists(st.floats(0.95, 1.45), min_size=45, max_size=45),
    longest=st.sampled_from([0.1, math.inf]),
)
def test_a_block_counts_the_strides_of_its_own_leg_and_both_legs_take_turns(periods, longest):
    protocol = Protocol(blocks=TWO_LEGS)
    assert protocol.sides == (Side.RIGHT, Side.LEFT)
    assert protocol.planned.count == 3 + 2 + 2 * 3 + 2 * 3
    conductor = Conductor(protocol, longest, UNSTEADY)
    events = walk(periods)
    horizons, _ = conduct(conductor, events)
    assert horizons[-1].last
    first, other, both, phase = conductor.blocks
    legs = {side: strikes_of(events, side) for side in Side}
    assert [block.leg for block in conductor.blocks] == [1, 0, 1, 1]
    assert other.start == next(s for s in legs[Side.LEFT] if s > first.end)
    assert both.start == next(s for s in legs[Side.RIGHT] if s > other.end)
    assert both.end == phase.start
    for block in conductor.blocks:
        strikes = legs[block.leg]
        start, plan = strikes.index(block.start), block.plan
        assert block.strides_before == start
        mean = (strikes[start + 2] - strikes[start]) / 2e9
        assert block.measured_period == pytest.approx(mean, abs=1e-9)
        assert {side: len(train.pulses) for side, train in block.trains.items()} == dict.fromkeys(
            protocol.ankles(plan), plan.pulses.count
        )
    own, between = (both.trains[side].onsets for side in (Side.RIGHT, Side.LEFT))
    middles = [(a + b) / 2 for a, b in itertools.pairwise(own)]
    assert between[:2] == pytest.approx(middles, abs=1)
    assert own[-1] < between[-1]
    for side, train in phase.trains.items():
        for onset in train.onsets:
            number = bisect.bisect(legs[side], onset) - 1
            walked = [b - a for a, b in itertools.pairwise(legs[side][: number + 1])][-5:]
            expected = pytest.approx(0.3 * statistics.fmean(walked), abs=1)
            assert onset - legs[side][number] == expected
