# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Step numbers: gaps stay gaps, and no missed or doubled event contradicts the others."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from public_data import children, foot_rates
from walks import STANCE, STRIDE, detections

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import analyze
from gait_entrainment_sensors.detection import Detection, find_detector
from gait_entrainment_sensors.numbering import Numbering
from gait_entrainment_sensors.offline import detect

STRIKE, TOE_OFF = EventKind


def numbered(found, **options):
    numbering = Numbering(**options)
    events = [numbering.add(detection) for detection in found]
    return numbering, [event for event in events if event is not None]


def test_a_walk_is_numbered_like_that_of_the_simulated_walker():
    numbering, events = numbered(detections(20))
    strikes = [e for e in events if e.kind is STRIKE]
    assert [e.step for e in strikes] == list(range(40))
    assert [e.side for e in strikes] == [Side.RIGHT, Side.LEFT] * 20
    assert sorted(e.place for e in events) == [0, *range(2, 80), 81]
    assert numbering.period == pytest.approx(STRIDE)
    # The left foot's first toe-off and the strike before the last toe-off are missing.
    assert numbering.troubles() == ("2 events were missed",)


def test_the_side_with_even_numbers_can_be_chosen():
    _, events = numbered(detections(5), first_side=Side.LEFT)
    assert events[0].step == 1


def test_a_run_begins_with_a_heel_strike():
    found = detections(5)
    toe_offs = [d for d in found if d.kind is TOE_OFF]
    _, events = numbered([toe_offs[0], *found[1:]])
    assert events[0].kind is STRIKE


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), variation=st.floats(0.0, 0.02))
def test_lost_and_doubled_events_change_no_other_number(seed, variation):
    generator = random.Random(seed)
    found = [
        Detection(d.kind, d.side, d.time + generator.gauss(0.0, variation), d.detected_at, 0.0)
        for d in detections(30)
    ]
    _, events = numbered(found)
    number = {(e.kind, e.side, e.stamp): e.step for e in events}
    assert len(number) == len(found)
    kept, doubled = found[:12], set()
    for place, detection in enumerate(found[12:], 12):
        if generator.random() > 0.1:
            kept.append(detection)
        if generator.random() < 0.1 and kept[-1] is detection and place < len(found) - 1:
            late = generator.uniform(1e-3, 0.2)
            kept.append(
                Detection(
                    detection.kind,
                    detection.side,
                    detection.time + late,
                    detection.detected_at + late,
                    0.0,
                )
            )
            doubled.add(kept[-1])
    kept.sort(key=lambda d: d.detected_at)
    numbering, events = numbered(kept)
    assert {(e.kind, e.side, e.stamp): e.step for e in events}.items() <= number.items()
    assert len(events) == len(kept) - len(doubled)
    assert numbering.counts.repeated == len(doubled)


@pytest.mark.parametrize("change", ["delete", "double"])
def test_27_right_strides_of_a_real_walk_remain_if_any_event_is_lost_or_doubled(change):
    events, _ = detect(find_detector("foot_gyroscope:axis_y=1"), foot_rates())
    found = [event.detection for event in events]
    for place, detection in enumerate(found):
        again = Detection(
            detection.kind,
            detection.side,
            detection.time + 0.04,
            detection.detected_at + 0.04,
            detection.uncertainty,
        )
        rest = found[:place] + found[place + 1 :]
        changed = (
            rest if change == "delete" else sorted([*found, again], key=lambda d: d.detected_at)
        )
        analysis = analyze(numbered(changed)[1], (), Side.RIGHT)
        assert len(analysis.strides) >= 27
        assert analysis.event_counts.contradictory == 0


def test_strides_of_children_with_every_tenth_event_lost_are_numbered():
    total = refused = 0
    for found in children()[::5]:
        numbering, events = numbered(found)
        total, refused = total + len(found), refused + len(found) - len(events)
        assert numbering.counts.restarts == 0
        assert all(a.place < b.place for a, b in pairwise(events))
    assert refused < 1e-3 * total


def test_a_period_of_two_strides_does_not_confirm_itself():
    slow = [Detection(d.kind, d.side, 2 * d.time, 2 * d.detected_at, 0.0) for d in detections(3)]
    late = slow[-1].time
    quick = [
        Detection(d.kind, d.side, d.time + late, d.detected_at + late, 0.0) for d in detections(30)
    ]
    numbering, events = numbered([*slow, *quick])
    assert len(events) >= len(slow) + len(quick) - 12
    assert numbering.period == pytest.approx(STRIDE)


def test_a_pause_is_a_gap():
    before = detections(10)
    pause = 3.5 * STRIDE
    after = [
        Detection(
            d.kind, d.side, d.time + 10 * STRIDE + pause, d.detected_at + 10 * STRIDE + pause, 0.0
        )
        for d in detections(10)
    ]
    numbering = Numbering()
    for detection in before:
        numbering.add(detection)
    events = [numbering.add(detection) for detection in after]
    steps = [e.step for e in events if e is not None and e.kind is STRIKE]
    assert steps[0] >= 2 * (10 + 3)
    assert steps == list(range(steps[0], steps[0] + len(steps)))
    assert any("were missed" in line for line in numbering.troubles())


@pytest.mark.parametrize("begin", [0, 4])
def test_running_keeps_the_strike_numbers_and_is_reported(begin):
    """Stance is a third of a stride, so no double stance, from the start or after two strides."""
    found = [d for d in detections(2) if d.time < begin]
    for n in range(40):
        side, strike = Side(1 - n % 2), begin + 0.35 * n
        found += [Detection(STRIKE, side, strike, strike + 0.02, 0.0)]
        found += [Detection(TOE_OFF, side, strike + 0.24, strike + 0.26, 0.0)]
    numbering, events = numbered(found)
    strides = analyze(events, (), Side.RIGHT).strides
    assert len([s for s in strides if s.period == pytest.approx(0.7)]) >= 17
    assert any("running?" in line for line in numbering.troubles())


def test_force_plates_with_a_step_between_them_are_numbered():
    right, left = ((STRIKE, TOE_OFF, Side.RIGHT), 1.0), ((STRIKE, TOE_OFF, Side.LEFT), 2.65)
    found = [
        Detection(kind, side, at + late, at + late, 0.0)
        for (*kinds, side), at in (right, left)
        for kind, late in zip(kinds, (0.0, STANCE), strict=True)
    ]
    _, events = numbered(found)
    assert [e.step for e in events] == [0, 2, 3, 5]


def test_a_false_first_event_does_not_suppress_the_walk():
    wrong = Detection(STRIKE, Side.RIGHT, 0.0, 0.01, 0.0)
    _, events = numbered([wrong, *detections(30)])
    analysis = analyze(events, (), Side.RIGHT)
    assert len(analysis.strides) >= 25


def test_a_clock_that_jumps_back_restarts_the_count():
    found = detections(10)
    later = [
        Detection(d.kind, d.side, d.time - 5.0, d.detected_at - 5.0, 0.0) for d in detections(20)
    ]
    numbering, events = numbered([*found, *later])
    assert numbering.counts.restarts == 1
    assert events[-1].step > 40
