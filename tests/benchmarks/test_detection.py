# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Five detectors together in real time: what is lost, and how soon an event is published.

The delay of an event counts from when the sample that decided it was published, because a late
player of samples is no fault of the detectors. Player and listener have priority over other
processes, as the detectors do.
"""

import gc
import os
import subprocess
import sys
import time
from contextlib import ExitStack

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray

from gait_entrainment.conventions import Side
from gait_entrainment.gait import GaitEvent
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.environment import PRIORITY, come_before_others
from gait_entrainment_nodes.messaging.sensors import SensorWriter
from gait_entrainment_nodes.messaging.topics import (
    DIAGNOSTICS,
    EVERY_MESSAGE_IN_REAL_TIME,
    GAIT_EVENTS,
    sensor_topics,
)
from gait_entrainment_sensors.detection import detector_names
from gait_entrainment_sensors.emulated import KINDS, USUAL, EmulatedSensor
from gait_entrainment_sensors.sources import source_of

pytestmark = pytest.mark.benchmark

SECONDS = 40
SECOND, MILLISECOND = 10**9, 10**6
DETECTOR = "from gait_entrainment_nodes.nodes.gait_detector import main; raise SystemExit(main())"


def play(domain, file):
    """
    Publish what all emulated sensors measure, each sample at its time.

    The file gets the stamps of each detector's samples and when they were published [ns].
    """
    walker = Walker(WalkerParameters())
    events = [GaitEvent(t.stamp, t.kind, t.side, t.step) for t in walker.advance(SECONDS * SECOND)]
    rclpy.init(domain_id=domain)
    node = rclpy.create_node("sensors")
    due = []  # stamp, detector, what makes the message, its publisher, and the values
    for name in detector_names():
        kind = USUAL.get(name, name)
        signals = KINDS[kind][0]
        source = source_of(kind, signals)
        for side, topic in zip(Side, sensor_topics(source), strict=True):
            sensor, writer = EmulatedSensor(kind, side), SensorWriter(source, side, signals)
            offered = f"{name}/{topic.name}"
            publisher = node.create_publisher(topic.type, offered, EVERY_MESSAGE_IN_REAL_TIME)
            stamps = sensor.due(SECONDS * SECOND)
            measured = sensor.measure(stamps, walker.sample(stamps), events)
            due += [
                (stamp, name, writer, publisher, values)
                for stamp, (_, values) in zip(stamps.tolist(), measured, strict=True)
            ]
    due.sort(key=lambda sample: sample[0])
    publishers = {id(publisher): publisher for _, _, _, publisher, _ in due}.values()
    while not all(publisher.get_subscription_count() for publisher in publishers):
        time.sleep(0.01)
    print("begins", flush=True)
    come_before_others(PRIORITY)  # like a sensor that needs no processor of this host
    gc.freeze()
    gc.disable()  # there are many samples, and none of them is garbage
    start, published = time.time_ns() + SECOND // 10, []
    for stamp, _, writer, publisher, values in due:
        early = start + stamp - time.time_ns()
        if early > 0:
            time.sleep(early / SECOND)
        publisher.publish(writer.write([(start + stamp, values)])[0])
        published.append(time.time_ns())
    by_name = {name: [] for _, name, _, _, _ in due}
    for (stamp, name, *_), when in zip(due, published, strict=True):
        by_name[name].append((start + stamp, when))
    np.savez(file, **by_name)
    time.sleep(2.0)  # until the last have arrived and the detectors have reported them
    rclpy.shutdown()


def test_events_are_published_soon_after_the_sample_that_decides_them(tmp_path):
    names = detector_names()
    found = {name: [] for name in names}  # deciding sample's stamp, when the event was heard [ns]
    heard = {}
    with ExitStack() as stack:
        domain = stack.enter_context(claimed_domain())
        client = stack.enter_context(Client("listener", domain=domain))
        for name in names:
            settings = {"__ns": f"/{name}", "detector": name, "use_sim_time": "false"}
            words = [
                word
                for key, value in settings.items()
                for word in ("-r" if key == "__ns" else "-p", f"{key}:={value}")
            ]
            command = [sys.executable, "-c", DETECTOR, "--ros-args", *words]
            process = subprocess.Popen(command, env=environment(domain), stderr=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.terminate)

            def note(event: msg.GaitEvent, name: str = name) -> None:
                at = event.detected_at
                found[name].append((at.sec * SECOND + at.nanosec, time.time_ns()))

            def note_samples(message: DiagnosticArray) -> None:
                for status in message.status:
                    values = {pair.key: pair.value for pair in status.values}
                    if "samples" in values:
                        heard[status.name] = int(values["samples"])

            client.subscribe(GAIT_EVENTS._replace(name=f"{name}/{GAIT_EVENTS.name}"), note)
            client.subscribe(DIAGNOSTICS, note_samples)
        player = subprocess.Popen(
            [sys.executable, __file__, str(domain), tmp_path / "sent.npz"], stdout=subprocess.PIPE
        )
        stack.callback(player.kill)
        player.stdout.readline()
        come_before_others(PRIORITY)
        stack.callback(os.sched_setscheduler, 0, os.SCHED_OTHER, os.sched_param(0))
        for name in names:
            service = f"{name}/walker/start"
            client.service(StartRun, service)
            request = StartRun.Request(run=1)
            client.call(StartRun, service, request, accept=lambda r: r.success, period=0.5)
        client.wait(lambda: player.poll() is not None, SECONDS + 60.0)
    sent = np.load(tmp_path / "sent.npz")
    start = min(stamps[0, 0] for stamps in sent.values())
    count = sum(map(len, sent.values()))
    print(f"\n{count} samples sent, {sum(heard.values())} heard")
    print_delays("samples after their stamps", start, np.concatenate([*sent.values()]))
    together = []
    for name, pairs in found.items():
        stamps, published = sent[name].T
        assert pairs, f"{name}: no event"
        decided, heard_at = np.array(pairs).T
        # A stamp that was converted to seconds and back is off by less than a microsecond.
        place = np.searchsorted(stamps, decided - MILLISECOND // 10)
        together.append(np.column_stack([published[place], heard_at]))
        print_delays(name, start, together[-1])
    print_delays("all events", start, np.concatenate(together))
    assert sum(heard.values()) == count


def print_delays(what, start, pairs):
    """Print how much later the second of two times [ns] is, and when it is late."""
    late = (pairs[:, 1] - pairs[:, 0]) / MILLISECOND
    p50, p99 = np.quantile(late, (0.5, 0.99))
    seconds = np.unique((pairs[late > 5.0, 0] - start) // SECOND)
    print(
        f"{what}: {late.size}, {p50:.2f} ms (median), {p99:.2f} ms (99 %), {late.max():.0f} ms "
        f"(most); {np.sum(late > 5.0)} by over 5 ms, in seconds {', '.join(map(str, seconds))}"
    )


def environment(domain):
    return {**os.environ, "ROS_DOMAIN_ID": str(domain)}


if __name__ == "__main__":
    play(int(sys.argv[1]), sys.argv[2])
