# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A hanging spectator delays nobody in real time, is named in lock-step, disturbs no other run."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from harness import LONG, QUICK, entrain_run, open_files

# After this long, a suspended reader of shared memory used to hold up its writers for seconds [s].
HUNG_FOR = 12.0
# A process of somebody else, for instance `ros2 topic echo`.
FOREIGN = "import rclpy; rclpy.init(); rclpy.create_node('foreign'); rclpy.shutdown()"


@pytest.fixture
def suspend(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], int]]:
    """Start a reader of every topic of the next run; yield what suspends it, once it hears."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "230")  # which no run chooses by itself
    program = Path(__file__).with_name("spectator.py")
    spectator = subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True)
    assert spectator.stdout is not None
    words = iter(spectator.stdout)

    def suspend() -> int:
        assert next(words) == "hears\n"
        os.kill(spectator.pid, signal.SIGSTOP)
        return spectator.pid

    try:
        assert next(words) == "listens\n"  # so that a short run is not over first
        yield suspend
    finally:
        spectator.kill()
        spectator.wait()


def test_in_real_time_a_suspended_reader_delays_no_other_process(tmp_path, suspend):
    # The run ends before the spectator's participant is considered lost (20 s).
    options = (*QUICK, "--baseline=2", "--pulses=24", "--washout=2", "--sample-rate=1000")
    with entrain_run(tmp_path / "bag", *options, "--real-time", "--json") as run:
        suspend()
        begin = time.monotonic()
        outcome = run.outcome()
        assert run.ended_at - begin > HUNG_FOR
    assert outcome["lost"] == 0
    # A late stretch would mean that a publisher was held up.
    assert outcome["promises"]["late_stretches"] == 0
    assert outcome["promises"]["starved_stretches"] == 0


def test_in_real_time_a_run_with_a_suspended_reader_stops_like_any_other(tmp_path, suspend):
    with entrain_run(tmp_path / "bag", *LONG, "--real-time", "--sample-rate=1000") as run:
        suspend()
        run.wait_for_stride(12)
        begin = time.monotonic()
        run.process.send_signal(signal.SIGINT)
        assert run.wait() == 1
        assert "interrupted" in run.text
        assert run.ended_at - begin < 5.0
        assert run.survivors() == []


def test_in_lock_step_a_suspended_reader_is_named_and_disturbs_no_other_domain(
    tmp_path, suspend, monkeypatch
):
    with entrain_run(tmp_path / "bag", *LONG) as run:
        spectator = suspend()
        assert run.wait() == 1
        assert f"held up by process {spectator} " in run.text.splitlines()[0]
    # What it may be left with: a port that is locked, but has no segment. Fast DDS reports that
    # wherever a process looks for a free port there: not among results, and never in ours.
    locked = re.findall(r"/dev/shm/fastrtps_port(7[0-3]\d\d)_el", str(open_files(spectator)))
    (port,) = map(int, locked)
    Path(f"/dev/shm/fastrtps_port{port}").unlink(missing_ok=True)
    monkeypatch.setenv("GAIT_ENTRAINMENT_PORT_BASE", str(port + 400))
    monkeypatch.setenv("ROS_DOMAIN_ID", "229")
    foreign = subprocess.run(
        [sys.executable, "-c", FOREIGN], capture_output=True, text=True, check=False
    )
    assert "Failed init_port" in foreign.stderr
    assert foreign.stdout == ""
    words = ["entrain", "ready", "nobody", "--timeout=0"]
    ours = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ours.stderr == "entrain ready: nobody does not answer\n"
