# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Nodes stop when signalled, and torque ends with them."""

import signal
import time

import pytest
from harness import QUICK, cpu_seconds, session, stamp_of

from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.node_list import DISPLAY, NODES
from gait_entrainment_commands.signals import STOPPING
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_nodes.messaging.topics import ANKLE_TORQUE, PULSES, TORQUE_PROFILE

EACH = (*NODES, DISPLAY)
# From the signal to the end of the process [s], on a shared machine.
PROMPTLY = 5.0
# Pulses that are on nearly all the time.
BROAD = (*QUICK, "--pulses=2000", "--width=0.4", "--baseline=2")


def assert_idle(nodes):
    """Check that waiting costs little processor time."""
    before = {node: cpu_seconds(nodes.pid(node)) for node in EACH}
    begin = time.monotonic()
    nodes.probe.until(lambda: time.monotonic() - begin > 2.0, "the end of a long wait")
    waited = time.monotonic() - begin
    used = {n: (cpu_seconds(nodes.pid(n)) - before[n]) / waited for n in EACH}
    print({node: f"{share:.1%}" for node, share in used.items()})
    # A busy loop would use a whole core, or what the others leave of it.
    assert max(used.values()) < 0.15, used


@pytest.mark.parametrize("first", [0, 3])
def test_each_idle_node_uses_little_cpu_and_stops_cleanly(first, tmp_path):
    with session(tmp_path, nodes=EACH) as nodes:
        listeners = nodes.probe.node.get_subscriptions_info_by_topic
        nodes.probe.until(
            lambda: any(i.node_name == "bag_recorder" for i in listeners("/gait_events")),
            "the recorder's subscription",
        )
        if first == 0:
            assert_idle(nodes)
        for place, node in enumerate(EACH):
            number = STOPPING[(first + place) % len(STOPPING)]
            signalled_at = time.monotonic()
            nodes.signal(node, number)
            assert nodes.supervisor.wait(node, 10) == 0, nodes.supervisor.last_lines(node)
            assert time.monotonic() - signalled_at < PROMPTLY
            assert "Traceback" not in nodes.supervisor.last_lines(node)
            assert "[ERROR]" not in nodes.supervisor.last_lines(node)
    with BagReader(nodes.bag) as reader:
        assert "/gait_events" in reader.topics


def test_torque_ends_with_the_perturbator(tmp_path):
    with session(tmp_path, *BROAD) as nodes:
        pulses, profiles = nodes.probe.listen(PULSES), nodes.probe.listen(TORQUE_PROFILE)
        torques = nodes.probe.listen(ANKLE_TORQUE)
        handle = nodes.conduct()
        nodes.probe.until(lambda: len(pulses) > 2, "pulses")
        nodes.signal("perturbator", signal.SIGTERM)
        assert nodes.supervisor.wait("perturbator", 10) == 0
        nodes.probe.until(lambda: profiles[-1].stop, "the stop")
        # The walker goes on without torque until the experiment notices the missing perturbator.
        count = len(torques)
        nodes.probe.until(lambda: len(torques) > count + 200, "a walk without torque")
        answer = nodes.probe.result(handle)
        assert answer.result.outcome == RunProtocol.Result.FAILED
        assert "perturbator" in answer.result.message
    with BagReader(nodes.bag) as reader:
        recorded = list(reader.decoded(["/perturbation/torque_profile", "/ankle_torque"]))
    stops = [raw for raw, m in recorded if raw.topic.endswith("profile") and m.stop]
    assert len(stops) == 1
    side = nodes.protocol.side
    torque = {
        stamp_of(m.header): (raw.publish_time, m.delivered[side])
        for raw, m in recorded
        if raw.topic == "/ankle_torque"
    }
    assert any(value > 0 for _, value in torque.values())
    # A sample received after the stop by more than a message's travel time was walked after the
    # stop.
    after = [v for received, v in torque.values() if received > stops[0].publish_time + 10**8]
    assert len(after) > 100
    assert set(after) == {0.0}
