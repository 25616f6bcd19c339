# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Stops, cancellations and refusals during a run, and several runs of the same processes."""

import math

import pytest
from harness import QUICK, session, stamp_of
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.robot import Pulse, PulseTrain
from gait_entrainment_bags import BagReader
from gait_entrainment_msgs.action import DeliverPulseTrain, RunProtocol
from gait_entrainment_msgs.msg import GaitEvent, Progress, PublishedCounts, TorqueProfile
from gait_entrainment_msgs.srv import Ready, StartRun
from gait_entrainment_nodes.messaging.goals import goal_of
from gait_entrainment_nodes.messaging.topics import (
    ANKLE_TORQUE,
    GAIT_EVENTS,
    PUBLISHED_COUNTS,
    PULSES,
    TORQUE_PROFILE,
    WALKER_PROGRESS,
)

# Pulses that are on nearly all the time and outlast any test.
BROAD = (*QUICK, "--pulses=1000", "--width=0.4", "--baseline=2", "--washout=0")


class Conducted:
    """A session whose runs are conducted, disturbed and examined one after another."""

    def __init__(self, nodes):
        self.nodes, self.probe = nodes, nodes.probe
        self.pulses = self.probe.listen(PULSES)
        self.profiles = self.probe.listen(TORQUE_PROFILE)
        self.torques = self.probe.listen(ANKLE_TORQUE)
        self.progress = self.probe.listen(WALKER_PROGRESS)

    def start(self):
        """Start a run and wait until its pulses are under way."""
        handle = self.nodes.conduct()
        assert handle.accepted
        count = len(self.pulses)
        self.probe.until(lambda: len(self.pulses) > count + 1, "pulses")
        return handle

    def transition(self, number):
        request = ChangeState.Request(transition=Transition(id=number))
        return self.probe.call(ChangeState, "perturbator/change_state", request).success

    def assert_torque_ended(self, handle, run, reason):
        """Check that a run ended for this reason, with zero torque from its stop on."""
        answer = self.probe.result(handle)
        assert answer.result.run == run
        assert reason in answer.result.message
        # The walker is notified of the end and publishes its final progress.
        self.probe.until(
            lambda: self.progress[-1].run == run and self.progress[-1].state != 0, "the end"
        )
        stops = [p for p in self.profiles if p.run == run and p.stop]
        assert len(stops) == 1
        end = stamp_of(self.progress[-1].header)
        # The last samples may still be on their way.
        self.probe.until(lambda: stamp_of(self.torques[-1].header) > end - 10**7, "samples")
        assert self.torques[-1].delivered[self.nodes.protocol.side] == 0
        return answer.result

    def reset(self):
        client = self.probe.client
        client.service(Trigger, "walker/reset")
        client.wait_to_be_known("walker_sim")
        return client.call(Trigger, "walker/reset", period=math.inf)


@pytest.fixture(scope="module")
def conducted(tmp_path_factory):
    with session(tmp_path_factory.mktemp("runs"), *BROAD) as nodes:
        yield Conducted(nodes)
    # Runs 2, 4 and 5 were refused. All runs are in one bag, with torque only before their stops.
    with BagReader(nodes.bag) as reader:
        recorded = list(reader.decoded(["/walker/progress", "/ankle_torque"]))
        profiles = list(reader.decoded(["/perturbation/torque_profile"]))
    finals = {m.run: raw for raw, m in recorded if raw.topic.endswith("progress") and m.state}
    assert set(finals) == {1, 3, 6}
    stops = {m.run: raw for raw, m in profiles if m.stop}
    assert set(stops) == {1, 3, 6}
    side = nodes.protocol.side
    torques = [(r.publish_time, m.delivered[side]) for r, m in recorded if "torque" in r.topic]
    assert max(torque for _, torque in torques) > 10
    for run, stop in stops.items():
        # By time of reception, with a margin for messages that were on their way.
        after = [
            torque
            for received, torque in torques
            if stop.publish_time + 5 * 10**7 < received <= finals[run].publish_time
        ]
        assert len(after) > 10
        assert set(after) == {0.0}


def test_second_protocol_second_train_and_reset_are_refused_during_a_run(conducted):
    handle = conducted.start()
    assert not conducted.nodes.conduct().accepted
    pulse = Pulse((2**31 - 1) * 10**9, 5.0, 0.1)
    train = goal_of(1, "a stranger's", PulseTrain(Side.RIGHT, (pulse,)))
    refused = conducted.probe.send_goal(
        DeliverPulseTrain, "perturbator/deliver_pulse_train", train
    )
    assert not refused.accepted
    train.side = 7  # no such side: a request for it must not end the run
    assert not conducted.probe.send_goal(
        DeliverPulseTrain, "perturbator/deliver_pulse_train", train
    ).accepted
    answer = conducted.reset()
    assert not answer.success
    assert "run 1 is in progress" in answer.message
    strays = []
    for topic, stray in (  # impossible messages: none of them ends the run either
        (TORQUE_PROFILE, TorqueProfile(run=1, side=Side.RIGHT)),
        (GAIT_EVENTS, GaitEvent(run=1, kind=7)),
        (PUBLISHED_COUNTS, PublishedCounts(run=1, topics=["/a"])),
    ):
        publisher = conducted.probe.node.create_publisher(topic.type, topic.name, topic.qos)
        conducted.probe.until(publisher.get_subscription_count, "the nodes")
        publisher.publish(stray)
        strays.append(publisher)
    # Cancelling the protocol brings the torque to zero.
    future = handle.cancel_goal_async()
    conducted.probe.until(future.done, "an answer to the cancellation")
    result = conducted.assert_torque_ended(handle, 1, "cancelled by the client")
    assert result.outcome == RunProtocol.Result.CANCELLED
    for publisher in strays:  # with them there could be no other run
        conducted.probe.node.destroy_publisher(publisher)


def test_walker_must_be_reset_between_runs(conducted):
    handle = conducted.nodes.conduct()
    answer = conducted.probe.result(handle)
    assert answer.result.outcome == RunProtocol.Result.FAILED
    assert "reset first" in answer.result.message
    assert conducted.reset().success
    assert conducted.progress[-1].run == 1


def test_latched_stop_ends_the_run_and_lasts_until_clean_up(conducted):
    handle = conducted.start()
    run = conducted.progress[-1].run
    answer = conducted.probe.call(Trigger, "perturbator/stop")
    assert answer.success
    result = conducted.assert_torque_ended(handle, run, "the stop service was called")
    assert result.outcome == RunProtocol.Result.FAILED
    assert not result.reproducible
    assert conducted.reset().success
    refused = conducted.probe.result(conducted.nodes.conduct())
    assert "perturbator refused to be activated" in refused.result.message
    assert not conducted.transition(Transition.TRANSITION_DEACTIVATE)  # it is not active
    assert conducted.transition(Transition.TRANSITION_CLEANUP)


def test_stop_before_there_is_a_robot_prevents_its_configuration_in_the_next_run(conducted):
    assert conducted.probe.call(Trigger, "perturbator/stop").success
    refused = conducted.probe.result(conducted.nodes.conduct())
    assert "refused to be configured: the stop service was called" in refused.result.message


def test_deactivation_ends_the_run(conducted):
    conducted.reset()
    handle = conducted.start()
    run = conducted.progress[-1].run
    assert conducted.transition(Transition.TRANSITION_DEACTIVATE)
    conducted.assert_torque_ended(handle, run, "the perturbator was deactivated")


def test_walker_that_counts_events_which_never_arrive_ends_the_run(tmp_path):
    names = ("perturbator", "gait_analyzer", "experiment")
    with session(tmp_path, *QUICK, nodes=names, participants=["walker_sim", *names[:2]]) as nodes:
        probe = nodes.probe
        progress = probe.node.create_publisher(
            WALKER_PROGRESS.type, WALKER_PROGRESS.name, WALKER_PROGRESS.qos
        )

        def start(_, response):
            response.success = True
            return response

        def ready(_, response):
            response.ready = True
            return response

        probe.node.create_service(StartRun, "walker/start", start)
        probe.node.create_service(Ready, "walker_sim/ready", ready)
        profiles = probe.listen(TORQUE_PROFILE)
        handle = nodes.conduct()
        probe.until(lambda: profiles, "a promise")
        ended = handle.get_result_async()

        def over():
            progress.publish(Progress(run=1, events=1))
            return ended.done()

        probe.until(over, "the end of the run")
        assert "walker_sim: 1 of 1 gait events missing for 3 s" in ended.result().result.message
