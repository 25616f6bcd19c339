# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The perturbator alone, with the test as its experiment: what it refuses and ends."""

import itertools
import math
import os
import signal
import time
from contextlib import contextmanager

import pytest
import rclpy
from harness import Session, claimed_domain, session, stamp_of
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import TransitionCallbackReturn
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from test_drivers import emulated_motor

from gait_entrainment.conventions import Side
from gait_entrainment.robot import PulseTrain
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_bringup.node_list import STOP_ORDER
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import Horizon
from gait_entrainment_nodes.messaging.goals import goal_of, seal_of
from gait_entrainment_nodes.messaging.stamps import to_time
from gait_entrainment_nodes.messaging.topics import (
    EMERGENCY_STOP,
    HORIZON,
    OPERATOR_HEARTBEAT,
    ROBOT_STATE,
    TORQUE_PROFILE,
    TROUBLE,
    quality,
)
from gait_entrainment_nodes.nodes import perturbator
from gait_entrainment_nodes.nodes.perturbator_run import do_with_all

UP = (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE)
SECOND = 10**9
KEY = "the test's"


class Conductor:
    """Acts as the experiment: sends horizons and goals by hand."""

    def __init__(self, nodes):
        self.nodes, self.probe = nodes, nodes.probe
        self.profiles = self.probe.listen(TORQUE_PROFILE)
        self.troubles = self.probe.listen(TROUBLE)
        node = self.probe.node
        self.horizons = node.create_publisher(HORIZON.type, HORIZON.name, HORIZON.qos)
        for number in UP:
            assert self.transition(number)

    def transition(self, number):
        request = ChangeState.Request(transition=Transition(id=number))
        return self.probe.call(ChangeState, "perturbator/change_state", request).success

    def promise(self, known, until, run=7):
        """Send a horizon from one time to another [s]; return the profile that answers it."""
        begin, end = round(known * SECOND), round(until * SECOND)
        message = Horizon(run=run, until=to_time(end), seal=seal_of(KEY))
        message.header.stamp = to_time(begin)
        count = len(self.profiles)
        self.horizons.publish(message)
        self.probe.until(lambda: len(self.profiles) > count, "a profile")
        return self.profiles[-1]

    def feel(self, states):
        """Wait for measured torque in the robot's states; a fault before that fails the test."""
        self.probe.until(
            lambda: self.troubles or (states and states[-1].measured_torque > 0.5), "torque"
        )
        assert not self.troubles

    def request(self, onset, key=KEY, run=7, **changes):
        """Request a train that starts at a time [s]; return the goal's handle."""
        pulses = {"period": 1.0, "count": 100, "torque": 5.0, "duration": 0.5} | changes
        goal = goal_of(run, key, PulseTrain.periodic(Side.RIGHT, round(onset * SECOND), **pulses))
        return self.probe.send_goal(DeliverPulseTrain, "perturbator/deliver_pulse_train", goal)


def test_cancelling_the_train_alone_ends_the_torque_immediately(tmp_path):
    with session(tmp_path, nodes=("perturbator",), strangers=True) as nodes:
        conductor, probe = Conductor(nodes), nodes.probe
        conductor.promise(0, 2)
        goal = conductor.request(3)
        assert goal.accepted
        assert list(conductor.promise(1, 4).torques) == [0.0, 5.0, 0.0]
        profiles = conductor.profiles
        count = len(profiles)
        future = goal.cancel_goal_async()
        # No further horizon comes, and the stop does not wait for one.
        probe.until(lambda: len(profiles) > count and profiles[-1].stop, "the stop")
        probe.until(future.done, "an answer to the cancellation")
        result = probe.result(goal).result
        assert result.outcome == DeliverPulseTrain.Result.CANCELLED
        assert result.delivered == 1
        assert list(conductor.promise(4, 6).torques) == [0.0]
        back = Horizon(run=7, until=to_time(5 * SECOND), seal=seal_of(KEY))
        conductor.horizons.publish(back)  # does not take back a promise
        # Another train may follow.
        again = conductor.request(7)
        assert again.accepted
        # A run that begins before the train is over ends it.
        assert conductor.promise(7, 9, run=8).stop
        result = probe.result(again).result
        assert result.outcome == DeliverPulseTrain.Result.STOPPED


def test_a_stranger_gets_no_pulses_beyond_the_protocol(tmp_path):
    pulses = ("--torque=5", "--width=0.2", "--pulses=10")
    with session(tmp_path, *pulses, nodes=("perturbator",)) as nodes:
        conductor = Conductor(nodes)
        conductor.promise(0, 2)
        for changes, words in (
            ({"torque": 5.1}, "torque: 5.1 exceeds the protocol's pulses; allowed: at most 5"),
            ({"torque": -5.1}, "torque"),
            ({"duration": 0.21}, "duration: 0.21 exceeds the protocol's"),
            ({"count": 11}, "count: 11 exceeds"),
            ({"count": 0}, "count: 0; allowed: 1 to 10000 at a time"),
            ({"key": "a stranger's"}, "key: not that of the run"),
        ):
            begin, count = time.monotonic(), len(conductor.troubles)
            requested = {"duration": 0.2, "count": 10} | changes
            assert not conductor.request(3, **requested).accepted
            heard = conductor.troubles
            nodes.probe.until(lambda h=heard, c=count: len(h) > c, "a reason")
            assert words in heard[-1].message
            assert time.monotonic() - begin < 5.0
        assert conductor.request(3, duration=0.2, count=5).accepted
        # Height, width and number are within what the protocol has left, but the key is wrong.
        count = len(conductor.troubles)
        for onset in (2.5, 3.5, 20):
            assert not conductor.request(onset, "", duration=0.2, count=1).accepted
        # A stranger may not advance the horizon either.
        conductor.horizons.publish(Horizon(run=7, until=to_time(50 * SECOND), seal="a stranger's"))
        nodes.probe.until(lambda: len(conductor.troubles) == count + 4, "four reasons")
        assert "not from the experiment that conducts" in conductor.troubles[-1].message
        assert conductor.request(10, duration=0.2, count=5).accepted
        assert not conductor.request(16, "", duration=0.2, count=1).accepted  # all are taken
        onsets = [nanoseconds_of(onset) / SECOND for onset in conductor.promise(2, 20).onsets]
        assert onsets == [3, 4, 5, 6, 7, 10, 11, 12, 13, 14]


@pytest.mark.parametrize("driver", ["ideal", "emulated"])
def test_deactivating_and_activating_during_a_run_breaks_no_promise(tmp_path, driver):
    options = (f"--driver={driver}",)
    with session(tmp_path, *options, nodes=("perturbator",), strangers=True) as nodes:
        conductor = Conductor(nodes)
        conductor.promise(0, 2)
        assert conductor.request(3).accepted
        conductor.promise(2, 4)
        assert conductor.transition(Transition.TRANSITION_DEACTIVATE)
        conductor.promise(4, 5)
        assert conductor.transition(Transition.TRANSITION_ACTIVATE)
        conductor.promise(5, 6)
        assert conductor.request(7, count=1).accepted
        assert max(conductor.promise(6, 9).torques) == pytest.approx(5.0, rel=0.1)
        promises = [profile for profile in conductor.profiles if not profile.stop]
        assert [profile.stop for profile in conductor.profiles].count(True) == 1
        assert [profile.revision for profile in conductor.profiles] == list(
            range(len(conductor.profiles))
        )
        for before, after in itertools.pairwise(promises):
            assert stamp_of(after.header) == nanoseconds_of(before.valid_until)
        off = [p for p in promises if 4 * SECOND <= stamp_of(p.header) < 6 * SECOND]
        assert not any(torque for profile in off for torque in profile.torques)


@contextmanager
def with_motor(tmp_path, *parameters):
    """Start the perturbator with an emulated motor, armed; yield its conductor."""
    with emulated_motor(tmp_path) as (driver, _), claimed_domain() as domain:
        # Host silence is not under test here, and may be longer on a shared machine.
        driver = driver.replace("host_silence=1", "host_silence=5")
        nodes = Session(tmp_path, domain, [f"--driver={driver}"], real_time=True, strangers=True)
        for parameter in ("unproved:=true", *parameters):
            nodes.arguments += ["-p", parameter]
        try:
            nodes.start("perturbator")
            conductor = Conductor(nodes)
            assert nodes.probe.call(Trigger, "perturbator/arm").success
            yield conductor
        finally:
            nodes.probe.client.close()
            nodes.supervisor.stop(STOP_ORDER)


def test_a_real_robot_must_be_armed_again_after_a_run_is_interrupted(tmp_path):
    with with_motor(tmp_path, "operator_timeout:=0.0") as conductor:
        now = time.time()
        conductor.promise(now, now + 0.2)
        assert conductor.request(now + 3).accepted, conductor.troubles
        conductor.promise(time.time(), time.time() + 0.2, run=8)
        assert not conductor.request(time.time() + 3, run=8).accepted
        conductor.probe.until(lambda: conductor.troubles, "the reason")
        assert "the device is not armed" in conductor.troubles[-1].message


@pytest.mark.parametrize("silent", ["the emergency stop", "entrain_run", "operator_page"])
def test_torque_ends_if_a_required_sender_falls_silent(tmp_path, silent):
    operators = "operators:=[entrain_run, operator_page]"
    timeouts = "deadman_timeout:=2.0", "operator_timeout:=2.0"
    with with_motor(tmp_path, operators, *timeouts) as conductor:
        probe = conductor.probe
        button, heart = (
            probe.node.create_publisher(topic.type, topic.name, topic.qos)
            for topic in (EMERGENCY_STOP, OPERATOR_HEARTBEAT)
        )
        alive = ["the emergency stop", "entrain_run", "operator_page"]

        def live():
            """Send horizons, button states and heartbeats, but nothing from the silent sender."""
            conductor.horizons.publish(horizon_from(time.time()))
            for name in alive:
                if name == "the emergency stop":
                    button.publish(Bool(data=False))
                else:
                    heart.publish(String(data=name))

        states = probe.listen(ROBOT_STATE)
        for publisher in (button, heart):
            probe.until(publisher.get_subscription_count, "a reader")
        probe.client.each_round = paced(live)
        probe.until(lambda: conductor.profiles, "a run")
        assert conductor.request(time.time() + 2, duration=0.3).accepted, conductor.troubles
        conductor.feel(states)
        alive.remove(silent)
        probe.until(lambda: conductor.troubles, "the fault")
        assert f": {silent} silent for 2 s" in conductor.troubles[0].message
        reported_at = stamp_of(conductor.troubles[0].header)
        # A pulse per second was requested; the one that was felt is over half a second later.
        probe.until(lambda: stamp_of(states[-1].header) > reported_at + 2 * SECOND, "time")
        after = [s for s in states if stamp_of(s.header) > reported_at + SECOND // 2]
        assert max(abs(state.measured_torque) for state in after) < 0.5


def test_torque_ends_if_an_emergency_stop_button_disappears(tmp_path):
    with with_motor(tmp_path, "operator_timeout:=0.0") as conductor:
        probe = conductor.probe
        topic = EMERGENCY_STOP
        button = probe.node.create_publisher(topic.type, topic.name, topic.qos)
        states = probe.listen(ROBOT_STATE)
        probe.until(button.get_subscription_count, "a reader")
        probe.client.each_round = paced(
            lambda: conductor.horizons.publish(horizon_from(time.time()))
        )
        probe.until(lambda: conductor.profiles, "a run")
        assert conductor.request(time.time() + 1, duration=0.3).accepted, conductor.troubles
        conductor.feel(states)
        probe.node.destroy_publisher(button)
        probe.until(lambda: conductor.troubles, "the fault")
        trouble = conductor.troubles[0]
        assert trouble.fault == "deadman_silent"
        assert "a node that can press the emergency stop has ended" in trouble.message


def paced(send):
    """Return a function that sends once in 20 ms: one that also answered answers would flood."""
    sent_at = -math.inf

    def send_if_due():
        nonlocal sent_at
        if time.monotonic() - sent_at > 0.02:
            sent_at = time.monotonic()
            send()

    return send_if_due


def horizon_from(now):
    """Return a horizon that starts at a time [s]."""
    message = Horizon(run=7, until=to_time(round((now + 0.2) * SECOND)), seal=seal_of(KEY))
    message.header.stamp = to_time(round(now * SECOND))
    return message


def test_an_emergency_stop_is_heard_with_any_qos_and_holds_while_it_is_pressed(tmp_path):
    with session(tmp_path, nodes=("perturbator",)) as nodes:
        conductor, probe = Conductor(nodes), nodes.probe
        for qos in (EMERGENCY_STOP.qos, quality(10), quality(1, reliable=False)):
            button = probe.node.create_publisher(Bool, EMERGENCY_STOP.name, qos)
            probe.until(button.get_subscription_count, "a reader")
            count = len(conductor.troubles)

            def press(button=button, count=count):
                button.publish(Bool(data=True))
                return len(conductor.troubles) > count

            probe.until(press, "the stop")
            assert "the emergency stop was pressed" in conductor.troubles[-1].message
            assert conductor.transition(Transition.TRANSITION_DEACTIVATE)
            assert conductor.transition(Transition.TRANSITION_CLEANUP)
            assert not conductor.transition(Transition.TRANSITION_CONFIGURE)
            probe.until(lambda: "release it" in conductor.troubles[-1].message, "the reason")
            button.publish(Bool(data=False))
            probe.until(lambda: conductor.transition(Transition.TRANSITION_CONFIGURE), "release")
            assert conductor.transition(Transition.TRANSITION_ACTIVATE)
            probe.node.destroy_publisher(button)


@pytest.mark.parametrize("reliable", [True, False])
def test_a_press_is_heard_although_a_release_follows_at_once(tmp_path, reliable):
    with session(tmp_path, nodes=("perturbator",), strangers=True) as nodes:
        conductor, probe = Conductor(nodes), nodes.probe
        pressed, other = (
            probe.node.create_publisher(Bool, EMERGENCY_STOP.name, quality(10, reliable=reliable))
            for _ in range(2)
        )
        for button in (pressed, other):
            probe.until(button.get_subscription_count, "a reader")
        # Readers that hear neither message before both have come.
        perturbator = nodes.supervisor._processes["perturbator"].pid
        os.kill(perturbator, signal.SIGSTOP)
        pressed.publish(Bool(data=True))
        other.publish(Bool(data=False))
        os.kill(perturbator, signal.SIGCONT)
        probe.until(lambda: conductor.troubles, "the stop")
        assert "the emergency stop was pressed" in conductor.troubles[-1].message


def test_a_stop_while_the_robot_is_being_connected_is_not_forgotten(monkeypatch):
    def stopped_meanwhile(*arguments):
        node._stop_at_once()
        do_with_all(*arguments)

    rclpy.init()
    node = perturbator.Perturbator()
    try:
        monkeypatch.setattr(perturbator, "do_with_all", stopped_meanwhile)
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        monkeypatch.setattr(perturbator, "do_with_all", do_with_all)
        assert node.trigger_activate() == TransitionCallbackReturn.FAILURE
        assert [fault.name for fault in node._faults] == ["stopped"]
    finally:
        node.on_stop()
        node.destroy_node()
        rclpy.shutdown()
