# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Only plausible strides are believed; a person who stands still gets no torque."""

import math

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.experiment import Conductor, GaitError, Part
from gait_entrainment.gait import GaitEvent, GaitLimits, GaitWatch
from gait_entrainment.protocol import Protocol, PulsePlan

SECOND = 1_000_000_000
STRIDE = 1_100_000_000


def watch(*periods):
    found, stamp = GaitWatch(Side.RIGHT, GaitLimits()), 0
    found.add(0, None)
    believed = []
    for period in periods:
        believed.append(found.believes(1, round(period * SECOND)))
        stamp += round(period * SECOND)
        if believed[-1]:
            found.add(stamp, period)
    return found, believed, stamp


@pytest.mark.parametrize(
    ("periods", "believed"),
    [
        ((1.1, 1.12, 1.08, 1.1), [True] * 4),
        ((1.1, 0.2, 0.9, 1.1), [True, False, True, True]),  # counted twice
        ((1.1, 1.1, 1.1, 2.2, 1.1), [True, True, True, False, True]),  # missed
        ((1.1, 1.1, 1.1, 24.0, 1.1), [True, True, True, False, True]),  # stood still
        ((1.1, 1.1, 1.1, 0.6), [True, True, True, False]),  # not this person's
        ((0.2,), [False]),
        ((6.0,), [False]),
    ],
)
def test_implausible_strides_are_not_believed(periods, believed):
    assert watch(*periods)[1] == believed


@pytest.mark.parametrize(
    ("strides", "seconds", "believed"),
    [
        (10, 11.0, True),
        (10, 4.0, False),  # a step far ahead
        (1.25, 3600.0, False),  # a stamp far ahead
        (0.25, 0.01, True),
        (0.25, 1.8, True),
        (0.25, 1.9, False),
    ],
)
def test_several_strides_or_part_of_one_are_judged_by_their_mean(strides, seconds, believed):
    found, _, _ = watch(1.1, 1.1, 1.1)
    assert found.believes(strides, round(seconds * SECOND)) == believed


def test_the_gait_has_stopped_after_one_and_a_half_strides_without_a_strike():
    found, _, now = watch(1.1, 1.1, 1.1)
    assert found.stopped(now + round(1.649 * SECOND)) == ""
    assert "1.66 s; allowed: 1.5 strides of 1.1 s" in found.stopped(now + round(1.66 * SECOND))


def test_before_a_stride_is_known_the_longest_allowed_one_counts():
    found = GaitWatch(Side.RIGHT, GaitLimits())
    assert found.stopped(10**15) == ""
    found.add(0, None)
    assert math.isnan(found.median)
    assert found.stopped(7 * SECOND) == ""
    assert found.stopped(8 * SECOND)


def gait(conductor, strides, *, stray=(), short=0.25):
    """Feed a regular gait in which some strides are short, each event with the next number."""
    step, stamp = 0, 0
    for number in range(strides + 1):
        stride = round(short * STRIDE) if number in stray else STRIDE
        for when, kind, side in (
            (0.0, EventKind.HEEL_STRIKE, Side.RIGHT),
            (0.1, EventKind.TOE_OFF, Side.LEFT),
            (0.5, EventKind.HEEL_STRIKE, Side.LEFT),
            (0.6, EventKind.TOE_OFF, Side.RIGHT),
        ):
            at = stamp + round(when * stride)
            off = kind is EventKind.TOE_OFF
            conductor.add_event(GaitEvent(at, kind, side, step + off))
            step += off
        stamp += stride
    return stamp


@pytest.mark.parametrize("baseline", [15, 2, 1])
def test_a_gait_that_stops_under_pulses_ends_the_run_and_one_that_goes_on_does_not(baseline):
    pulses = PulsePlan(period=STRIDE / SECOND, period_offset=None)
    conductor = Conductor(Protocol(baseline=baseline, pulses=pulses))
    stamp = gait(conductor, baseline - 1)  # before the second strike no stride is known
    assert conductor.due(stamp)
    conductor.horizon(stamp - STRIDE + round(1.4 * STRIDE))
    with pytest.raises(GaitError, match="the gait has stopped"):
        conductor.horizon(stamp - STRIDE + round(1.6 * STRIDE))


def test_stray_strikes_do_not_enter_the_measured_period():
    conductor = Conductor(Protocol())
    gait(conductor, 17, stray=(5, 9))
    assert conductor.block.measured_period == pytest.approx(STRIDE / SECOND)


def test_a_baseline_of_strays_ends_the_run_before_the_first_pulse_and_gives_figures():
    conductor = Conductor(Protocol())
    with pytest.raises(GaitError, match=r"baseline: .* of .* strides are implausible"):
        gait(conductor, 17, stray=range(2, 15))


def test_an_unsteady_baseline_ends_the_run_and_gives_figures():
    conductor = Conductor(Protocol(), limits=GaitLimits(stride_change=1.0, baseline_spread=0.05))
    with pytest.raises(GaitError, match=r"strides of 0\.825 to 1\.1 s, which vary by"):
        gait(conductor, 17, stray=range(1, 15, 3), short=0.75)


@pytest.mark.parametrize(("step", "seconds"), [(40, 0.0), (4000, 0.0), (0, 3600.0), (40, 3600.0)])
@pytest.mark.parametrize("after", [1, 5, 16])
def test_one_wrong_event_neither_ends_an_experiment_nor_keeps_it_from_ending(step, seconds, after):
    conductor = Conductor(Protocol(baseline=6, pulses=PulsePlan(count=8), washout=3))
    for number in range(19):
        for when, kind, side, ahead in (
            (0.0, EventKind.HEEL_STRIKE, Side.RIGHT, 0),
            (0.1, EventKind.TOE_OFF, Side.LEFT, 1),
            (0.5, EventKind.HEEL_STRIKE, Side.LEFT, 1),
            (0.6, EventKind.TOE_OFF, Side.RIGHT, 2),
        ):
            stamp = round((number + when) * STRIDE)
            conductor.add_event(GaitEvent(stamp, kind, side, 2 * number + ahead))
        if number == after:
            far = round((number + 0.7 + seconds) * SECOND)
            wrong = GaitEvent(far, EventKind.HEEL_STRIKE, Side.RIGHT, 2 * number + 2 + step)
            conductor.add_event(wrong)
        assert conductor.strides == number
        finished = conductor.part(stamp) is Part.FINISHED
        assert finished == (conductor.strides >= 17)


def test_an_implausible_gait_under_pulses_ends_the_torque():
    conductor = Conductor(Protocol())
    # Twice as fast: plausible for others, but not for this person.
    stamp = gait(conductor, 20, stray=range(17, 30), short=0.5)
    with pytest.raises(GaitError, match="the gait has stopped"):
        conductor.horizon(stamp)
