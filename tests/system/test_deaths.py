# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Processes that die or stall during a run: the others end and the bag stays readable."""

import os
import signal
import time

import pytest
from harness import LONG, TIMEOUT, entrain_run

from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.node_list import NODES

# From a death to the end of all processes [s]: how long a person may have to wait.
END_WITHIN = 5.0
# How long a silent process is tolerated before that [s].
SILENCE_TIMEOUT = 3.0


def assert_readable(bag):
    with BagReader(bag) as reader:
        assert reader.custom_data["protocol"]
        messages = sum(1 for _ in reader.messages())
    assert messages == reader.message_count > 100


def assert_ended_because_of(run, node, begin, limit):
    """Check how a run ended after one of its processes died or stalled."""
    assert run.wait() == 1, run.text
    assert run.ended_at - begin < limit, run.text
    assert run.survivors() == []
    first, *lines = run.text.splitlines()
    assert first.startswith("entrain run: ")
    assert node in first
    assert all(line.startswith(f"  {node}| ") for line in lines), run.text
    assert "Traceback" not in run.text
    assert_readable(run.bag)


@pytest.mark.parametrize("node", NODES)
def test_death_ends_the_run(node, tmp_path):
    # The bag may have to be rescued, so keep it small: the time for that depends on its size.
    small = ("--sample-rate=0", "--no-ground-reaction")
    with entrain_run(tmp_path / "bag", *LONG, *small) as run:
        run.wait_for_stride(200)
        begin = time.monotonic()
        os.kill(run.nodes[node], signal.SIGKILL)
        assert_ended_because_of(run, node, begin, END_WITHIN)
        assert "-9" in run.text


@pytest.mark.parametrize(
    ("mode", "stalled"),
    [(("--real-time",), NODES[:3]), (("--real-time",), NODES[3:]), ((), ("bag_recorder",))],
    ids=["real time, first nodes", "real time, other nodes", "lock-step"],
)
def test_stalled_process_ends_the_run(mode, stalled, tmp_path):
    # Several at once, because most of the time is spent waiting. Their duration then says nothing
    # about a single run, so the strict limit applies only to a lone run.
    limit = SILENCE_TIMEOUT + 2 * END_WITHIN if len(stalled) == 1 else TIMEOUT
    runs = {}
    try:
        for node in stalled:
            with_bag = entrain_run(tmp_path / node, *LONG, *mode)
            runs[node] = (with_bag, with_bag.__enter__())
        for node, (_, run) in runs.items():
            run.wait_for_stride(2 if mode else 200)
            begin = time.monotonic()
            os.kill(run.nodes[node], signal.SIGSTOP)
            runs[node] += (begin,)
        for node, (_, run, begin) in runs.items():
            assert_ended_because_of(run, node, begin, limit)
    finally:
        for with_bag, *_ in runs.values():
            with_bag.__exit__(None, None, None)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_ends_the_run_cleanly(number, tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", *LONG) as run:
        run.wait_for_stride(1)
        begin = time.monotonic()
        run.process.send_signal(number)
        assert run.wait() == 1
        assert run.ended_at - begin < END_WITHIN
        assert run.survivors() == []
        assert run.text.splitlines() == [
            f"entrain run: interrupted; the bag of the run so far is {run.bag}"
        ]
        assert_readable(run.bag)


def test_nothing_outlives_a_killed_command(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", *LONG) as run:
        run.wait_for_stride(1)
        run.process.kill()
        run.wait()
        begin = time.monotonic()
        while run.survivors():
            assert time.monotonic() - begin < END_WITHIN
            time.sleep(0.02)  # only their parent could wait for their end
        assert_readable(run.bag)
