# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How fast whole commands are, each next to its baseline. Asserts nothing about speed."""

import json
import os
import subprocess
import sys
import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.topics import JOINT_STATES
from gait_entrainment_nodes.nodes.rclpy_internals import RawReader

pytestmark = pytest.mark.benchmark

# As many messages as a run has, in bursts as long as a stretch of it.
BURSTS, BURST = 80, 1500
_PUBLISHER = """
import sys
import rclpy
from sensor_msgs.msg import JointState
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.topics import JOINT_STATES


rclpy.init()
node = Participant("source")
publisher = node.offer(JOINT_STATES)
names = ["l_hip", "r_hip", "l_ankle", "r_ankle"]
data = serialize(JointState(name=names, position=[0.0] * 4, velocity=[0.0] * 4, effort=[0.0] * 4))
while not publisher.matched:
    rclpy.spin_once(node, timeout_sec=0.01)
for _ in range(int(sys.argv[1])):
    publisher.publish_all([data] * int(sys.argv[2]))
    publisher.wait_until_received(30.0)
"""


def run(*command, **environment):
    """Run a command; return its wall time [s] and its standard output."""
    begin = time.perf_counter()
    done = subprocess.run(
        command,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env={**os.environ, **environment},
    )
    return time.perf_counter() - begin, done.stdout


def entrain(tmp_path, name, *options):
    seconds, text = run(
        "entrain", "run", "--json", "--no-figures", "--out", str(tmp_path / name), *options
    )
    return seconds, json.loads(text)


def test_lock_step_with_everything_recorded(tmp_path):
    seconds, outcome = entrain(tmp_path, "everything")
    walked = sum(outcome["stride_period"])
    print(
        f"\nentrain run, default protocol, 200 Hz, everything recorded:"
        f" {outcome['real_time_factor']:.0f} times real time from first to last /clock"
        f" (target: 30), {outcome['messages']} messages, {outcome['lost']} lost;"
        f" whole command {seconds:.1f} s, {walked / seconds:.0f} times real time"
    )
    bare = bare_rate()
    rate = outcome["messages"] / (walked / outcome["real_time_factor"])
    print(f"floor, ready bytes published, received and discarded: {bare:.0f} messages/s")
    print(f"that run: {rate:.0f} messages/s, computed, written to disk; {rate / bare:.0%} of it")
    assert outcome["lost"] == 0


def test_lock_step_at_event_rate(tmp_path):
    _, outcome = entrain(
        tmp_path, "events", "--sample-rate=0", "--no-ground-reaction", "--pulses=970"
    )
    factor = outcome["real_time_factor"]
    print(
        f"\nentrain run, 1000 strides, states at event rate only: {factor:.0f} times real time"
        f" (target: 300), {outcome['lost']} lost; {ms_per_stride(outcome, factor):.1f} ms a stride"
    )
    print(f"baseline, a service call between two processes: {service_call_ms():.2f} ms (median)")
    assert outcome["lost"] == 0


class Listener:
    """A node of this process in its own domain, with one other process."""

    def __init__(self, domain):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("listener", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin_until(self, condition):
        while not condition():
            self.executor.spin_once(timeout_sec=0.1)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


def bare_rate():
    """Return how many messages a second reach a process that discards them."""
    taken, begin = 0, None
    with claimed_domain() as domain:
        listener = Listener(domain)
        reader = RawReader(listener.node, JOINT_STATES.type, JOINT_STATES.name, JOINT_STATES.qos)
        with subprocess.Popen(
            [sys.executable, "-c", _PUBLISHER, str(BURSTS), str(BURST)],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        ):
            while taken < BURSTS * BURST:
                taken += len(reader.take(BURST))
                if begin is None and taken:
                    begin = time.perf_counter()
                time.sleep(0.001)
            rate = taken / (time.perf_counter() - begin)
        reader.destroy()
        listener.close()
    return rate


def service_call_ms():
    """Return the median time of a service call to a node in another process [ms]."""
    times = []
    with claimed_domain() as domain:
        listener = Listener(domain)
        client = listener.node.create_client(Ready, "gait_analyzer/ready")
        with subprocess.Popen(
            ["gait_analyzer"], env={**os.environ, "ROS_DOMAIN_ID": str(domain)}
        ) as analyzer:
            listener.spin_until(client.service_is_ready)
            time.sleep(1.0)  # until the node has discovered this client
            for _ in range(500):
                begin = time.perf_counter()
                listener.spin_until(client.call_async(Ready.Request()).done)
                times.append(time.perf_counter() - begin)
            analyzer.terminate()
        listener.close()
    return 1e3 * sorted(times)[len(times) // 2]


def ms_per_stride(outcome, factor):
    """Return the wall time per stride [ms]."""
    return 1e3 * sum(outcome["stride_period"]) / factor / len(outcome["stride_period"])
