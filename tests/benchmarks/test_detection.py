# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Five detectors at once in real time: what is lost, and how soon an event is published."""

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


def play(domain):
    """Publish what all emulated sensors measure, each sample at its instant; print how many."""
    walker = Walker(WalkerParameters())
    events = [GaitEvent(t.stamp, t.kind, t.side, t.step) for t in walker.advance(SECONDS * SECOND)]
    rclpy.init(domain_id=domain)
    node = rclpy.create_node("sensors")
    due = []  # instant, what makes the message, its publisher, and the values
    for name in detector_names():
        kind = USUAL.get(name, name)
        signals = KINDS[kind][0]
        source = source_of(kind, signals)
        for side, topic in zip(Side, sensor_topics(source), strict=True):
            sensor, writer = EmulatedSensor(kind, side), SensorWriter(source, side, signals)
            offered = f"{name}/{topic.name}"
            publisher = node.create_publisher(topic.type, offered, EVERY_MESSAGE_IN_REAL_TIME)
            instants = sensor.due(SECONDS * SECOND)
            measured = sensor.measure(instants, walker.sample(instants), events)
            due += [
                (instant, writer, publisher, values)
                for instant, (_, values) in zip(instants.tolist(), measured, strict=True)
            ]
    due.sort(key=lambda sample: sample[0])
    publishers = {id(publisher): publisher for _, _, publisher, _ in due}.values()
    while not all(publisher.get_subscription_count() for publisher in publishers):
        time.sleep(0.01)
    print("begins", flush=True)
    start, late = time.time_ns() + SECOND // 10, []
    for instant, writer, publisher, values in due:
        early = start + instant - time.time_ns()
        if early > 0:
            time.sleep(early / SECOND)
        publisher.publish(writer.write([(start + instant, values)])[0])
        late.append(time.time_ns() - start - instant)
    print(len(due), np.quantile(late, 0.99) / MILLISECOND)
    time.sleep(2.0)  # until the last have arrived, and the detectors have said so
    rclpy.shutdown()


def test_events_come_soon_after_the_sample_that_decides():
    names = detector_names()
    delays = {name: [] for name in names}
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
                delays[name].append(time.time_ns() - at.sec * SECOND - at.nanosec)

            def note_samples(message: DiagnosticArray) -> None:
                for status in message.status:
                    values = {pair.key: pair.value for pair in status.values}
                    if "samples" in values:
                        heard[status.name] = int(values["samples"])

            client.subscribe(GAIT_EVENTS._replace(name=f"{name}/{GAIT_EVENTS.name}"), note)
            client.subscribe(DIAGNOSTICS, note_samples)
        player = subprocess.Popen(
            [sys.executable, __file__, str(domain)], stdout=subprocess.PIPE, text=True
        )
        stack.callback(player.kill)
        player.stdout.readline()
        for name in names:
            service = f"{name}/walker/start"
            client.service(StartRun, service)
            begun = StartRun.Request(run=1)
            client.call(StartRun, service, begun, accept=lambda r: r.success, period=0.5)
        client.wait(lambda: player.poll() is not None, SECONDS + 60.0)
        sent, late = player.stdout.read().split()
    print(f"\n{sent} samples sent, {late} ms late (99 %); {sum(heard.values())} heard")
    for name, found in delays.items():
        p50, p99 = np.quantile(found, (0.5, 0.99)) / MILLISECOND
        print(f"{name}: {len(found)} events, {p50:.2f} ms (median), {p99:.2f} ms (99 %) after it")
    together = np.quantile(np.concatenate([*delays.values()]), 0.99) / MILLISECOND
    print(f"all: {together:.2f} ms (99 %)")
    assert sum(heard.values()) == int(sent)


def environment(domain):
    import os

    return {**os.environ, "ROS_DOMAIN_ID": str(domain)}


if __name__ == "__main__":
    play(int(sys.argv[1]))
