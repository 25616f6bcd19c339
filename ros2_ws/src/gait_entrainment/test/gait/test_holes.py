# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A hole in the record is reported; no lag is followed and no verdict is formed across it."""

import dataclasses
import itertools
from collections.abc import Sequence

import pytest
from synthetic_gait import regular_walk

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import Analysis, GaitEvent, PulsePhase, Reason, Verdict, analyze
from gait_entrainment.gait.pulse_phase import PulseNumbers

MS = 1_000_000
T, P = 2000 * MS, 1950 * MS
BASELINE, PULSES = 10, 60
EVENTS = regular_walk([T] * BASELINE + [P] * PULSES + [T] * 5)
ONSETS = [BASELINE * T + T // 2 + n * P for n in range(PULSES)]


def judged(
    events: Sequence[GaitEvent] = EVENTS,
    onsets: Sequence[int] = ONSETS,
    unknown: Sequence[tuple[int, int]] = (),
) -> Analysis:
    """Analyze a locked gait; whatever is missing, it must never be called drifting or lost."""
    analysis = analyze(events, onsets, Side.RIGHT, None, unknown)
    verdicts = {e.verdict for e in analysis.entrainments}
    assert verdicts <= {Verdict.UNDECIDED, Verdict.ENTRAINED, Verdict.UNTESTABLE}
    return analysis


def cut(first: int, last: int) -> Analysis:
    """Analyze the record without a span [ns] of it."""
    return judged(
        [e for e in EVENTS if not first <= e.stamp < last],
        [o for o in ONSETS if not first <= o < last],
        [(first, last)],
    )


@pytest.mark.parametrize("lost", range(2, PULSES - 1, 7))
def test_one_lost_onset_is_reported_and_the_others_keep_their_numbers(lost: int) -> None:
    analysis = judged(onsets=ONSETS[:lost] + ONSETS[lost + 1 :])
    complete = judged()
    assert list(analysis.pulses)[:lost] == list(complete.pulses)[:lost]
    kept = [p.number for p in analysis.pulses]
    assert kept == [n for n in range(1, PULSES + 1) if n != lost + 1]
    (hole,) = analysis.holes
    assert (hole.start, hole.end) == (ONSETS[lost - 1], ONSETS[lost + 1])
    assert hole.missing == "1 pulse(s)"


def test_a_hole_restarts_the_verdict_and_is_given_as_the_reason() -> None:
    analysis = judged(onsets=ONSETS[:40] + ONSETS[42:])
    before, after = (
        [e for e in analysis.entrainments if e.stretch == stretch] for stretch in (1, 2)
    )
    assert before[-1].verdict == Verdict.ENTRAINED
    assert {e.reason for e in after} == {Reason.HOLE}
    assert after[-1].window == 20
    assert analysis.pulses[40].unwrapped_lag == analysis.pulses[40].phase_lag


@pytest.mark.parametrize("begin", range(15 * T, 120 * 1000 * MS, 7 * 1000 * MS + 1))
def test_two_seconds_cut_out(begin: int) -> None:
    analysis = cut(begin, begin + 2000 * MS)
    assert analysis.holes
    kept = {p.onset: p for p in analysis.pulses}
    complete = judged().pulses
    assert all(p.number == kept[p.onset].number for p in complete if p.onset in kept)
    for stretch in {e.stretch for e in analysis.entrainments}:
        strides = [e.stride for e in analysis.entrainments if e.stretch == stretch]
        assert strides == list(range(strides[0], strides[-1] + 1)), "a window spans the gap"


def test_without_a_baseline_the_verdict_is_untestable() -> None:
    analysis = cut(0, 30 * T)
    assert {e.verdict for e in analysis.entrainments[1:]} == {Verdict.UNTESTABLE}
    assert analysis.entrainments[-1].reason == Reason.BASELINE_UNKNOWN
    assert analysis.holes[-1].missing == "31 stride(s)"


def test_strides_after_an_unknown_span_are_not_taken_for_unperturbed_ones() -> None:
    # The record lacks the end of the baseline and the first 13 pulses.
    analysis = cut(8 * T, 8 * T + 15 * P)
    assert analysis.entrainments[-1].unperturbed_period == 2.0


def test_a_hole_in_the_baseline_or_after_the_pulses_does_not_affect_the_verdict() -> None:
    after = EVENTS[-1].stamp
    for first, last in ((3 * T, 4 * T), (after - 3 * T, after - 2 * T)):
        analysis = cut(first, last)
        assert analysis.holes
        assert analysis.entrainments[-1].verdict == Verdict.ENTRAINED
        assert analysis.entrainments[-1].stretch == 1


def test_trains_are_told_apart_and_judged_separately() -> None:
    # Locked to the first train; the second, after a pause and at another period, is ignored.
    pause, second = 7 * T + 900 * MS, 1930 * MS
    walk = regular_walk([T] * BASELINE + [P] * 40 + [T] * 60)
    begin = BASELINE * T + T // 2 + 39 * P + pause
    onsets = ONSETS[:40] + [begin + n * second for n in range(40)]
    analysis = analyze(walk, onsets, Side.RIGHT)
    last = {e.stretch: e.verdict for e in analysis.entrainments}
    assert last == {1: Verdict.ENTRAINED, 2: Verdict.DRIFTING}
    assert not analysis.holes
    assert [p.number for p in analysis.pulses] == list(range(1, 81))


def test_irregular_pulses_are_numbered_in_order() -> None:
    numbers = PulseNumbers()
    steps = (0, 100, 350, 351, 352, 353, 900)
    assert [numbers.place(at, 1e-7) for at in itertools.accumulate(steps)][:3] == [0, 0, None]
    assert numbers.number == len(steps)


def moved(event: GaitEvent, **changes: int) -> GaitEvent:
    return dataclasses.replace(event, **changes)


@pytest.mark.parametrize("place", [0, 1, 7, 90, 91, 92, 93, 200])
@pytest.mark.parametrize(
    "changes",
    [
        {"step": 40},
        {"step": 4000},
        {"stamp": 3600 * 1000 * MS},
        {"stamp": -3600 * 1000 * MS},
    ],
)
def test_one_wrong_event_neither_hides_nor_renumbers_later_strides(
    place: int, changes: dict[str, int]
) -> None:
    event = EVENTS[place]
    wrong = moved(event, **{name: getattr(event, name) + by for name, by in changes.items()})
    analysis = judged([*EVENTS[:place], wrong, *EVENTS[place + 1 :]])
    assert analysis.event_counts.implausible + analysis.event_counts.contradictory >= 1
    numbers = {s.number: s.period for s in analysis.strides}
    assert len(numbers) >= BASELINE + PULSES + 5 - (4 if place == 0 else 2)
    complete = {s.number: s.period for s in judged().strides}
    assert numbers.items() <= complete.items()
    assert analysis.event_counts.missing <= 14


def test_a_pause_in_the_gait_is_a_hole() -> None:
    first = [e for e in EVENTS if e.stamp < 30 * T]
    later = [moved(e, stamp=e.stamp + 60_000 * MS) for e in EVENTS if e.stamp >= 30 * T]
    analysis = judged([*first, *later], [o for o in ONSETS if o < 30 * T])
    assert analysis.event_counts.implausible == 13
    assert [hole.missing for hole in analysis.holes] == ["3 stride(s)"]
    assert max(s.period for s in analysis.strides) == 2.0


def test_a_missing_toe_off_alone_is_not_a_hole() -> None:
    lost = [e for e in EVENTS if not (e.kind is EventKind.TOE_OFF and e.step == 60)]
    analysis = judged(lost)
    assert not analysis.holes
    assert analysis.entrainments[-1].verdict == Verdict.ENTRAINED
    assert isinstance(analysis.pulses[-1], PulsePhase)


@pytest.mark.parametrize("stride", range(1, BASELINE - 1))
def test_a_pause_in_the_baseline_does_not_affect_the_unperturbed_period(stride: int) -> None:
    begin, pause = stride * T + T // 4, 7000 * MS
    events = [e if e.stamp < begin else moved(e, stamp=e.stamp + pause) for e in EVENTS]
    last = judged(events, [o + pause for o in ONSETS]).entrainments[-1]
    assert (last.verdict, last.unperturbed_period) == (Verdict.ENTRAINED, 2.0)
