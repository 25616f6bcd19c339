# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Runs in which nodes hear each other late, changed by late_nodes/sitecustomize.py.

A pair of nodes is matched only once all have been up for a while, and delivery takes a time that
differs between topics. A node that sends before it is heard, or relies on the order in which
topics arrive, loses messages or gets stuck.
"""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from harness import (
    LONG,
    QUICK,
    TIMEOUT,
    entrain_run,
    events_since_start,
    payloads,
    simulated_events,
)

from gait_entrainment_bags import BagReader

SHORT = ("--baseline=3", "--pulses=4", "--washout=1", "--sample-rate=0", "--no-ground-reaction")
RESULTS = ("/gait/strides", "/gait/pulse_phases", "/gait/entrainment")
# The longest of any topic [s].
DELIVERY = 0.03
# Time allowed for all nodes to be up [s]; if they take longer, the next one is tried.
UP = (9.0, 25.0)


def delays(pair="", matched=0.0):
    """Return an environment in which a pair is matched at this time and every message is late."""
    chosen = {pair: {"matched": matched, "delivery": DELIVERY}, "*>*": {"delivery": DELIVERY}}
    paths = str(Path(__file__).with_name("late_nodes")), os.environ.get("PYTHONPATH", "")
    return {"LATE_NODES": json.dumps(chosen), "PYTHONPATH": os.pathsep.join(filter(None, paths))}


def matched_too_early(bag, matched):
    """Return whether a pair was matched before all nodes had been up for a while."""
    with BagReader(bag) as reader:
        starts = [(raw, log) for raw, log in reader.decoded(["/rosout"]) if "started" in log.msg]
        up = max(raw.publish_time for raw, _ in starts) / 1e9
        first_event = next(iter(reader.messages(["/gait_events"]))).publish_time / 1e9
    assert first_event > matched
    return up > matched - 0.5


def run_late(tmp_path, pair, *options):
    """Run an experiment in which a pair is matched after all nodes are up; return its bag."""
    for up in UP:
        bag, matched = tmp_path / f"up_in_{up:g}", time.time() + up
        with entrain_run(bag, *options, "--json", **delays(pair, matched)) as run:
            assert run.outcome()["lost"] == 0
        if not matched_too_early(bag, matched):
            return bag
    raise AssertionError(f"the nodes were not up within {UP[-1]} s")


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """Run a case that once got stuck: acknowledgements were sent before the walker heard them."""
    return run_late(tmp_path_factory.mktemp("late"), "bag_recorder>walker_sim", *SHORT)


def test_acknowledgements_wait_until_the_walker_hears_them(live):
    assert events_since_start(live) == simulated_events(live)


def test_a_walk_in_real_time_waits_until_it_is_heard(tmp_path):
    bag = run_late(tmp_path, "walker_sim>experiment", "--real-time", *QUICK, *SHORT)
    with BagReader(bag) as reader:
        assert len(list(reader.messages(["/gait/pulse_phases"]))) == 4


def test_a_replay_waits_until_it_is_heard(live, tmp_path):
    for up in UP:
        again, matched = tmp_path / f"up_in_{up:g}", time.time() + up
        replayed = subprocess.run(
            ["entrain", "replay", str(live), "--out", str(again)],
            env=os.environ | delays("bag_player>gait_analyzer", matched),
            capture_output=True,
            text=True,
            timeout=2 * TIMEOUT,
        )
        assert replayed.returncode == 0, replayed.stderr
        if not matched_too_early(again, matched):
            break
    assert payloads(again, RESULTS) == payloads(live, RESULTS)


def test_an_interruption_is_quiet_when_all_messages_are_late(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", *LONG, **delays()) as run:
        run.wait_for_stride(1)
        run.process.send_signal(signal.SIGINT)
        assert run.wait() == 1
        assert run.survivors() == []
        (line,) = run.text.splitlines()
        assert line.startswith("entrain run: interrupted")
    with BagReader(run.bag) as reader:
        assert reader.counts["/gait_events"] > 2
