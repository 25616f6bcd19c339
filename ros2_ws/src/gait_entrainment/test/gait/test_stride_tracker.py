# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Strides from gait events that are missing, repeated, late or contradictory."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import EventCounts, GaitEvent, Stride, StrideTracker

SECOND = 1_000_000_000


def strike(step: int, stamp: int, first: Side = Side.RIGHT) -> GaitEvent:
    """Heel strike; ``first`` is the side of heel strike 0."""
    side = first if step % 2 == 0 else first.other
    return GaitEvent(stamp, EventKind.HEEL_STRIKE, side, step)


def toe_off(step: int, stamp: int, first: Side = Side.RIGHT) -> GaitEvent:
    """Toe-off of a step; ``first`` is the side of heel strike 0."""
    side = first if step % 2 == 0 else first.other
    return GaitEvent(stamp, EventKind.TOE_OFF, side, step)


def walk(steps: int, first: Side = Side.RIGHT) -> list[GaitEvent]:
    """Events of steps of 1 s, toe-off 0.3 s after the other leg's heel strike."""
    events = [strike(0, 0, first)]
    for step in range(1, steps + 1):
        events.append(toe_off(step, (step - 1) * SECOND + 300_000_000, first))
        events.append(strike(step, step * SECOND, first))
    return events


def track(events: list[GaitEvent], side: Side = Side.RIGHT) -> tuple[list[Stride], EventCounts]:
    tracker = StrideTracker(side)
    strides = [stride for event in events if (stride := tracker.add(event)) is not None]
    return strides, tracker.counts


def test_places_follow_the_order_of_a_gait() -> None:
    assert [event.place for event in walk(3)] == [0, 1, 2, 3, 4, 5, 6]


def test_strides_of_the_leg_that_strikes_first() -> None:
    strides, counts = track(walk(4), Side.RIGHT)
    assert strides == [
        Stride(1, Side.RIGHT, 0, 2 * SECOND, 1_300_000_000, (1.0, 1.0)),
        Stride(2, Side.RIGHT, 2 * SECOND, 4 * SECOND, 3_300_000_000, (1.0, 1.0)),
    ]
    assert [stride.period for stride in strides] == [2.0, 2.0]
    assert counts == EventCounts(accepted=9)


@settings(derandomize=True, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(1, 10**13), st.integers(0, 40))))
def test_events_stamped_ahead_of_now_change_nothing(wrong: list[tuple[int, int, int]]) -> None:
    tracker, strides = StrideTracker(Side.RIGHT), []
    for position, event in enumerate(walk(10)):
        for at, ahead, step in wrong:
            if at == position:
                assert tracker.add(strike(step, event.stamp + ahead), event.stamp) is None
        strides.append(tracker.add(event, event.stamp))
    regular, counts = track(walk(10))
    assert [stride for stride in strides if stride] == regular
    assert tracker.counts == replace(counts, implausible=len(wrong))


@pytest.mark.parametrize(("later", "steps"), [(100 * SECOND, 0), (-7 * SECOND, 20)])
def test_restarted_numbers_or_clocks_leave_earlier_strides_unchanged(
    later: int, steps: int
) -> None:
    again = [replace(e, stamp=e.stamp + later, step=e.step + steps) for e in walk(40)]
    strides, counts = track(walk(20) + again)
    assert strides[:10] == track(walk(20))[0]
    assert [s.number for s in strides] == sorted({s.number for s in strides})
    assert all(a.end <= b.start for a, b in pairwise(strides))
    assert counts.contradictory > 5


def test_strides_of_the_leg_that_strikes_second() -> None:
    strides, _ = track(walk(5), Side.LEFT)
    assert [(s.number, s.start, s.end) for s in strides] == [
        (1, SECOND, 3 * SECOND),
        (2, 3 * SECOND, 5 * SECOND),
    ]


def test_steps_of_unequal_length() -> None:
    strides, _ = track([strike(0, 5), strike(1, 5 + 900_000_000), strike(2, 5 + 2 * SECOND)])
    assert strides[0].step_periods == (0.9, 1.1)
    assert strides[0].toe_off is None


def test_stride_is_given_at_its_closing_heel_strike() -> None:
    tracker = StrideTracker(Side.RIGHT)
    results = [tracker.add(event) for event in walk(2)]
    assert [result is not None for result in results] == [False, False, False, False, True]
    assert tracker.stride_in_progress == 2
    assert tracker.latest_strike == 2 * SECOND


def test_missing_strike_of_the_other_leg_leaves_the_step_periods_unknown() -> None:
    strides, counts = track([e for e in walk(2) if e.place != 2])
    assert strides[0].period == 2.0
    assert all(math.isnan(period) for period in strides[0].step_periods)
    assert counts.missing == 1


def test_missing_strike_of_the_leg_costs_two_strides_and_no_number() -> None:
    strides, counts = track([e for e in walk(8) if e.place != 8])
    assert [s.number for s in strides] == [1, 4]
    assert counts.missed_strides == 2
    assert counts.missing == 1


def test_missing_first_strike_changes_no_number() -> None:
    strides, counts = track(walk(6)[1:])
    assert [s.number for s in strides] == [2, 3]
    assert counts.missed_strides == 1
    assert counts.missing == 1


def test_joining_late_counts_the_missed_events() -> None:
    events = walk(24)
    strides, counts = track(events[37:])  # from toe-off 19 on; first own strike: 20
    assert [s.number for s in strides] == [11, 12]
    assert counts.missed_strides == 10
    assert counts.missing == 37


def test_each_event_twice_changes_nothing() -> None:
    once, _ = track(walk(6))
    twice, counts = track([event for event in walk(6) for _ in range(2)])
    assert twice == once
    assert (counts.accepted, counts.repeated, counts.late) == (13, 13, 0)


def test_event_before_the_latest_own_strike_is_late() -> None:
    events = walk(4)
    strike_1 = events.pop(2)
    strides, counts = track([*events[:4], strike_1, *events[4:]])
    assert all(math.isnan(period) for period in strides[0].step_periods)
    assert (counts.late, counts.missing) == (1, 1)


def test_own_strike_out_of_order_counts_until_a_later_one_is_known() -> None:
    events = walk(6)
    place_4 = events.pop(4)
    in_time, counts = track([*events[:6], place_4, *events[6:]])  # after heel strike 3
    assert [s.number for s in in_time] == [1, 2, 3]
    assert (counts.out_of_order, counts.missing, counts.missed_strides) == (1, 0, 0)
    too_late, counts = track([*events[:8], place_4, *events[8:]])  # after heel strike 4
    assert [s.number for s in too_late] == [3]
    assert (counts.late, counts.missing, counts.missed_strides) == (1, 1, 2)


@pytest.mark.parametrize(
    "contradiction",
    [
        strike(3, 2_900_000_000),  # known step, other stamp
        strike(4, 2_900_000_000),  # later step, earlier stamp
        strike(4, 3 * SECOND),  # later step, same stamp
        toe_off(4, 3_300_000_000, first=Side.LEFT),  # other side
        GaitEvent(0, EventKind.TOE_OFF, Side.RIGHT, 0),  # nothing precedes heel strike 0
        strike(-2, -SECOND),
    ],
)
def test_contradictory_event_is_dropped(contradiction: GaitEvent) -> None:
    events = walk(6)
    strides, counts = track([*events[:7], contradiction, *events[7:]])
    assert strides == track(events)[0]
    assert (counts.contradictory, counts.accepted) == (1, 13)


@pytest.mark.parametrize("stamp", [1_900_000_000, 2 * SECOND, 3 * SECOND, 3_100_000_000])
def test_event_out_of_order_with_a_stamp_outside_its_neighbours_is_dropped(stamp: int) -> None:
    events = [e for e in walk(4) if e.place != 5]
    strides, counts = track([*events[:6], toe_off(3, stamp), *events[6:]])
    assert strides == track(events)[0]
    assert (counts.contradictory, counts.missing) == (1, 1)


@settings(derandomize=True, deadline=None)
@given(st.sets(st.integers(0, 40)))
def test_any_missing_events_leave_the_other_strides_as_they_are(lost: set[int]) -> None:
    events = walk(20)
    complete = {s.number: s for s in track(events)[0]}
    kept = [e for e in events if e.place not in lost]
    strides, counts = track(kept)
    bounded = [k for k in range(1, 11) if not {4 * k - 4, 4 * k} & lost]
    assert [s.number for s in strides] == bounded
    for stride in strides:
        own = complete[stride.number]
        place = 4 * stride.number
        assert (stride.start, stride.end) == (own.start, own.end)
        assert stride.toe_off == (None if place - 1 in lost else own.toe_off)
        assert math.isnan(stride.step_periods[0]) == (place - 2 in lost)
    latest = max((e.place for e in kept), default=-1)
    latest_strike = max((e.place for e in kept if e.place % 4 == 0), default=0)
    assert counts.missing == len([place for place in lost if place < latest])
    assert counts.missed_strides == latest_strike // 4 - len(bounded)


@settings(derandomize=True, deadline=None)
@given(st.data())
def test_order_within_a_stride_does_not_matter(data: st.DataObject) -> None:
    events = walk(12)
    shuffled: list[GaitEvent] = [events[0]]
    for k in range(0, 24, 4):
        shuffled += [*data.draw(st.permutations(events[k + 1 : k + 4])), events[k + 4]]
    strides, counts = track(shuffled)
    assert strides == track(events)[0]
    assert (counts.accepted, counts.missing, counts.late) == (25, 0, 0)


@settings(derandomize=True, deadline=None)
@given(st.lists(st.integers(0, 40), max_size=200))
def test_arbitrary_order_and_repetition_give_no_wrong_stride(places: list[int]) -> None:
    events = walk(20)
    complete = {s.number: s for s in track(events)[0]}
    strides, counts = track([events[place] for place in places])
    numbers = [s.number for s in strides]
    assert numbers == sorted(set(numbers))
    for stride in strides:
        own = complete[stride.number]
        assert (stride.start, stride.end) == (own.start, own.end)
    dropped = counts.repeated + counts.late + counts.contradictory
    assert counts.accepted + dropped == len(places)
    assert counts.accepted + counts.missing == max(places, default=-1) + 1
    assert counts.contradictory == 0
