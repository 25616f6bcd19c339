# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the experiment, without nodes: its promises, and which node is blamed for what."""

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.experiment import Conductor, Part
from gait_entrainment.protocol import Protocol, PulsePlan
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs.msg import GaitEvent, Progress, TorqueProfile, Trouble
from gait_entrainment_nodes.messaging.goals import seal_of
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.messaging.topics import EXPERIMENT_STATE, HORIZON
from gait_entrainment_nodes.nodes.experiment_run import ExperimentError, Run

SECOND = 10**9
HALF = SECOND // 2
TIMEOUT = 3.0
PROTOCOL = Protocol(baseline=2, pulses=PulsePlan(count=1), washout=1)


class Bench:
    """Walker and perturbator around a run, on their own clock."""

    def __init__(self, **kind):
        self.now = 100.0
        self.published, self.trains = [], []
        self.run = Run(
            7,
            lambda topic, message: self.published.append((topic, message)),
            self.trains.append,
            **({"recorded": False} | kind),
            clock=lambda: self.now,
        )
        self.events = self.grant = 0

    def begin(self):
        self.run.begin(Conductor(PROTOCOL, 0.5), 10 * SECOND)

    @property
    def horizons(self):
        return [message for topic, message in self.published if topic is HORIZON]

    def strike(self, instant):
        """Let a leg strike; legs alternate, the right one is perturbed."""
        self.events += 1
        step = self.events - 1
        side = Side.LEFT if step % 2 else Side.RIGHT
        event = GaitEvent(header=header(instant), run=7, kind=EventKind.HEEL_STRIKE, side=side)
        event.step = step
        self.run.take_event(event)

    def report(self, instant, events=None, state=Progress.WALKING, **values):
        """Let the walker report progress up to a time."""
        events = self.events if events is None else events
        message = Progress(header=header(instant), grant=self.grant, events=events, state=state)
        for name, value in values.items():
            setattr(message, name, value)
        self.grant += 1
        self.run.take_progress(message)

    def promise(self, **values):
        """Let the perturbator answer, by default up to the horizon."""
        profile = TorqueProfile(
            run=7, side=Side.RIGHT, valid_until=to_time(self.run.promised_until)
        )
        for name, value in values.items():
            setattr(profile, name, value)
        self.run.take_profile(profile)

    def after(self, seconds):
        """Let time pass; return the failure of the run, if it has failed."""
        self.now += seconds
        self.run.check(TIMEOUT)
        return self.run.failure

    def walk_to_planning(self):
        """Walk until the pulses have been requested; return the time of the next strike."""
        instant = 10 * SECOND
        while not self.trains:
            self.promise()
            self.strike(instant)
            self.report(instant)
            instant += HALF
        return instant


@pytest.fixture
def bench():
    bench = Bench()
    bench.begin()
    return bench


def blamed(failure):
    return str(failure), failure.node


def test_each_progress_is_answered_once_everything_that_it_covers_has_arrived(bench):
    (first,) = bench.horizons
    assert (first.run, first.last) == (7, False)
    assert first.seal == seal_of(bench.run.key)
    assert nanoseconds_of(first.header.stamp) == 10 * SECOND
    assert nanoseconds_of(first.until) == 10 * SECOND + HALF
    bench.promise()
    bench.report(10 * SECOND + HALF, events=1)
    assert len(bench.horizons) == 1  # an event is still on its way
    bench.strike(10 * SECOND)
    assert nanoseconds_of(bench.horizons[-1].until) == 11 * SECOND
    assert bench.run.known_until == 10 * SECOND + HALF
    # In real time progress goes on while nothing new can be promised.
    bench.report(10 * SECOND + HALF)
    assert len(bench.horizons) == 2
    shown = [message for topic, message in bench.published if topic is EXPERIMENT_STATE]
    assert [state.phase for state in shown] == [Part.BASELINE]


def test_nothing_is_promised_while_pulses_are_requested(bench):
    instant = bench.walk_to_planning()
    (train,) = bench.trains
    assert len(train.pulses) == 1
    count = len(bench.horizons)
    bench.promise()
    bench.report(instant - HALF)
    assert len(bench.horizons) == count
    bench.run.take_answer(True)
    assert len(bench.horizons) == count + 1
    state = bench.run.state(Part.PULSES)
    assert state.pulse_period == bench.run.conductor.block.pulse_period
    assert nanoseconds_of(state.first_onset) == train.onsets[0]
    assert (state.block, state.blocks, state.block_name) == (1, 1, "paper_example")


def test_perturbator_that_does_not_answer_is_named(bench):
    assert bench.after(TIMEOUT) is None
    assert blamed(bench.after(0.1)) == ("perturbator has been silent for 3 s", "perturbator")


def test_a_profile_beyond_the_horizon_does_not_hide_silence(bench):
    bench.promise(valid_until=to_time(1000 * SECOND))
    assert bench.after(TIMEOUT - 0.1) is None
    bench.strike(10 * SECOND)
    bench.report(10 * SECOND + HALF)
    failure = bench.after(TIMEOUT + 0.1)
    assert blamed(failure) == ("perturbator has been silent for 3 s", "perturbator")


def test_perturbator_that_does_not_answer_a_request_is_named(bench):
    bench.walk_to_planning()
    assert bench.after(TIMEOUT) is None
    assert blamed(bench.after(0.1)) == ("perturbator has been silent for 3 s", "perturbator")


def test_walker_that_falls_silent_is_named(bench):
    bench.after(2.0)
    bench.promise()  # from here on it is the walker's turn
    assert bench.after(TIMEOUT) is None
    assert blamed(bench.after(0.1)) == ("walker_sim has been silent for 3 s", "walker_sim")


def test_walker_that_counts_events_that_never_arrive_is_named(bench):
    bench.promise()
    bench.strike(10 * SECOND)
    for _ in range(4):  # further reports do not make up for them
        bench.report(10 * SECOND + HALF, events=3)
        bench.after(1.0)
    expected = "walker_sim: 2 of 3 gait events missing for 3 s"
    assert blamed(bench.after(0.1)) == (expected, "walker_sim")


def test_recorder_is_named_if_the_walker_waits_for_it():
    bench = Bench(recorded=True)
    bench.begin()
    bench.promise()
    bench.strike(10 * SECOND)
    bench.report(10 * SECOND + HALF)
    bench.promise()
    bench.after(2.0)
    for recorded in (10 * SECOND + HALF, 1000 * SECOND):  # the latter is not possible yet
        bench.run.take_recorder_progress(Progress(run=7, header=header(recorded)))
    bench.report(11 * SECOND)
    bench.promise()
    assert bench.after(TIMEOUT) is None
    assert blamed(bench.after(0.1)) == ("bag_recorder has been silent for 3 s", "bag_recorder")


def test_in_real_time_silence_of_each_node_is_noticed_separately():
    bench = Bench(real_time=True)
    bench.begin()
    # A robot reports its torque piece by piece, behind the horizon; the walker is silent.
    for piece in range(1, 4):
        bench.promise(valid_until=to_time(10 * SECOND + piece * SECOND // 10))
        assert bench.after(1.0) is None
    assert blamed(bench.after(0.1)) == ("walker_sim has been silent for 3 s", "walker_sim")
    bench = Bench(real_time=True)
    bench.begin()
    bench.promise(valid_until=to_time(10 * SECOND + 1))
    for k in range(3):  # the walk goes on, but the robot reports no more
        bench.report((10 + k) * SECOND)
        assert bench.after(1.0) is None
    assert blamed(bench.after(0.1)) == ("perturbator has been silent for 3 s", "perturbator")


@pytest.mark.parametrize(("ahead", "believed"), [(0.09, True), (0.11, False), (3600.0, False)])
def test_in_real_time_stamps_too_far_ahead_are_not_believed(monkeypatch, ahead, believed):
    monkeypatch.setattr("time.time_ns", lambda: 9 * SECOND)  # the walk begins later
    bench = Bench(real_time=True)
    bench.begin()
    bench.promise()
    bench.strike(round((10 + ahead) * SECOND))  # the very first, so no stride is too long
    bench.now += 0.5
    bench.strike(10 * SECOND + SECOND // 2)
    bench.now += 0.5
    bench.strike(round((11 + ahead) * SECOND))
    assert bench.run.failure is None
    assert bench.run.conductor.strides == believed
    bench.report(round((11 + ahead) * SECOND))
    if not believed:
        expected = (
            f"walker_sim reports progress {ahead - 0.1:.3g} s beyond what is possible by now"
        )
        assert blamed(bench.run.failure) == (expected, "walker_sim")


def test_in_lock_step_the_walk_goes_no_further_than_was_promised(bench):
    bench.promise()
    bench.strike(10 * SECOND)
    bench.report(10 * SECOND + HALF)
    promised = bench.run.promised_until
    bench.report(9 * SECOND)  # nor backwards
    assert (bench.run.known_until, bench.run.promised_until) == (10 * SECOND + HALF, promised)
    bench.report(3600 * SECOND)
    words, node = blamed(bench.run.failure)
    assert words.startswith("walker_sim reports progress 3.59e+03 s beyond what is possible")
    assert node == "walker_sim"


def test_a_walker_that_ends_before_the_protocol_has_failed(bench):
    bench.promise()
    bench.strike(10 * SECOND)
    bench.report(10 * SECOND + HALF, state=Progress.FINISHED)
    expected = "walker_sim ended the run after 0 strides of 4"
    assert blamed(bench.run.failure) == (expected, "walker_sim")


@pytest.mark.parametrize("pace", [1.0, 0.9, 0.0, -1.0])
def test_a_walk_that_stands_still_or_lags_counts_as_silent(monkeypatch, pace):
    monkeypatch.setattr("time.time_ns", lambda: 10 * SECOND)
    bench = Bench(real_time=True)
    bench.begin()
    for tick in range(100):
        bench.report(round((10 + pace * tick) * SECOND))
        bench.promise()
        if bench.after(1.0):
            break
    if pace == 1.0:
        assert bench.run.failure is None
    else:
        assert blamed(bench.run.failure) == ("walker_sim has been silent for 3 s", "walker_sim")
        assert (1 - pace) * tick < 0.5 + TIMEOUT + 1.0 + 0.1


def test_a_source_may_count_from_before_the_run_was_requested(monkeypatch):
    monkeypatch.setattr("time.time_ns", lambda: 20 * SECOND)
    bench = Bench(real_time=True)
    bench.begin()
    bench.promise()
    bench.report(20 * SECOND)
    assert bench.run.failure is None


def test_silence_starts_again_after_this_process_was_held_up(bench):
    bench.now += 10.0
    bench.run.forgive()
    assert bench.after(TIMEOUT) is None
    assert bench.after(0.1) is not None


def test_fault_ends_the_run_with_the_message_of_the_perturbator(bench):
    latched = Trouble(kind=Trouble.LATCHED, fault="stopped", message="latched: stopped: by hand")
    bench.run.take_trouble(latched)
    assert blamed(bench.run.failure) == ("perturbator: latched: stopped: by hand", "")


@pytest.mark.parametrize("stop_first", [True, False])
def test_reason_for_refused_pulses_may_come_before_or_after_the_answer(bench, stop_first):
    bench.walk_to_planning()
    refused = Trouble(kind=Trouble.REFUSED, message="pulse train rejected: torque: too much")
    if stop_first:
        bench.run.take_answer(False)
        assert bench.after(0.4) is None
        bench.run.take_trouble(refused)
    else:
        bench.run.take_trouble(refused)
        bench.run.take_answer(False)
    expected = "perturbator: pulse train rejected: torque: too much"
    assert blamed(bench.after(0.0)) == (expected, "")


def test_refusal_of_another_clients_pulses_does_not_matter(bench):
    refused = Trouble(kind=Trouble.REFUSED, message="pulse train rejected: one at a time")
    bench.run.take_trouble(refused)
    assert bench.run.trouble == ""
    bench.walk_to_planning()
    bench.run.take_trouble(refused)
    bench.run.take_answer(True)
    bench.run.fail_if_troubled()


def test_stop_without_a_reason_is_reported_after_a_while(bench):
    bench.promise(stop=True)
    assert bench.after(0.4) is None
    message, node = blamed(bench.after(0.2))
    assert "gave no reason" in message
    assert node == "perturbator"


def test_trouble_before_the_walker_has_started_is_kept():
    bench = Bench()
    bench.run.take_trouble(Trouble(kind=Trouble.REFUSED, message="no such motor"))
    error = bench.run.trouble_error(" refused to be configured")
    assert blamed(error) == ("perturbator refused to be configured: no such motor", "")
    bench.begin()
    assert bench.horizons == []
    assert blamed(bench.run.failure) == ("perturbator: no such motor", "")


def test_closing_horizon_ends_where_the_promises_end(bench):
    bench.promise()
    bench.strike(10 * SECOND)
    final = 10 * SECOND + HALF
    bench.report(final, state=Progress.FELL, reproducible=True)
    assert bench.run.over
    assert bench.run.final.reproducible
    bench.run.close()
    closing = bench.horizons[-1]
    assert closing.last
    assert nanoseconds_of(closing.until) == nanoseconds_of(closing.header.stamp) == final
    assert not bench.run.closed
    bench.promise()
    assert bench.run.closed
    bench.run.fail_if_troubled()


def test_stop_after_the_walkers_last_report_fails_the_run(bench):
    bench.promise()
    bench.strike(10 * SECOND)
    bench.report(10 * SECOND + HALF, state=Progress.FELL)
    bench.run.close()
    bench.promise(stop=True)
    assert not bench.run.closed
    bench.run.take_trouble(Trouble(kind=Trouble.LATCHED, message="latched: over_current: hot"))
    bench.promise()
    assert bench.run.closed
    with pytest.raises(ExperimentError, match="perturbator: latched: over_current"):
        bench.run.fail_if_troubled()


def test_impossible_pulses_fail_the_run():
    bench = Bench()
    pulses = PulsePlan(count=5, width=0.9, period_offset=-0.2)
    bench.run.begin(Conductor(Protocol(baseline=2, pulses=pulses), 0.5), 10 * SECOND)
    instant = 10 * SECOND
    while not bench.run.over:
        bench.promise()
        bench.strike(instant)
        bench.report(instant)
        instant += HALF
    assert bench.run.failure.node == ""
    assert "overlap" in str(bench.run.failure)


def test_only_the_first_failure_of_a_run_is_kept(bench):
    bench.run.fail(ExperimentError("first"))
    bench.run.fail(ExperimentError("second"))
    assert str(bench.run.failure) == "first"
    assert bench.after(10.0) is bench.run.failure
