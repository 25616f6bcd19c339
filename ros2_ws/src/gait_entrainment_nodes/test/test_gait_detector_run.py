# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the gait detector: numbers of events, progress that stays true, and the end."""

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs.msg import Progress
from gait_entrainment_nodes.nodes.gait_detector_run import Run
from gait_entrainment_sensors import Detection

SECOND = 10**9
START = 1000 * SECOND
LATENCY = 0.1
NAMES = ("left detector", "right detector")


def gait(strides, late):
    """Yield the detections of a gait with strides of 1 s; ``late`` is the delay of each [s]."""
    delays = iter(late)
    for step in range(2 * strides):
        for kind, side, at in (
            (EventKind.HEEL_STRIKE, Side(1 - step % 2), 0.5 * step + 0.01),
            (EventKind.TOE_OFF, Side(step % 2), 0.5 * step + 0.13),
        ):
            yield Detection(kind, side, at, at + next(delays), 0.004)


def stamps(messages):
    return [nanoseconds_of(message.header.stamp) for message in messages]


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0, 0.99 * LATENCY), min_size=40, max_size=40), st.integers(1, 400))
def test_no_event_comes_after_the_progress_that_covers_it(late, pieces):
    run, found = Run(3, START, LATENCY, START), list(gait(10, late))
    heard, covered = [], START
    for piece in range(1, pieces + 1):
        now = 12 * piece / pieces
        arrived = [d for d in found if d.detected_at <= now]
        found = [d for d in found if d.detected_at > now]
        events = run.events_of(arrived, NAMES)
        assert all(stamp > covered or run.grant == 0 for stamp in stamps(events))
        heard += events
        progress = run.progress_at(START + round(now * SECOND))
        covered = nanoseconds_of(progress.header.stamp)
        assert (progress.events, progress.grant) == (len(heard), piece - 1)
    assert run.late == 0
    assert len(heard) == 40
    assert [e.detector for e in heard[:2]] == [NAMES[1], NAMES[0]]
    assert {(e.run, e.source, e.uncertainty) for e in heard} == {(3, "gait_detector", 0.004)}
    for event, delay in zip(sorted(heard, key=lambda e: stamps([e])), late, strict=True):
        reported = nanoseconds_of(event.detected_at) - stamps([event])[0]
        assert abs(reported - delay * SECOND) < 10
    # Heel strike n closes step n, and strides of a side are two steps apart.
    strikes = [e.step for e in heard if e.kind == EventKind.HEEL_STRIKE and e.side == Side.RIGHT]
    assert strikes == list(range(0, 20, 2))


def test_an_event_that_comes_after_the_progress_that_covers_it_is_counted_as_late():
    run = Run(1, START, LATENCY, START)
    on_time = Detection(EventKind.HEEL_STRIKE, Side.RIGHT, 0.2, 0.3, 0.0)
    late = Detection(EventKind.TOE_OFF, Side.LEFT, 0.32, 0.9, 0.0)
    assert len(run.events_of([on_time], NAMES)) == 1
    run.progress_at(START + SECOND)
    assert len(run.events_of([late], NAMES)) == 1
    assert run.late == 1


def test_events_before_the_start_are_not_counted():
    run = Run(1, START + SECOND, LATENCY, START)
    assert not run.events_of([Detection(EventKind.HEEL_STRIKE, Side.RIGHT, 0.5, 0.6, 0.0)], NAMES)
    (first,) = run.events_of([Detection(EventKind.HEEL_STRIKE, Side.LEFT, 1.1, 1.2, 0.0)], NAMES)
    assert first.step == 0


def test_it_ends_where_the_experiment_says_once_everything_up_to_there_is_known():
    run = Run(1, START, LATENCY, START)
    run.end = START + SECOND
    assert run.progress_at(START + SECOND).state == Progress.WALKING
    final = run.progress_at(START + SECOND + SECOND // 5)
    assert (final.state, nanoseconds_of(final.header.stamp)) == (Progress.FINISHED, run.end)


def test_the_outcome_of_a_simulated_walk_is_passed_on():
    run = Run(1, START, LATENCY, START)
    walking = run.progress_behind(Progress(), START + SECOND)
    assert nanoseconds_of(walking.header.stamp) == START + SECOND - SECOND // 10
    fell = Progress(state=Progress.FELL, message="The walker fell", reproducible=True)
    final = run.progress_behind(fell, START + 2 * SECOND)
    assert (final.state, final.message, final.reproducible) == (fell.state, fell.message, True)
    assert nanoseconds_of(final.header.stamp) == START + 2 * SECOND
    assert run.aborted().state == Progress.ABORTED
