# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the walker: promises in time, late, missing, stopped; without a node."""

import math
import time

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.robot import TorqueProfile
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs.msg import Progress
from gait_entrainment_nodes.nodes.walker_run import Stretch, WalkerRun
from gait_entrainment_nodes.nodes.walker_sim_run import LockStepRun, RealTimeRun, Starved

SECOND = 10**9
START = 946_684_800 * SECOND
MILLISECOND = 10**6


def walker(rate=100.0):
    return WalkerRun(WalkerParameters(), Side.RIGHT, rate)


def profile(begin, until, torque=0.0):
    return TorqueProfile(Side.RIGHT, (begin,), (torque,), (), until)


def closing(until):
    """Return a profile without length, which only gives the end of the run."""
    return TorqueProfile(Side.RIGHT, (until,), (0.0,), (), until)


class Clock:
    now = 0

    def __call__(self):
        return self.now


def lock_step(acknowledged=False):
    return LockStepRun(3, walker(), START, acknowledged=acknowledged)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def real_time(clock):
    return RealTimeRun(3, walker(), START, due_at=SECOND, clock=clock)


def test_each_promised_stretch_is_walked_immediately_and_reported():
    run = lock_step()
    assert run.due() is None
    run.promise(profile(0, SECOND), False)
    run.promise(profile(SECOND, 3 * SECOND), False)
    assert run.due() == 0.0
    first, report, second, further = run.walk()
    assert isinstance(first, Stretch)
    assert len(first.sample_times) == 100
    assert (report.run, report.grant, report.state) == (3, 0, Progress.WALKING)
    assert nanoseconds_of(report.header.stamp) == START + SECOND
    assert report.samples == 100
    assert (further.grant, further.samples) == (1, 300)
    assert further.events == len(first.transitions) + len(second.transitions) > 0
    assert report.reproducible
    assert run.due() is None


def test_walker_waits_for_the_recorder_to_acknowledge():
    run = lock_step(acknowledged=True)
    for second in range(4):
        run.promise(profile(second * SECOND, (second + 1) * SECOND), False)
    grants = [item.grant for item in run.walk() if isinstance(item, Progress)]
    assert grants == [0, 1]
    assert run.due() is None
    run.acknowledge(Progress(grant=0))
    assert [item.grant for item in run.walk() if isinstance(item, Progress)] == [2]
    run.acknowledge(Progress(grant=2))
    assert [item.grant for item in run.walk() if isinstance(item, Progress)] == [3]


def test_profile_without_length_ends_the_run():
    run = lock_step()
    run.promise(profile(0, SECOND), False)
    run.promise(closing(SECOND), True)
    *_, report = run.walk()
    assert (report.state, report.message) == (Progress.FINISHED, "")
    run.promise(profile(SECOND, 2 * SECOND), False)
    assert run.due() is None
    timing = run.timing()
    assert (timing.late_stretches, timing.starved_stretches, timing.samples) == (0, 0, 0)
    assert math.isnan(timing.publish_late_p50)


def test_gap_between_promises_is_refused():
    run = lock_step()
    run.promise(profile(0, SECOND), False)
    with pytest.raises(ValueError, match="adjoin"):
        run.promise(profile(2 * SECOND, 3 * SECOND), False)


def test_a_promise_that_ends_before_the_time_reached_does_not_move_the_walk():
    run = lock_step()
    run.promise(profile(0, SECOND), False)
    list(run.walk())
    run.promise(closing(-(10**18)), False)
    *_, report = run.walk()
    assert nanoseconds_of(report.header.stamp) == START + SECOND


def test_a_promise_of_hours_is_refused():
    for message in profile(SECOND, 3600 * SECOND), closing(3600 * SECOND):
        run = lock_step()
        run.promise(profile(0, SECOND), False)
        with pytest.raises(ValueError, match=r"a profile of 3.6e\+03 s; allowed: 1e\+03 s"):
            run.promise(message, True)


def test_stop_ends_the_torque_and_is_remembered():
    run = lock_step()
    run.promise(profile(0, 2 * SECOND, torque=5.0), False)
    run.stop(SECOND + 5 * MILLISECOND)
    stretch, report = run.walk()
    torque = stretch.samples.delivered_torque[:, Side.RIGHT]
    assert set(torque[1:101]) == {5.0}
    assert set(torque[101:]) == {0.0}
    assert not report.reproducible


def test_a_fall_and_a_shutdown_are_reported():
    run = lock_step()
    run.promise(profile(0, 30 * SECOND, torque=-30.0), False)
    *_, report = run.walk()
    assert report.state == Progress.FELL
    assert "fell" in report.message
    assert run.due() is None
    aborted = lock_step().progress(aborted=True)
    assert (aborted.state, aborted.message) == (Progress.ABORTED, "walker_sim was shut down")


def test_in_real_time_nothing_comes_before_it_is_due(real_time, clock):
    assert real_time.due() == 1.0
    real_time.promise(profile(0, SECOND), False)
    assert list(real_time.walk()) == []
    assert real_time.due() == 0.999
    clock.now = SECOND + 15 * MILLISECOND
    stretch, report = real_time.walk()
    assert list(stretch.sample_times) == [0, 10 * MILLISECOND]
    assert report.grant == 0
    # The next sample is due with the next report.
    assert real_time.due() == 1.019
    clock.now = SECOND + 20 * MILLISECOND
    stretch, report = real_time.walk()
    assert list(stretch.sample_times) == []  # torque at 20 ms belongs to what follows
    clock.now = SECOND + 25 * MILLISECOND
    (stretch,) = real_time.walk()
    assert list(stretch.sample_times) == [20 * MILLISECOND]
    assert report.reproducible
    timing = real_time.timing()
    assert timing.samples == 3
    assert timing.publish_late_worst == pytest.approx(0.015)


def test_in_real_time_a_promised_stretch_is_walked_before_it_is_due(real_time, clock):
    real_time.promise(profile(0, 15 * MILLISECOND, torque=5.0), False)
    clock.now = SECOND - MILLISECOND
    walk = real_time.walk()
    assert list(next(walk).sample_times) == [0]
    clock.now = SECOND + 100_000  # it has been sent
    (report,) = walk
    assert report.samples == 1
    assert real_time.due() == pytest.approx(1.009)
    clock.now = SECOND + 9 * MILLISECOND
    (stretch,) = real_time.walk()
    assert list(stretch.sample_times) == [10 * MILLISECOND]
    # A stop acts from where the walk has got to; nothing is promised for the next sample.
    real_time.stop(9 * MILLISECOND)
    assert real_time.due() == 1.02
    clock.now = SECOND + 20 * MILLISECOND
    list(real_time.walk())
    timing = real_time.timing()
    assert timing.publish_late_worst == pytest.approx(0.0001)
    assert timing.starved == pytest.approx(0.005)


def test_a_stretch_walked_early_waits_until_it_is_due():
    begin = time.monotonic_ns()
    run = RealTimeRun(3, walker(), START, due_at=begin + 20 * MILLISECOND)
    run.promise(profile(0, SECOND), False)
    run.walker.advance(1)
    run.wait()
    assert time.monotonic_ns() >= begin + 20 * MILLISECOND


def test_stretch_without_a_promise_is_walked_without_torque_and_counted_once(real_time, clock):
    real_time.promise(profile(0, 95 * MILLISECOND, torque=5.0), False)
    reported = []
    for millisecond in (95, 145, 205, 295):
        clock.now = SECOND + millisecond * MILLISECOND
        reported += real_time.walk()
    assert [item.length for item in reported if isinstance(item, Starved)] == [50 * MILLISECOND]
    assert not reported[-1].reproducible
    torques = [t for s in reported if isinstance(s, Stretch) for t in s.samples.delivered_torque]
    assert [torque[Side.RIGHT] for torque in torques][1:] == [5.0] * 9 + [0.0] * 20
    # What is promised now is too late for its first part; only the rest is walked.
    late = real_time.promise(profile(95 * MILLISECOND, SECOND, torque=7.0), False)
    assert late == 200 * MILLISECOND
    clock.now = SECOND + 345 * MILLISECOND
    stretch, *_ = real_time.walk()
    assert {torque[Side.RIGHT] for torque in stretch.samples.delivered_torque} == {7.0}
    timing = real_time.timing()
    assert (timing.late_stretches, timing.starved_stretches) == (1, 1)
    assert (timing.late, timing.starved) == (0.2, 0.2)


def test_run_in_real_time_ends_when_its_end_is_due(real_time, clock):
    real_time.promise(profile(0, SECOND), False)
    real_time.promise(closing(SECOND), True)
    clock.now = 2 * SECOND - 1
    *_, report = real_time.walk()
    assert report.state == Progress.WALKING
    assert real_time.due() == 2.0
    clock.now = 3 * SECOND
    *_, report = real_time.walk()
    assert report.state == Progress.FINISHED
    assert nanoseconds_of(report.header.stamp) == START + SECOND
    assert report.samples == 100


def test_end_that_comes_late_is_moved_to_now(real_time, clock):
    real_time.promise(profile(0, SECOND), False)
    clock.now = 2 * SECOND + 500 * MILLISECOND
    list(real_time.walk())
    real_time.promise(closing(SECOND), True)
    *_, report = real_time.walk()
    assert report.state == Progress.FINISHED
    assert nanoseconds_of(report.header.stamp) == START + 1500 * MILLISECOND
