# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Bags: recording at 20,000 messages a second, and one hour at 1 kHz inspected and analyzed."""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import JointState

from gait_entrainment.protocol import Protocol, PulsePlan, write_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader, BagWriter, TopicInfo, find_definition
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate, serialize
from gait_entrainment_nodes.messaging.stamps import header, to_time

pytestmark = pytest.mark.benchmark

SECOND = 10**9
RATE = 10_000  # messages per second of each publisher
DURATION = 30  # s
PUBLISHER = """
import sys, time
import rclpy
from sensor_msgs.msg import JointState
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_nodes.messaging.publisher import CountedPublisher
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.messaging.topics import PUBLISHED_COUNTS, Topic

name, rate, duration = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
rclpy.init()
node = rclpy.create_node("publisher_" + name)
node.stopping = False
node.real_time = False
states = CountedPublisher(node, Topic(name, JointState))
counts = node.create_publisher(PUBLISHED_COUNTS.type, PUBLISHED_COUNTS.name, PUBLISHED_COUNTS.qos)
while not (states.matched and counts.get_subscription_count()):
    time.sleep(0.01)
joints = ["l_hip", "r_hip", "l_ankle", "r_ankle"]
values = [0.1, 0.2, 0.3, 0.4]
data = bytearray(serialize(JointState(
    header=header(1), name=joints, position=values, velocity=values, effort=values
)))
begin = time.monotonic_ns()
sent, late = 0, 0
while sent < rate * duration:
    due = (time.monotonic_ns() - begin) * rate // 10**9
    late = max(late, due - sent)
    while sent < min(due, rate * duration):
        data[4:8], data[8:12] = (5).to_bytes(4, "little"), sent.to_bytes(4, "little")
        states.publish(bytes(data))
        sent += 1
    time.sleep(0.0005)
took = (time.monotonic_ns() - begin) / 1e9
counts.publish(PublishedCounts(
    node="/" + name, topics=[states.topic_name], counts=[states.count]
))
states.wait_until_received(30.0)
counts.wait_for_all_acked()
print(f"{name}: {sent} messages in {took:.1f} s, at worst {late / rate * 1e3:.0f} ms behind")
"""


def resident(pid: int) -> float:
    """Return the memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def test_recording_without_a_loss(tmp_path: Path) -> None:
    with claimed_domain() as domain:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        recorder = subprocess.Popen(
            [
                *("bag_recorder", "--ros-args"),
                *("-p", f"output:={tmp_path / 'bag'}", "-p", "publishers:=[left, right]"),
            ],
            env=environment,
        )
        publishers = [
            subprocess.Popen(
                [sys.executable, "-c", PUBLISHER, name, str(RATE), str(DURATION)], env=environment
            )
            for name in ("left", "right")
        ]
        memory = []
        while recorder.poll() is None:
            time.sleep(1)
            memory.append(resident(recorder.pid) if recorder.poll() is None else memory[-1])
        assert all(publisher.wait() == 0 for publisher in publishers)
        user = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with BagReader(tmp_path / "bag") as bag:
        print(f"recorded: {bag.counts['/left']} and {bag.counts['/right']} messages")
        assert bag.counts["/left"] == bag.counts["/right"] == RATE * DURATION
    every_five = ", ".join(f"{megabytes:.0f}" for megabytes in memory[4:-1:5])
    print(
        f"recorder: memory every 5 s [MB]: {every_five}; all processes {user:.0f} s of processor"
    )
    assert recorder.returncode == 0


def one_hour(folder: Path) -> Path:
    """Write an hour of walking with two topics at 1 kHz: 7.2 million messages."""
    protocol = Protocol(baseline=30, washout=30, pulses=PulsePlan(count=1800))
    walked = simulate(protocol)
    kinds = {
        "/gait_events": msg.GaitEvent,
        "/perturbation/torque_profile": msg.TorqueProfile,
        "/joint_states": JointState,
        "/ankle_torque": msg.AnkleTorque,
    }
    states = MessageTemplate(
        JointState(name=["l_hip", "r_hip", "l_ankle", "r_ankle"]), {"position": 4}
    )
    torques = MessageTemplate(msg.AnkleTorque(), {"intrinsic": 2})
    with BagWriter(
        folder, ros_distro="jazzy", custom_data={"protocol": write_protocol(protocol)}
    ) as writer:
        for name, kind in kinds.items():
            package, module, _ = kind.__module__.split(".")
            found = find_definition(f"{package}/{module}/{kind.__name__}")
            writer.add_topic(TopicInfo(name, found.type, found.schema_text, found.type_hash))
        onsets = list(walked.onsets)
        events = list(walked.events)
        for second in range(events[-1].stamp // SECOND + 1):
            end = (second + 1) * SECOND
            while events and events[0].stamp < end:
                event = events.pop(0)
                stamp = SECOND + event.stamp
                message = msg.GaitEvent(
                    header=header(stamp), kind=event.kind, side=event.side, step=event.step
                )
                writer.write("/gait_events", serialize(message), stamp, stamp)
            due = [onset for onset in onsets if onset < end]
            del onsets[: len(due)]
            profile = msg.TorqueProfile(
                header=header(end),
                onsets=[to_time(SECOND + onset) for onset in due],
                valid_until=to_time(SECOND + end),
            )
            writer.write("/perturbation/torque_profile", serialize(profile), end, end)
            stamps = end + np.arange(1000) * 1_000_000
            angle = np.sin(stamps / 2e8)[:, None] * [1.0, -1.0, 0.5, 0.3]
            for name, messages in (
                ("/joint_states", states.fill(stamps, angle)),
                ("/ankle_torque", torques.fill(stamps, angle[:, :2])),
            ):
                for message, stamp in zip(messages, stamps.tolist(), strict=True):
                    writer.write(name, message, stamp, end)
    return folder


def measured(*arguments: object) -> tuple[float, float]:
    """Run a command; return how long it took [s] and its peak memory [MB]."""
    code = (
        "import re, sys; from gait_entrainment_commands import main; code = main(sys.argv[1:]);"
        "status = open('/proc/self/status').read();"
        "print(int(re.search(r'VmHWM:\\s+(\\d+)', status)[1]) / 1e3, file=sys.stderr);"
        "sys.exit(code)"
    )
    begin = time.perf_counter()
    ended = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True
    )
    took = time.perf_counter() - begin
    assert ended.returncode == 0, ended.stderr
    return took, float(ended.stderr.splitlines()[-1])


def test_one_hour(tmp_path: Path) -> None:
    bag = one_hour(tmp_path / "hour")
    with BagReader(bag) as reader:
        print(f"\n{reader.message_count} messages, {reader.size / 1e6:.0f} MB")
    for name, arguments in (
        ("info", ("bag", "info", bag)),
        ("analyze", ("analyze", bag)),
        ("analyze with figures", ("analyze", bag, "--figures", tmp_path / "figures")),
        ("simulate, for comparison", ("simulate",)),
    ):
        took, memory = measured(*arguments)
        print(f"{name}: {took:.2f} s, {memory:.0f} MB")
