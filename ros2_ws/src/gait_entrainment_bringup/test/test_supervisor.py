# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The supervisor: processes are stopped in order and killed if they do not obey."""

import os
import signal
import threading
import time

import pytest

from gait_entrainment_bringup import supervisor as module
from gait_entrainment_bringup.supervisor import LOG_LINES, TIMEOUT, Supervisor
from gait_entrainment_commands.signals import STOPPING, stop_on_signals

OBEDIENT = """
import signal, sys, time
def stop(*_):
    print(sys.argv[0], "stopped", time.time_ns(), flush=True)
    sys.exit()
def main():
    signal.signal(signal.SIGTERM, stop)
    print("up", flush=True)
    while True: time.sleep(0.02)
"""
STUBBORN = OBEDIENT.replace("stop)", "signal.SIG_IGN)")
BROKEN = """
import sys
def main():
    for i in range(1, 13): print("line", i, file=sys.stderr)
    return 3
"""


@pytest.fixture
def programs(tmp_path, monkeypatch):
    """Make modules that replace the nodes of the package."""
    folder = tmp_path / "stand_in" / "nodes"
    folder.mkdir(parents=True)
    scripts = {"one": OBEDIENT, "two": OBEDIENT, "three": OBEDIENT, "four": OBEDIENT}
    for name, text in {**scripts, "stubborn": STUBBORN, "broken": BROKEN}.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.setattr(module, "PACKAGE", "stand_in")
    monkeypatch.syspath_prepend(tmp_path)
    logs = tmp_path / "logs"
    logs.mkdir()
    supervisor = Supervisor(logs, os.environ)
    yield supervisor
    supervisor.stop(list(supervisor._processes))


def started(supervisor, *names):
    for name in names:
        supervisor.start(name, [])
    deadline = time.monotonic() + 10
    while not all("up" in supervisor.last_lines(name) for name in names):
        assert time.monotonic() < deadline


def stopped_at(supervisor, name):
    return int(supervisor.last_lines(name).split()[-1])


def test_first_ends_before_the_next_is_stopped_and_last_ends_last(programs):
    started(programs, "one", "two", "three", "four")
    assert programs.ended() == {}
    assert programs.stop(["three", "one", "two", "four"]) == []
    assert programs.ended() == dict.fromkeys(("one", "two", "three", "four"), 0)
    first, last = stopped_at(programs, "three"), stopped_at(programs, "four")
    between = [stopped_at(programs, "one"), stopped_at(programs, "two")]
    assert first < min(between) <= max(between) < last


@pytest.mark.usefixtures("programs")
def test_a_node_that_is_stopped_as_it_starts_ends_silently(tmp_path, capfd):
    before = {number: signal.getsignal(number) for number in STOPPING}
    stop_on_signals()
    try:
        forking = Supervisor(tmp_path / "logs", os.environ, "fork")
        for _ in range(10):
            forking.start("one", [])
            forking.stop(["one"])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert capfd.readouterr().err == ""


def test_a_process_that_does_not_obey_is_killed(programs):
    started(programs, "one", "stubborn")
    begin = time.monotonic()
    assert programs.stop(["stubborn", "one"]) == ["stubborn"]
    assert time.monotonic() - begin >= TIMEOUT
    assert programs.ended() == {"stubborn": -signal.SIGKILL, "one": 0}


@pytest.fixture
def interruptible():
    """Handle Ctrl-C, even if the tests run in the background of a shell, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_second_ctrl_c_does_not_interrupt_the_stopping(programs):
    started(programs, "one", "stubborn", "two")
    impatient = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    impatient.start()
    assert programs.stop(["stubborn", "one", "two"]) == ["stubborn"]
    impatient.join()
    assert programs.ended() == {"stubborn": -signal.SIGKILL, "one": 0, "two": 0}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_suspended_process_can_obey(programs):
    started(programs, "one")
    os.kill(programs._processes["one"].pid, signal.SIGSTOP)
    assert programs.stop(["one"]) == []
    assert programs.ended() == {"one": 0}


def test_end_of_a_process_is_noticed_with_its_last_lines(programs):
    programs.start("broken", [])
    assert programs.wait("broken", 10) == 3
    assert programs.ended() == {"broken": 3}
    lines = programs.last_lines("broken").splitlines()
    assert len(lines) == LOG_LINES
    assert lines[-1] == "  broken| line 12"
    assert programs.last_lines("never started") == ""


def test_waiting_times_out(programs):
    started(programs, "one")
    assert programs.wait("one", 0.01) is None


def test_the_end_of_an_onlooker_is_not_a_failure(programs):
    programs.start("broken", [], "stand_in.nodes")
    assert programs.wait("broken", 10) == 3
    assert programs.check(may_end=()) == {"broken": 3}
