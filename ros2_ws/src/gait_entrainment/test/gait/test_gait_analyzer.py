# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The analyzer: when it gives results, and that only events and onsets determine them."""

import dataclasses
import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_gait import ignores, locks, noisy_walk, regular_walk, white

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import (
    Analysis,
    Entrainment,
    GaitAnalyzer,
    GaitEvent,
    PulsePhase,
    Stride,
    Verdict,
    VerdictSettings,
    analyze,
)

Result = Stride | PulsePhase | Entrainment
SECOND = 1_000_000_000
STRIDE = 2 * SECOND  # toe-off at 1.36 s
FOREVER = 10**6 * SECOND


def stride_numbers(results: list[Result]) -> list[int]:
    return [r.number for r in results if isinstance(r, Stride)]


def pulses_of(results: list[Result]) -> list[PulsePhase]:
    return [r for r in results if isinstance(r, PulsePhase)]


def test_none_one_and_two_pulses_in_a_stride() -> None:
    onsets = [4 * SECOND, 5 * SECOND, 8_500_000_000]
    analysis = analyze(regular_walk([STRIDE] * 6), onsets, Side.RIGHT)
    assert [(p.number, p.stride, p.phase) for p in analysis.pulses] == [
        (1, 3, 0.0),  # on the heel strike: the stride that it starts
        (2, 3, 0.5),
        (3, 5, 0.25),
    ]
    # Nearest toe-offs at 3.36, 5.36 and 9.36; a tie would be at 8.36.
    assert [p.toe_off for p in analysis.pulses] == [3_360_000_000, 5_360_000_000, 9_360_000_000]
    assert [p.phase_lag for p in analysis.pulses] == [0.64, -0.36, -0.86]
    assert [e.stride for e in analysis.entrainments] == [3, 5]  # only strides with pulses
    assert analysis.pulse_counts.placed == 3


def test_strides_are_given_immediately_and_pulses_once_promised() -> None:
    events = regular_walk([STRIDE] * 3)
    analyzer = GaitAnalyzer(Side.RIGHT)
    assert analyzer.add_promise([3 * SECOND], 3 * SECOND) == []
    results = [result for event in events[:9] for result in analyzer.add_event(event)]
    assert stride_numbers(results) == [1, 2]
    assert pulses_of(results) == []  # another pulse might still come in stride 2
    assert analyzer.add_promise([], 4 * SECOND - 1) == []
    pulse, entrainment = analyzer.add_promise([], 4 * SECOND)
    assert isinstance(pulse, PulsePhase)
    assert isinstance(entrainment, Entrainment)
    assert (pulse.stride, pulse.phase) == (2, 0.5)
    assert (entrainment.stride, entrainment.stamp) == (2, 4 * SECOND)


def test_pulse_late_in_the_stride_waits_for_the_next_toe_off() -> None:
    events = regular_walk([STRIDE] * 3)
    analyzer = GaitAnalyzer(Side.RIGHT)
    late = 3_900_000_000  # nearer to the heel strike at 4 s than to toe-off at 3.36 s
    analyzer.add_promise([late], FOREVER)
    results = [result for event in events[:9] for result in analyzer.add_event(event)]
    assert pulses_of(results) == []
    results = [result for event in events[9:] for result in analyzer.add_event(event)]
    assert [p.toe_off for p in pulses_of(results)] == [3_360_000_000]
    assert isinstance(results[0], Stride)  # stride 3, before the pulse in stride 2


def test_pulses_outside_complete_strides_are_counted_and_keep_their_number() -> None:
    events = [e for e in regular_walk([STRIDE] * 6, start=10 * SECOND) if e.step != 6]
    onsets = [9 * SECOND, 11 * SECOND, 15 * SECOND, 17 * SECOND, 19 * SECOND, 25 * SECOND]
    analysis = analyze(events, onsets, Side.RIGHT)
    assert [s.number for s in analysis.strides] == [1, 2, 5, 6]
    # Before stride 1, in the missed strides 3 and 4, and after stride 6.
    assert [(p.number, p.stride) for p in analysis.pulses] == [(2, 1), (5, 5)]
    assert analysis.pulse_counts.outside_strides == 4


def test_pulse_with_a_missing_toe_off_has_a_phase_and_no_say_in_the_verdict() -> None:
    events = [
        e for e in regular_walk([STRIDE] * 4) if not (e.kind == EventKind.TOE_OFF and e.step == 6)
    ]
    analysis = analyze(events, [3 * SECOND, 5 * SECOND, 7 * SECOND], Side.RIGHT)
    assert [p.stride for p in analysis.pulses] == [2, 3, 4]
    assert [math.isnan(p.phase_lag) for p in analysis.pulses] == [False, True, False]
    assert [e.stride for e in analysis.entrainments] == [2, 4]
    assert analysis.pulse_counts.without_lag == 1
    assert analysis.entrainments[-1].pulse_period == 2.0


def test_repeated_onsets_are_ignored_and_broken_promises_counted() -> None:
    analyzer = GaitAnalyzer(Side.RIGHT)
    analyzer.add_promise([3 * SECOND, 5 * SECOND], 4 * SECOND)
    analyzer.add_promise([5 * SECOND, 3_500_000_000], 8 * SECOND)
    results = [r for event in regular_walk([STRIDE] * 4) for r in analyzer.add_event(event)]
    assert [p.onset for p in pulses_of(results)] == [3 * SECOND, 5 * SECOND]
    assert analyzer.pulse_counts.late == 1


def test_stop_withdraws_announced_pulses_and_the_promise() -> None:
    analyzer = GaitAnalyzer(Side.RIGHT)
    analyzer.add_promise([3 * SECOND, 5 * SECOND], 8 * SECOND)
    analyzer.stop(5 * SECOND)
    results = [r for event in regular_walk([STRIDE] * 4) for r in analyzer.add_event(event)]
    assert [p.onset for p in pulses_of(results)] == [3 * SECOND]
    assert analyzer.pulse_counts.withdrawn == 1
    later = analyzer.add_promise([7 * SECOND], 8 * SECOND)  # after a restart
    assert [p.onset for p in pulses_of(later)] == [7 * SECOND]


def test_finish_resolves_waiting_pulses_and_counts_later_ones() -> None:
    analyzer = GaitAnalyzer(Side.RIGHT)
    analyzer.add_promise([3 * SECOND, 3_900_000_000, 4_500_000_000], 3 * SECOND)
    for event in regular_walk([STRIDE] * 2):
        analyzer.add_event(event)
    pulses = pulses_of(analyzer.finish())
    assert [p.onset for p in pulses] == [3 * SECOND, 3_900_000_000]
    assert pulses[0].phase_lag == -0.36
    assert math.isnan(pulses[1].phase_lag)  # its next toe-off was never seen
    assert analyzer.pulse_counts.outside_strides == 1


def disturb(events: list[GaitEvent], data: st.DataObject) -> list[GaitEvent]:
    """Drop, duplicate and displace events."""
    disturbed: list[GaitEvent] = []
    for event in events:
        copies = data.draw(st.sampled_from([1] * 8 + [0, 2]))
        for _ in range(copies):
            back = data.draw(st.sampled_from([0] * 6 + [1, 2, 5]))
            disturbed.insert(max(len(disturbed) - back, 0), event)
    return disturbed


@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.data(), st.sampled_from([ignores, locks]), st.integers(0, 10**6))
def test_interleaving_of_events_and_promises_does_not_matter(data, response, seed) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(seed)
    events, onsets, _ = noisy_walk(rng, response, white, 0.02, counts=(4, 14, 2))
    events = disturb(events, data)
    rule = VerdictSettings(window=5, successive=2)
    expected = analyze(events, onsets, Side.RIGHT, rule)
    # Cut the onsets into adjoining promises, and insert these anywhere among the events.
    end = onsets[-1] + 20 * SECOND
    cuts = sorted(data.draw(st.lists(st.integers(0, end), max_size=12)))
    edges = [-1, *cuts, end]
    promises = [
        ([o for o in onsets if low <= o < high], high) for low, high in itertools.pairwise(edges)
    ]
    places = sorted(data.draw(st.integers(0, len(events))) for _ in promises)
    analyzer = GaitAnalyzer(Side.RIGHT, rule)
    results: list[Result] = []
    for i in range(len(events) + 1):
        for place, promise in zip(places, promises, strict=True):
            if place == i:
                results += analyzer.add_promise(*promise)
        if i < len(events):
            results += analyzer.add_event(events[i])
    results += analyzer.finish()
    # Compared as text, because missing figures are NaN, which equals nothing.
    for kind, wanted in (
        (Stride, expected.strides),
        (PulsePhase, expected.pulses),
        (Entrainment, expected.entrainments),
    ):
        assert repr([r for r in results if isinstance(r, kind)]) == repr(list(wanted))
    assert analyzer.event_counts == expected.event_counts
    assert analyzer.pulse_counts == expected.pulse_counts
    assert expected.pulse_counts.placed + expected.pulse_counts.outside_strides == len(onsets)


def moved(analysis: Analysis, by: int) -> str:
    """Return the results with every stamp moved, as text."""

    def move(result: Result) -> Result:
        stamps = {
            name: getattr(result, name) + by
            for name in ("start", "end", "toe_off", "onset", "stamp")
            if getattr(result, name, None) is not None
        }
        return dataclasses.replace(result, **stamps)

    every: list[Result] = [*analysis.strides, *analysis.pulses, *analysis.entrainments]
    return repr([move(result) for result in every])


@settings(derandomize=True, deadline=None, max_examples=20)
@given(st.integers(-(10**18), 10**18), st.integers(0, 10**6))
def test_only_differences_of_stamps_count(shift: int, seed: int) -> None:
    """Bit for bit, also where a double would resolve no better than 128 ns."""
    events, onsets, _ = noisy_walk(np.random.default_rng(seed), locks, white, 0.01)
    shifted = [dataclasses.replace(e, stamp=e.stamp + shift) for e in events]
    here = analyze(events, onsets, Side.RIGHT)
    there = analyze(shifted, [onset + shift for onset in onsets], Side.RIGHT)
    assert moved(here, shift) == moved(there, 0)
    assert here.entrainments[-1].verdict in tuple(Verdict)


def test_unperturbed_period_is_exact_in_nanoseconds() -> None:
    # The mean of these three is an integer, and their standard error is sqrt(3) ns.
    periods = [1_999_999_998, 2_000_000_001, 2_000_000_004]
    start = 10**18
    onset = start + sum(periods) + SECOND
    analysis = analyze(regular_walk([*periods, STRIDE], start), [onset], Side.RIGHT)
    (entrainment,) = analysis.entrainments
    assert entrainment.unperturbed_period == 2.000000001
    assert math.isclose(entrainment.unperturbed_period_error, math.sqrt(3) * 1e-9, rel_tol=1e-12)


def test_a_lag_is_as_uncertain_as_its_toe_off() -> None:
    events = [
        dataclasses.replace(event, uncertainty=0.001 * event.step)
        for event in regular_walk([STRIDE] * 12)
    ]
    onsets = [event.stamp for event in events if event.kind is EventKind.TOE_OFF][11:20:2]
    pulses = analyze(events, onsets, Side.RIGHT).pulses
    assert len(pulses) == 5
    for pulse in pulses:
        (step,) = {event.step for event in events if event.stamp == pulse.toe_off}
        assert pulse.phase_lag_uncertainty == 0.001 * step


def test_without_toe_offs_lags_count_from_heel_strikes() -> None:
    """A detector may find no toe-offs; a gait is locked, or not, at any event of the stride."""
    events, onsets, _ = noisy_walk(np.random.default_rng(3), locks, white, 0.01)
    strikes = [
        dataclasses.replace(e, uncertainty=0.05) for e in events if e.kind is EventKind.HEEL_STRIKE
    ]
    exact, analysis = (analyze(walk, onsets, Side.RIGHT) for walk in (events, strikes))
    verdicts = [a.entrainments[-1].verdict for a in (exact, analysis)]
    assert verdicts == [Verdict.ENTRAINED] * 2
    stamps = np.array([e.stamp for e in strikes if e.side is Side.RIGHT])
    for pulse in analysis.pulses:
        nearest = stamps[np.argmin(np.abs(pulse.onset - stamps))]
        assert pulse.phase_lag == (pulse.onset - nearest) / SECOND
        assert (pulse.toe_off, pulse.phase_lag_uncertainty) == (None, 0.05)


def test_toe_offs_missing_after_the_first_pulse_leave_lags_unknown() -> None:
    events = regular_walk([STRIDE] * 8)
    found = [e for e in events if e.kind is EventKind.HEEL_STRIKE or e.stamp < 6 * SECOND]
    pulses = analyze(found, [4 * SECOND, 9 * SECOND], Side.RIGHT).pulses
    assert [math.isnan(pulse.phase_lag) for pulse in pulses] == [False, True]
