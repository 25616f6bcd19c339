# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A person as the walker: rehearsed through sensors, played by another process, with faults."""

import os
import re
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from harness import (
    Feet,
    entrain_run,
    events_since_start,
    protocol_of,
    session,
    simulated_events,
    stamp_of,
)
from harness import probe as other_probe
from std_msgs.msg import String

from gait_entrainment.conventions import Side
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.node_list import nodes_for
from gait_entrainment_commands.outcome import outcome_of
from gait_entrainment_msgs.srv import Ready, StartRun
from gait_entrainment_nodes.messaging.topics import DIAGNOSTICS, GAIT_EVENTS
from gait_entrainment_sensors import find_detector
from gait_entrainment_sensors.rehearsal import Sensors, rehearse

EXAMPLE = Path(__file__).parents[2] / "docs/examples/outside_walker.py"
# Near the locked phase, so that few pulses suffice; the verdict needs 25 of them.
LOCKING = ("--baseline=3", "--pulses=30", "--washout=2", "--initial-phase=0.65")
SHORT = ("--baseline=3", "--pulses=3", "--washout=1")
SENSED = ("--walker=sensed", "--detector=foot_switch", "--sample-rate=0", "--json")
SECOND = 10**9


def test_rehearsal_gives_the_verdict_of_exact_events_and_reports_its_errors(tmp_path):
    with entrain_run(tmp_path / "bag", *SENSED, *LOCKING) as run:
        outcome = run.outcome()
    exact = outcome_of(simulate(protocol_of(*LOCKING)))
    assert outcome["verdict"] == exact["verdict"] == "entrained"
    assert outcome["lost"] == 0
    errors = outcome["detector_errors"]
    for kind in ("heel_strike", "toe_off"):
        summary = errors[kind]
        assert summary["events"] > 60
        assert (summary["missed"], summary["false"]) == (0, 0)
        assert abs(summary["bias"]) < 0.005
        assert 0 < summary["deviation"] < 0.005
    assert abs(errors["phase_lag_shift"]) < 0.005
    assert abs(outcome["final_phase_lag"] - exact["final_phase_lag"]) < 0.005
    assert 0 < outcome["final_phase_lag_uncertainty"] < 0.01
    with BagReader(tmp_path / "bag") as bag:
        events = [m for _, m in bag.decoded(["/gait_events"])]
    assert {(e.source, e.detector) for e in events} == {("gait_detector", "foot_switch")}
    # The same, to the nanosecond, as one process detects without ROS.
    offline = rehearse(
        protocol_of(*LOCKING), Sensors("foot_switch", find_detector("foot_switch"), Side.RIGHT)
    )
    start = 946_684_800 * SECOND
    found = [(stamp_of(e.header) - start, e.kind, e.side) for e in events]
    assert found == [(e.stamp, e.kind, e.side) for e in offline.events]


def test_a_variable_walker_walks_as_in_the_simulation(tmp_path):
    options = ("--variation-coefficient=0.03", "--seed=4", *SHORT, "--sample-rate=0", "--json")
    with entrain_run(tmp_path / "bag", *options) as run:
        periods = run.outcome()["stride_period"]
    assert max(periods) - min(periods) > 0.01
    assert events_since_start(tmp_path / "bag") == simulated_events(tmp_path / "bag")


def test_rehearsal_in_real_time_loses_nothing(tmp_path):
    options = ("--real-time", "--walker=sensed", "--detector=vertical_force", "--json", *SHORT)
    with entrain_run(tmp_path / "bag", *options) as run:
        outcome = run.outcome()
    assert outcome["lost"] == 0
    assert len(outcome["stride_period"]) == 7
    errors = outcome["detector_errors"]
    assert sum(errors[kind]["found"] for kind in ("heel_strike", "toe_off")) > 26
    assert sum(errors[k][w] for k in ("heel_strike", "toe_off") for w in ("missed", "false")) == 0
    with BagReader(tmp_path / "bag") as bag:
        samples = bag.counts["/ground_reaction/left"]
        (late,) = [
            value.value
            for _, message in bag.decoded(["/diagnostics"])
            for status in message.status
            if status.name == "gait_detector: run"
            for value in status.values
            if value.key == "late_events"
        ]
    assert samples > 12_000
    assert late.isdigit()  # it is reported; the number depends on what else is running


def test_a_sensor_that_falls_silent_ends_the_torque(tmp_path):
    options = ("--real-time", "--walker=sensed", "--detector=foot_switch", "--baseline=2")
    with entrain_run(tmp_path / "bag", *options) as run:
        run.names = nodes_for("sensed")
        run.wait_for_stride(3)
        os.kill(run.nodes["sensor_sim"], signal.SIGSTOP)
        assert run.wait() == 1
    assert "the gait has stopped: no heel strike of the right leg" in run.text
    with BagReader(tmp_path / "bag") as bag:
        profiles = [m for _, m in bag.decoded(["/perturbation/torque_profile"])]
    assert any(profile.onsets for profile in profiles)
    assert profiles[-1].stop or not any(profiles[-1].torques)


def test_another_process_can_play_the_walker(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "231")  # which no run chooses by itself
    outside = subprocess.Popen([sys.executable, EXAMPLE], stderr=subprocess.PIPE, text=True)
    try:
        options = ("--real-time", "--walker=person", "--elsewhere=walker", "--json")
        with entrain_run(tmp_path / "bag", *options, *SHORT) as run:
            outcome = run.outcome()
    finally:
        outside.send_signal(signal.SIGINT)
        stderr = outside.communicate()[1]
    assert outside.returncode == 0
    # Fast DDS may report a port of a suspended process, as the example is not one of ours.
    assert [line for line in stderr.splitlines() if "RTPS_TRANSPORT_SHM" not in line] == []
    assert outcome["lost"] == 0
    assert outcome["stride_period"] == pytest.approx([0.8] * 7, abs=1e-9)
    assert outcome["final_phase_lag_uncertainty"] == 0.001


def test_sensor_faults_are_reported_by_name(tmp_path):
    detector = "vertical_force:longest_constant=0.3"
    nodes = ("gait_detector",)
    with session(tmp_path, nodes=nodes, walker="person", detector=detector) as nodes:
        probe = nodes.probe
        heard, events = probe.listen(DIAGNOSTICS), probe.listen(GAIT_EVENTS)
        probe.client.service(StartRun, "walker/start")

        def waits_for():
            return probe.call(Ready, "gait_detector/ready").waiting_for

        def reported(pattern):
            texts = [status.message for array in heard for status in array.status]
            return [text for text in texts if re.search(pattern, text)]

        assert (
            "ground_reaction/left [geometry_msgs/msg/WrenchStamped]: not published" in waits_for()
        )
        with other_probe(nodes.domain) as other:  # a process can use only one type per topic
            other.node.create_publisher(String, "ground_reaction/left", 10)
            probe.until(lambda: "published as std_msgs/msg/String" in waits_for(), "a wrong type")
            refused = probe.client.call(StartRun, "walker/start", StartRun.Request(run=1))
            assert not refused.success
            assert "gait_detector waits for ground_reaction/left" in refused.message
        feet = Feet(probe)
        feet.ahead = -3 * SECOND  # clocks that are not synchronized
        feet.until(lambda: "stamps are 3 s behind" in waits_for(), "the wrong clock")
        feet.ahead = 0
        feet.until(lambda: not waits_for(), "readiness")
        start = probe.client.ask(StartRun, "walker/start", StartRun.Request(run=1), period=60.0)
        assert feet.until(start.answer, "the start").success
        feet.until(lambda: len(events) > 8, "events")
        assert {e.run for e in events} == {1}
        assert [e.step for e in events] == sorted(e.step for e in events)
        for value, message in (
            (float("nan"), "samples are not numbers"),
            (500.0, "times the signal did not change"),
            (8e4, "are impossible: the ground's force"),
        ):
            feet.value = value
            feet.until(lambda message=message: reported(message), f"the report of {value}")
        feet.value = None
        feet.silent = {Side.RIGHT}
        feet.until(
            lambda: reported(r"right vertical_force: no sample for \d"), "the report of silence"
        )
        count = len(events)
        feet.silent = set()
        feet.until(lambda: len(events) > count + 8, "events after all that")
        assert all(b.step >= a.step for a, b in pairwise(events))
        feet.ahead = -SECOND // 4
        jumped = "left: the sensor's clock jumped back.*right: the sensor's clock"
        feet.until(lambda: reported(jumped), "the report of a clock jump")
