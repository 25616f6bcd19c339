# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Detector errors, for events that are known to be shifted, left out or made up."""

from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import GaitEvent
from gait_entrainment_bags.truth import detection_lines, detector_errors, without_bias

MS = 10**6


def walk(strides):
    for stride in range(strides):
        for step, side in enumerate(Side):
            start = stride * 1000 * MS + step * 500 * MS
            yield GaitEvent(start, EventKind.HEEL_STRIKE, side, 2 * stride + step)
            yield GaitEvent(start + 100 * MS, EventKind.TOE_OFF, side.other, 2 * stride + step + 1)


TRUTH = list(walk(20))


@settings(max_examples=30, deadline=None)
@given(
    st.sets(st.integers(4, len(TRUTH) - 5), max_size=5),
    st.lists(st.integers(-100, 100), min_size=len(TRUTH), max_size=len(TRUTH)),
)
def test_what_was_left_out_and_shifted_is_found(missed, shifts):
    found = [
        replace(event, stamp=event.stamp + shift * MS)
        for place, (event, shift) in enumerate(zip(TRUTH, shifts, strict=True))
        if place not in missed
    ]
    errors = detector_errors(found, TRUTH)
    for kind in EventKind:
        places = [p for p, e in enumerate(TRUTH) if e.kind is kind]
        row = errors[kind.name.lower()]
        gone = len(missed & set(places))
        assert (row["events"], row["missed"], row["false"]) == (40, gone, 0)
        mean = sum(shifts[p] for p in places if p not in missed) / (40 - gone)
        assert abs(row["bias"] - mean / 1000) < 1e-9


def test_an_extra_event_is_false_and_events_before_the_first_are_not_missed():
    late = [event for event in TRUTH if event.stamp > 5000 * MS]
    doubled = [*late, replace(late[4], stamp=late[4].stamp + 400 * MS)]
    errors = detector_errors(doubled, TRUTH)
    assert sum(row["false"] for row in errors.values()) == 1
    assert sum(row["missed"] for row in errors.values()) == 0


def test_detection_errors_are_printed_for_detected_events_only():
    assert detection_lines({}) == []
    outcome = {
        "toe_off_bias": 0.004,
        "final_phase_lag_uncertainty": 0.006,
        "detector_errors": detector_errors(TRUTH, TRUTH) | {"phase_lag_shift": None},
    }
    bias, uncertainty, errors = detection_lines(outcome)
    assert "+4.0 ms" in bias
    assert "6.0 ms" in uncertainty
    assert "40 of 40 heel strikes, 0 false, +0.0 ms (SD 0.0); 40 of 40 toe-offs" in errors


def test_a_known_toe_off_bias_is_subtracted_and_nothing_else_changes():
    late = [
        replace(e, stamp=e.stamp + 4 * MS) if e.kind is EventKind.TOE_OFF else e for e in TRUTH
    ]
    assert without_bias(late, 0.004) == TRUTH
    assert without_bias(TRUTH, 0.0) == TRUTH
