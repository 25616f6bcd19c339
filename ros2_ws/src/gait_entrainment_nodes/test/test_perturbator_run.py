# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the ankle robot behind its guard: promises, and how trains end; without a node."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    LimitError,
    Pulse,
    PulseTrain,
    RobotState,
    Shape,
    TorqueProfile,
    find_driver,
    make_robots,
)
from gait_entrainment.robot.faults import TORQUE_EXCEEDED
from gait_entrainment_bags.messages import MessageError, nanoseconds_of, train_of
from gait_entrainment_msgs.msg import AnkleRobotState
from gait_entrainment_nodes.messaging.goals import goal_of, seal_of
from gait_entrainment_nodes.messaging.topics import PULSES, TORQUE_PROFILE
from gait_entrainment_nodes.nodes.perturbator_run import Result, Run

SECOND = 10**9
KEY = "of the experiment"
TRAIN = PulseTrain.periodic(
    side=Side.RIGHT, first_onset=3 * SECOND, period=1.0, count=2, torque=5.0, duration=0.1
)


class Bench:
    """A robot and what its run publishes."""

    def __init__(self, driver="ideal"):
        self.robot = find_driver(driver).make(Side.RIGHT, DeviceLimits(), 0)
        self.robot.configure()
        self.robot.activate()
        self.profiles, self.pulses, self.states, self.ended = [], [], [], []
        robots = {Side.RIGHT: self.robot}
        end = lambda result, _: self.ended.append(result)  # noqa: E731
        self.run = Run(4, seal_of(KEY), SECOND, robots, self.publish, end)

    def publish(self, topic, message):
        assert message.run == 4
        lists = {TORQUE_PROFILE.name: self.profiles, PULSES.name: self.pulses}
        lists.get(topic.name, self.states).append(message)

    def outcomes(self):
        return [(result.outcome, result.delivered, result.message) for result in self.ended]


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    bench.robot.close()


def test_horizons_are_answered_with_adjoining_promises(bench):
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    bench.run.schedule(TRAIN, KEY)
    bench.run.take_horizon(2 * SECOND, 4 * SECOND, last=True)
    idle, pulse = bench.profiles
    assert [profile.revision for profile in bench.profiles] == [0, 1]
    assert nanoseconds_of(idle.valid_until) == nanoseconds_of(pulse.header.stamp) == 2 * SECOND
    assert list(idle.torques) == [0.0]
    assert list(pulse.torques) == [0.0, 5.0, 0.0]
    assert [nanoseconds_of(onset) for onset in pulse.onsets] == [3 * SECOND]
    assert (idle.last, pulse.last, pulse.side) == (False, True, Side.RIGHT)
    (announced,) = bench.pulses
    assert (announced.number, announced.torque, announced.duration) == (1, 5.0, 0.1)
    assert bench.ended == []


def test_a_horizon_years_ahead_is_refused_and_promises_nothing(bench):
    with pytest.raises(LimitError, match=r"until: .* s ahead; allowed: at most 60 s"):
        bench.run.take_horizon(SECOND, 10**9 * SECOND, last=False)
    assert (bench.profiles, bench.robot.promised_until) == ([], SECOND)


def test_an_onset_that_belongs_to_no_train_is_not_announced(bench):
    profile = TorqueProfile(Side.RIGHT, (SECOND,), (0.0,), (SECOND,), 2 * SECOND)
    bench.robot._robot.promise = lambda _: profile
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    assert (len(bench.profiles), bench.pulses) == (1, [])


def test_train_is_delivered_once_its_last_pulse_is_promised(bench):
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    bench.run.schedule(TRAIN, KEY)
    bench.run.take_horizon(2 * SECOND, 5 * SECOND, last=False)
    assert bench.outcomes() == [(Result.DELIVERED, 2, "every pulse was delivered")]
    assert [pulse.number for pulse in bench.pulses] == [1, 2]
    assert {state.status for state in bench.states} == {AnkleRobotState.ACTIVE}


def test_train_beyond_the_limits_is_refused_and_changes_nothing(bench):
    too_much = PulseTrain.periodic(
        side=Side.RIGHT, first_onset=3 * SECOND, period=1.0, count=1, torque=1e3, duration=0.1
    )
    with pytest.raises(LimitError, match="torque"):
        bench.run.schedule(too_much, KEY)
    bench.run.take_horizon(SECOND, 5 * SECOND, last=False)
    assert list(bench.profiles[0].torques) == [0.0]
    # No torque was due, so there is none to stop.
    bench.run.end_torque(Result.STOPPED, "the perturbator was deactivated")
    assert not any(profile.stop for profile in bench.profiles)


def test_cancelling_stops_the_torque_at_the_latest_known_time(bench):
    bench.run.schedule(TRAIN, KEY)
    bench.run.take_horizon(2 * SECOND, 4 * SECOND, last=False)
    bench.run.end_torque(Result.CANCELLED, "cancelled by the client")
    assert bench.outcomes() == [(Result.CANCELLED, 1, "cancelled by the client")]
    stop = bench.profiles[-1]
    assert stop.stop
    assert nanoseconds_of(stop.header.stamp) == 2 * SECOND
    assert nanoseconds_of(stop.valid_until) == 4 * SECOND
    last = bench.states[-1]
    assert (last.commanded_torque, nanoseconds_of(last.header.stamp)) == (0.0, 2 * SECOND)
    # Reported once; what is promised afterwards has no torque.
    bench.run.end_torque(Result.STOPPED, "again")
    assert bench.profiles[-1] is stop
    bench.run.take_horizon(4 * SECOND, 6 * SECOND, last=False)
    assert list(bench.profiles[-1].torques) == [0.0]
    assert bench.profiles[-1].revision == stop.revision + 1


def test_closing_horizon_gets_a_profile_without_length_and_ends_the_train(bench):
    bench.run.schedule(TRAIN, KEY)
    bench.run.take_horizon(SECOND, 4 * SECOND, last=False)
    bench.run.take_horizon(4 * SECOND, 4 * SECOND, last=True)
    assert bench.run.closed
    assert bench.outcomes() == [(Result.ENDED, 1, "the run ended before the last pulse")]
    closing = bench.profiles[-1]
    assert closing.last
    assert not closing.stop
    assert [nanoseconds_of(t) for t in closing.times] == [4 * SECOND]
    assert nanoseconds_of(closing.valid_until) == 4 * SECOND
    # Nothing is left to stop.
    count = len(bench.profiles)
    bench.run.end_torque(Result.STOPPED, "the perturbator was deactivated")
    assert len(bench.profiles) == count


def test_fault_is_reported_to_the_walker_even_if_no_torque_was_due(bench):
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    bench.robot.stop()
    bench.run.end_torque(Result.STOPPED, "the stop service was called", fault=True)
    assert bench.profiles[-1].stop
    state = bench.states[-1]
    assert (state.status, list(state.faults)) == (AnkleRobotState.STOPPED, ["stopped"])
    with pytest.raises(DeviceError, match="latched"):
        bench.run.schedule(TRAIN, KEY)


def test_train_with_a_fault_in_its_delivery_does_not_count_as_delivered(bench, monkeypatch):
    bench.run.schedule(TRAIN, KEY)
    promise = bench.robot.promise

    def exceed(until):
        profile = promise(until)
        bench.robot.stop(TORQUE_EXCEEDED)
        return profile

    monkeypatch.setattr(bench.robot, "promise", exceed)
    bench.run.take_horizon(SECOND, 6 * SECOND, last=False)
    assert bench.ended == []  # the node reports the fault, then ends the train with it
    assert bench.states[-1].status == AnkleRobotState.FAULT


def test_failure_of_a_driver_is_reported(bench, monkeypatch):
    def fail(_):
        raise DeviceError("bus gone")

    monkeypatch.setattr(bench.robot, "promise", fail)
    with pytest.raises(DeviceError, match="bus gone"):
        bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    assert bench.profiles == []


def test_torque_of_a_real_robot_is_promised_piece_by_piece(bench, monkeypatch):
    promise = bench.robot.promise
    measured = [SECOND, SECOND + SECOND // 2, 2 * SECOND]
    monkeypatch.setattr(bench.robot, "promise", lambda until: promise(min(measured[0], until)))
    bench.run.take_horizon(SECOND, 2 * SECOND, last=True)
    assert bench.profiles == []  # nothing was measured yet
    measured.pop(0)
    bench.run.look_after()
    measured.pop(0)
    bench.run.look_after()
    assert [profile.last for profile in bench.profiles] == [False, True]
    states = len(bench.states)
    late = RobotState(2 * SECOND + 1, 0.0, 0.5, 0.0)
    monkeypatch.setattr(bench.robot, "read", lambda: (late,))
    bench.run.look_after()  # the next horizon is late: nothing is left to promise
    assert len(bench.profiles) == 2
    assert [state.measured_torque for state in bench.states[states:]] == [0.5]


def test_trains_end_in_order_each_once_its_last_pulse_is_promised(bench):
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    bench.run.schedule(TRAIN, KEY)
    bench.run.schedule(TRAIN.shifted(5 * SECOND), KEY)
    assert bench.run.requested == 4
    bench.run.take_horizon(2 * SECOND, 7 * SECOND, last=False)
    assert bench.outcomes() == [(Result.DELIVERED, 2, "every pulse was delivered")]
    bench.run.take_horizon(7 * SECOND, 9 * SECOND, last=False)
    bench.run.end_torque(Result.CANCELLED, "enough")
    assert bench.outcomes()[1:] == [(Result.CANCELLED, 1, "enough")]
    assert [pulse.number for pulse in bench.pulses] == [1, 2, 3]
    assert bench.run.requested == 3


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    key=st.text().filter(lambda key: key != KEY),
    first=st.integers(0, 30 * 2),
    count=st.integers(1, 5),
    torque=st.sampled_from([5.0, -5.0, 0.1, 0.0]),
    requested=st.integers(0, 2),
    until=st.integers(2, 12),
)
def test_a_stranger_gets_no_pulse_before_between_or_after_those_of_the_run(
    key, first, count, torque, requested, until
):
    bench = Bench()
    for number in range(requested):
        bench.run.schedule(TRAIN.shifted(4 * number * SECOND), KEY)
    bench.run.take_horizon(SECOND, 2 * SECOND, last=False)
    strange = PulseTrain.periodic(Side.RIGHT, first * SECOND // 2, 1.0, count, torque, 0.1)
    before = bench.robot.train
    for asked in (key, bench.run.seal):  # any listener knows the seal
        with pytest.raises(LimitError, match="key: not that of the run"):
            bench.run.schedule(strange, asked)
    assert bench.robot.train is before
    assert bench.run.requested == 2 * requested
    bench.run.take_horizon(2 * SECOND, until * SECOND, last=False)
    onsets = {nanoseconds_of(onset) for p in bench.profiles for onset in p.onsets}
    assert onsets == set(before.onsets_within(0, until * SECOND) if before else ())
    bench.robot.close()


def test_pulses_of_every_shape_survive_the_goal():
    pulses = (
        Pulse(3 * SECOND, 5.0, 0.1),
        Pulse(4 * SECOND, -4.0, 0.2, Shape.TRAPEZOID, 0.05, 0.1),
        Pulse(5 * SECOND, 0.0, 0.1, Shape.HALF_SINE),
        Pulse(6 * SECOND, 2.0, 0.3, Shape.SAMPLES, samples=(0.0, 1.0, -0.5, 0.0)),
    )
    train = PulseTrain(Side.LEFT, pulses)
    goal = goal_of(3, KEY, train)
    assert (goal.run, goal.key) == (3, KEY)
    assert train_of(goal) == train
    goal.pulses[2].shape = 9
    with pytest.raises(MessageError, match=r"shape: 9; allowed: 0 \(square\), 1"):
        train_of(goal)


def test_each_ankle_has_its_own_promises_and_a_fault_of_one_ends_both():
    robots = make_robots("ideal", (Side.RIGHT, Side.LEFT), DeviceLimits())
    for robot in robots.values():
        robot.configure()
        robot.activate()
    published, ended = [], []
    run = Run(
        4,
        seal_of(KEY),
        SECOND,
        robots,
        lambda topic, message: published.append((topic.name, message)),
        lambda result, side: ended.append((side, result.outcome, result.delivered)),
    )
    run.schedule(TRAIN, KEY)
    run.schedule(replace(TRAIN.shifted(SECOND // 2), side=Side.LEFT), KEY)
    assert run.requested == 4
    run.take_horizon(SECOND, 4 * SECOND, last=False)
    profiles = [m for name, m in published if name == TORQUE_PROFILE.name]
    assert [(m.side, m.revision, len(m.onsets)) for m in profiles] == [(1, 0, 1), (0, 0, 1)]
    pulses = [m for name, m in published if name == PULSES.name]
    assert [(m.side, m.number) for m in pulses] == [(1, 1), (0, 1)]
    robots[Side.LEFT].stop(TORQUE_EXCEEDED)
    run.end_torque(Result.STOPPED, "a fault", fault=True)
    assert ended == [(Side.RIGHT, Result.STOPPED, 1), (Side.LEFT, Result.STOPPED, 1)]
    stops = [m for name, m in published if name == TORQUE_PROFILE.name and m.stop]
    assert [(m.side, m.revision) for m in stops] == [(1, 1), (0, 1)]
    run.take_horizon(4 * SECOND, 4 * SECOND, last=True)
    assert run.closed
