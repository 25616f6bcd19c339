# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop reaches every robot on this machine, so nothing else may run alongside."""

import os
import re
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from harness import entrain_run
from test_drivers import entrain

from gait_entrainment_drivers.stop_channel import (
    PREFIX,
    StopAnswer,
    StopListener,
    listening,
    stop_all,
)


def test_stop_from_the_command_line_ends_a_run(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", "--baseline=2") as run:
        run.wait_for_stride(2)
        code, out, err = entrain(run.domain(), "stop")
        assert code == 0, out + err
        assert re.search(r"perturbator/\d+: the stop is latched", out)
        assert run.wait() == 1
        assert "stopped: A stop was requested." in run.text


def test_a_stop_before_there_is_a_robot_is_not_forgotten(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time") as run:
        while not any(name.startswith("entrain_run/") for name in listening()):
            time.sleep(0.01)
        stop_all(0.0)
        assert run.wait() == 1
        assert "entrain run: the stop was called" in run.text


def test_stop_that_finds_no_robot_reports_so():
    code, out, err = entrain(None, "stop")
    assert (code, out) == (1, "")
    assert "no robot is driven by this machine" in err


ZERO = StopAnswer(True, 'it is "zero", \N{GREEK SMALL LETTER TAU} = 0')


@contextmanager
def stop_listener(answer=ZERO):
    """Listen for stops in a thread and give each the answer; yield the senders."""
    listener, senders, over = StopListener("some body"), [], threading.Event()

    def listen():
        while not over.is_set():
            if select.select([listener], [], [], 0.02)[0]:
                requests = listener.requests()
                if isinstance(answer, bytes):
                    listener._socket.sendto(answer, requests[0])
                else:
                    listener.answer(requests, answer)
                senders.extend(requests)

    thread = threading.Thread(target=listen)
    thread.start()
    try:
        yield senders
    finally:
        over.set()
        thread.join()
        listener.close()


HERE = {name: os.environ[name] for name in ("PATH", "PYTHONPATH")}  # no home folder, no ROS
ALONE = {"PATH": "", "PYTHONPATH": os.pathsep.join(sys.path)}  # no perl


@pytest.mark.parametrize("word", ["", "now!"])
@pytest.mark.parametrize(
    "environment",
    [
        HERE,
        {"PATH": ""},  # no project
        HERE | {"PERL5OPT": "-MNoSuchModule", "PERL5LIB": "/nowhere", "LC_ALL": "xx"},
        HERE | {"PYTHONHOME": "/nowhere"},
        ALONE,
    ],
)
def test_a_stop_is_done_and_reported_whatever_the_environment(tmp_path, environment, word):
    (tmp_path / "socket.py").write_text("raise SystemExit('a module of the user, by chance')")
    (tmp_path / "python3").symlink_to(sys.executable)
    if environment is ALONE:
        environment = ALONE | {"PATH": str(tmp_path)}
    words = [shutil.which("entrain"), "stop", *word.split()]
    with stop_listener() as senders:
        done = subprocess.run(
            words, capture_output=True, text=True, env=environment, cwd=tmp_path, check=False
        )
        assert len(senders) == 1
    assert done.stdout == f"some_body/{os.getpid()}: {ZERO.message}\n"
    assert done.stderr == ("entrain stop: unknown words: now!\n" if word else "")
    assert done.returncode == 0


def test_help_stops_no_robot():
    with stop_listener() as senders:
        subprocess.run(["entrain", "stop", "--help"], capture_output=True, check=True)
        assert not senders


@pytest.mark.parametrize("strange", [b"no json", b"[1]", b'{"done": true, "message": "", "n": 1}'])
def test_strange_sockets_and_answers_do_not_prevent_a_stop(strange):
    other, nameless = (socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(2))
    other.bind(b"\0gait_entrainment/\xff\x00\xfe")
    with other, nameless, stop_listener() as senders, stop_listener(strange):
        answers = stop_all(0.2)
        assert len(answers) == 2
        assert [name for name in answers if answers[name].done] == [f"some_body/{os.getpid()}"]
        code, out, err = entrain(None, "stop")
        assert code == 1
        assert out.count(ZERO.message) == 1
        assert out.count("does not answer") == 1
        assert "did not confirm the stop: cut the power" in err
        nameless.sendto(b"stop", f"\0{PREFIX}some_body/{os.getpid()}")  # has no address
        while None not in senders:
            time.sleep(0.01)
        assert stop_all()[f"some_body/{os.getpid()}"].done


def test_flooding_the_channel_does_not_hold_up_the_listener(monkeypatch):
    listener = StopListener("robot")
    with listener._socket:
        monkeypatch.setattr(listener, "_socket", SimpleNamespace(recvfrom=lambda _: (b"", None)))
        assert set(listener.requests()) == {None}


def test_a_robot_of_any_name_is_found():
    names = "robot\non\tx", "robot on /dev/serial/by-id/" + 80 * "x", "\N{GREEK SMALL LETTER TAU}"
    listeners = [StopListener(name) for name in names]
    assert len(stop_all(0.0)) == len(names)
    for listener in listeners:
        assert listener.requests()
        listener.close()
