# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the analyzer: when it is complete, and which doubts it reports."""

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import PulsePhase, Stride, VerdictSettings
from gait_entrainment_bags.messages import MessageError, nanoseconds_of
from gait_entrainment_msgs.msg import AnkleRobotState, GaitEvent, Progress, TorqueProfile
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.nodes.gait_analyzer_run import RESULTS, Run

SECOND = 10**9


def run(measured=False):
    return Run(2, Side.RIGHT, VerdictSettings(), measured=measured)


def gait(strides):
    """Yield the events of a gait with steps of one second, the right leg first."""
    for step in range(2 * strides + 1):
        side = Side.LEFT if step % 2 else Side.RIGHT
        kind = EventKind.HEEL_STRIKE
        yield GaitEvent(header=header(step * SECOND), kind=kind, side=side, step=step)
        toe_off = header(step * SECOND + SECOND // 4)
        kind = EventKind.TOE_OFF
        yield GaitEvent(header=toe_off, kind=kind, side=side.other, step=step + 1)


def promise(begin, until, *onsets):
    times, torques = [to_time(begin)], [0.0]
    values = {"times": times, "torques": torques, "onsets": [to_time(t) for t in onsets]}
    return TorqueProfile(header=header(begin), valid_until=to_time(until), side=1, **values)


def end(instant, events):
    return Progress(header=header(instant), events=events, state=Progress.FINISHED)


def test_run_is_complete_once_events_and_onsets_have_arrived_in_any_order():
    events = list(gait(4))
    for last in ("event", "promise", "end"):
        analyzed = run()
        results = []
        for event in events if last != "event" else events[:-1]:
            results += analyzed.add_event(event)
        if last != "promise":
            results += analyzed.add_profile(promise(0, 9 * SECOND, 3 * SECOND))
        if last != "end":
            analyzed.add_progress(end(9 * SECOND, len(events)))
        assert not analyzed.complete
        if last == "event":
            results += analyzed.add_event(events[-1])
        elif last == "promise":
            results += analyzed.add_profile(promise(0, 9 * SECOND, 3 * SECOND))
        else:
            analyzed.add_progress(end(9 * SECOND, len(events)))
        assert analyzed.complete
        results += analyzed.finish(9 * SECOND)
        strides = [result for result in results if isinstance(result, Stride)]
        assert [stride.period for stride in strides] == [2.0] * 4
        (pulse,) = (result for result in results if isinstance(result, PulsePhase))
        assert (pulse.stride, pulse.phase) == (2, 0.5)


def test_measured_onsets_are_complete_with_the_state_at_the_closing_time():
    analyzed = run(measured=True)
    for event in gait(2):
        analyzed.add_event(event)
    analyzed.add_progress(end(5 * SECOND, 10))
    analyzed.add_profile(promise(0, 5 * SECOND))
    assert not analyzed.complete
    analyzed.add_profile(promise(5 * SECOND, 5 * SECOND))  # without length: the run is closed
    assert not analyzed.complete
    analyzed.add_state(AnkleRobotState(header=header(5 * SECOND)))
    assert analyzed.complete


def test_doubts_are_reported_once_each_time_their_number_grows():
    analyzed = run()
    events = list(gait(3))
    for event in events[:4]:
        analyzed.add_event(event)
        assert analyzed.new_doubts() == {}
    analyzed.add_event(events[3])
    assert sum(analyzed.new_doubts().values()) == 1
    analyzed.add_event(events[4])
    assert analyzed.new_doubts() == {}
    analyzed.add_event(events[4])
    assert sum(analyzed.new_doubts().values()) == 2


def test_message_of_a_result_carries_the_run():
    analyzed = run()
    results = [result for event in gait(1) for result in analyzed.add_event(event)]
    (stride,) = results
    message = analyzed.message_of(stride)
    assert type(message) is RESULTS[Stride].type
    assert (message.run, message.side, message.number) == (2, Side.RIGHT, 1)
    assert nanoseconds_of(message.header.stamp) == 2 * SECOND
    assert nanoseconds_of(message.start) == 0


def test_stop_voids_what_was_promised():
    analyzed = run()
    analyzed.add_profile(promise(0, 6 * SECOND, 3 * SECOND, 5 * SECOND))
    analyzed.add_profile(TorqueProfile(header=header(4 * SECOND), stop=True))
    results = [result for event in gait(4) for result in analyzed.add_event(event)]
    results += analyzed.finish(9 * SECOND)
    assert [r.onset for r in results if isinstance(r, PulsePhase)] == [3 * SECOND]


def test_profiles_that_do_not_adjoin_are_reported_as_a_hole():
    analyzed = run()
    analyzed.add_profile(promise(0, 2 * SECOND))
    analyzed.add_profile(promise(4 * SECOND, 6 * SECOND))
    assert analyzed.new_doubts()["holes"] == 1
    assert analyzed.new_doubts() == {}
    analyzed.add_profile(TorqueProfile(header=header(5 * SECOND), stop=True))
    analyzed.add_profile(promise(8 * SECOND, 9 * SECOND))  # after a stop nothing is owed
    assert analyzed.new_doubts() == {}


def test_an_impossible_promise_does_not_hide_later_ones():
    analyzed = run()
    profiles = promise(0, 2 * SECOND), promise(2 * SECOND, 10**15), promise(4 * SECOND, 9 * SECOND)
    profiles[2].onsets = [to_time(5 * SECOND)]
    for revision, profile in enumerate(profiles):
        profile.revision = revision
        analyzed.add_profile(profile)
    results = [result for event in gait(4) for result in analyzed.add_event(event)]
    results += analyzed.finish(9 * SECOND)
    assert [r.onset for r in results if isinstance(r, PulsePhase)] == [5 * SECOND]


def test_strides_beyond_the_last_profile_are_a_hole():
    analyzed = run()
    analyzed.add_profile(promise(0, 3 * SECOND, SECOND))
    for event in gait(4):
        analyzed.add_event(event)
    analyzed.finish(9 * SECOND)
    assert analyzed.new_doubts()["holes"] == 1


def test_joining_late_is_a_hole():
    analyzed = run()
    late = promise(6 * SECOND, 8 * SECOND)
    late.revision = 3
    analyzed.add_profile(late)
    assert analyzed.new_doubts()["holes"] == 1


def test_an_event_of_an_unknown_kind_or_side_is_a_one_line_error():
    for values in ({"kind": 7}, {"side": 2}):
        with pytest.raises(MessageError, match=f"^{next(iter(values))}: "):
            run().add_event(GaitEvent(header=header(0), **values))
