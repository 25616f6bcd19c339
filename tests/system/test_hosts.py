# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Nodes of one experiment on two hosts, joined by a link that delays and loses frames."""

import json
import os
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from harness import QUICK, TIMEOUT, events_since_start, simulated_events
from slow_link import SlowLink, obstacle

from gait_entrainment_bags import BagReader

WHY_NOT = obstacle()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)

# Topics that only the walker's host publishes.
WALKERS = ("/joint_states", "/gait_events", "/ankle_torque", "/ground_reaction/left")
WALKER_HOST, ROBOT_HOST = 0, 1


@pytest.fixture(scope="module")
def link():
    with SlowLink(delay=0.005, jitter=0.002, loss=0.01) as joined:
        yield joined


def environment(**more: str) -> dict[str, str]:
    return {**os.environ, "ROS_DOMAIN_ID": "7", **more}


@contextmanager
def started(command: Sequence[str], variables: dict[str, str]) -> Iterator[Any]:
    """Start a process; terminate it at the end."""
    process = subprocess.Popen(command, env=variables, text=True, stdout=subprocess.PIPE)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(TIMEOUT)


def run_command(bag: Path, *options: str) -> list[str]:
    return ["entrain", "run", "--elsewhere=walker_sim", "--no-figures", f"--out={bag}", *options]


def test_lock_step_matches_the_simulation_to_the_nanosecond(link, tmp_path):
    bag, options = tmp_path / "bag", ("--baseline=3", "--pulses=5", "--washout=1")
    before, lost = link.octets[WALKER_HOST], sum(link.lost)
    subnet = environment(ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    alone = environment(ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    node = link.on(WALKER_HOST, ["entrain", "node", "walker_sim", *options])
    ask = ["entrain", "ready", "walker_sim"]
    with (
        started(node, subnet),
        started(link.on(ROBOT_HOST, [*ask, "--timeout=8"]), alone) as stranger,
        started(link.on(ROBOT_HOST, [*ask, "--timeout=60"]), subnet) as friend,
        started(link.on(ROBOT_HOST, run_command(bag, "--json", *options)), subnet) as run,
    ):
        text, _ = run.communicate(timeout=TIMEOUT)
        assert run.returncode == 0
        # A process limited to its own host finds no node elsewhere.
        assert (friend.wait(TIMEOUT), stranger.wait(TIMEOUT)) == (0, 1)
    assert json.loads(text)["lost"] == 0
    events = events_since_start(bag)
    assert len(events) > 4 * 8
    assert events == simulated_events(bag)
    with BagReader(bag) as reader:
        sent = sum(len(message.data) for message in reader.messages(WALKERS))
    assert link.octets[WALKER_HOST] - before > sent
    assert sum(link.lost) > lost


def test_real_time_counts_the_stretches_that_a_slow_network_delays(link, tmp_path, monkeypatch):
    bag = tmp_path / "bag"
    options = (*QUICK, "--real-time", "--baseline=2", "--pulses=5", "--washout=1")
    # Heard only by this host and the named peer.
    here, there = (environment(ROS_STATIC_PEERS=peer) for peer in link.addresses)
    with (
        started(link.on(WALKER_HOST, ["entrain", "node", "walker_sim", *options]), there),
        started(link.on(ROBOT_HOST, run_command(bag, *options)), here) as run,
    ):
        until = link.carried[WALKER_HOST] + 2000
        while link.carried[WALKER_HOST] < until:
            assert run.poll() is None, run.stdout.read()
            time.sleep(0.02)
        # From here to the end of the run, a round trip takes longer than the lead time.
        monkeypatch.setattr(link, "delay", 0.25)
        text, _ = run.communicate(timeout=TIMEOUT)
    assert run.returncode == 0, text
    with BagReader(bag) as reader:
        stretches = {
            value.key: float(value.value)
            for _, message in reader.decoded(["/diagnostics"])
            for status in message.status
            for value in status.values
            if value.key.endswith("_stretches")
        }
    assert stretches["late_stretches"] > 0
    assert stretches["starved_stretches"] > 0
    assert f"of perturbator: {stretches['late_stretches']:.0f} late" in text
    assert "not reproducible" in text
