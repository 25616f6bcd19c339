# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Runs in which nodes hear each other late, by the switch in messaging/delays.py.

A pair of nodes is matched only once all have been up for a while, and whatever is sent takes a
time that differs between topics: who sends before it is heard, or counts on the order in which
topics arrive, loses something or stands still.
"""

import json
import os
import signal
import subprocess
import time

import pytest
from harness import (
    LONG,
    PATIENCE,
    QUICK,
    entrain_run,
    events_since_start,
    payloads,
    simulated_events,
)

from gait_entrainment_bags import BagReader
from gait_entrainment_nodes.messaging.delays import VARIABLE

SHORT = ("--baseline=3", "--pulses=4", "--washout=1", "--sample-rate=0", "--no-ground-reaction")
RESULTS = ("/gait/strides", "/gait/pulse_phases", "/gait/entrainment")
# Of each topic, at most [s].
DELIVERY = 0.03
# By when the nodes are up [s]; where they take longer it is tried again with more.
UP = (9.0, 25.0)


def delays(pair="", matched=0.0):
    """Return the environment in which a pair is matched at an instant, and all comes late."""
    chosen = {pair: {"matched": matched, "delivery": DELIVERY}, "*>*": {"delivery": DELIVERY}}
    return {VARIABLE: json.dumps(chosen)}


def before_all_were_up(bag, matched):
    """Return whether a pair was matched before each node had been there for a while."""
    with BagReader(bag) as reader:
        said = [(raw, log) for raw, log in reader.decoded(["/rosout"]) if "started" in log.msg]
        up = max(raw.publish_time for raw, _ in said) / 1e9
        begun = next(iter(reader.messages(["/gait_events"]))).publish_time / 1e9
    assert begun > matched
    return up > matched - 0.5


def run_late(tmp_path, pair, *options):
    """Run an experiment in which a pair is matched after all nodes are up; return its bag."""
    for up in UP:
        bag, matched = tmp_path / f"up_in_{up:g}", time.time() + up
        with entrain_run(bag, *options, "--json", **delays(pair, matched)) as run:
            assert run.outcome()["lost"] == 0
        if not before_all_were_up(bag, matched):
            return bag
    raise AssertionError(f"the nodes were not up within {UP[-1]} s")


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """Run what once stood still: acknowledgements were sent before the walker heard them."""
    return run_late(tmp_path_factory.mktemp("late"), "bag_recorder>walker_sim", *SHORT)


def test_acknowledgements_wait_until_the_walker_hears(live):
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
            timeout=2 * PATIENCE,
        )
        assert replayed.returncode == 0, replayed.stderr
        if not before_all_were_up(again, matched):
            break
    assert payloads(again, RESULTS) == payloads(live, RESULTS)


def test_an_interruption_is_quiet_when_all_comes_late(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", *LONG, **delays()) as run:
        run.wait_for_stride(1)
        run.process.send_signal(signal.SIGINT)
        assert run.wait() == 1
        assert run.survivors() == []
        (line,) = run.text.splitlines()
        assert line.startswith("entrain run: interrupted")
    with BagReader(run.bag) as reader:
        assert reader.counts["/gait_events"] > 2
