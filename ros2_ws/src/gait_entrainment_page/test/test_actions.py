# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Actions of the page: the stop, the commands it starts, and which output is shown to whom."""

import asyncio
import contextlib
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from gait_entrainment_drivers.stop_channel import NO_ANSWER, StopAnswer
from gait_entrainment_page.actions import ActionError, Command, stop, stop_at_once

CUT = "not every robot confirmed the stop: cut the power"


@pytest.fixture
def output(tmp_path, monkeypatch):
    """Return a function that starts a command and returns its messages at its end."""
    program = tmp_path / "entrain"
    program.write_text('#!/bin/sh\necho "$@"\n[ "$2" != fails ]\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")

    def start(words, *, preflight=False, outcome=True, **options):
        command = Command(words, **options)
        assert command.start(preflight=preflight) == f"entrain {command.name} has started"
        command._process.wait(10)
        return command.messages(outcome=outcome)

    return start


@pytest.mark.parametrize(
    ("kind", "checklist"), [("run", "preflight"), ("session", "preflight --session")]
)
def test_a_run_a_session_or_its_checklist_is_started(output, kind, checklist):
    words = (kind, "file.yaml", "--real-time")
    assert output(words, preflight=True, heartbeat=True) == [
        f"{checklist} file.yaml --real-time",
        "entrain preflight has ended with exit code 0",
    ]
    assert output(words, heartbeat=True)[0] == f"{kind} file.yaml --real-time --heartbeat"


def test_a_blinded_operator_learns_only_that_a_run_ended_or_why_it_failed(output):
    assert output(("run", "well"), outcome=False) == ["entrain run has ended with exit code 0"]
    assert output(("run", "fails"), outcome=False) == [
        "run fails", "entrain run has ended with exit code 1",
    ]  # fmt: skip
    assert output(("session", "well"), outcome=False)[0] == "session well"  # neutral by itself


def test_a_blinded_operator_sees_only_what_fails_in_the_checklist():
    command = Command(["run", "file.yaml"])
    command._output.write(b"ok    limits     40 pulses of 10 N m\nFAIL  stop       not pressed\n")
    command._output.flush()
    command.name = "preflight"
    with subprocess.Popen(["true"]) as command._process:
        pass
    assert [line[:10] for line in command.messages(outcome=False)] == ["FAIL  stop", "entrain pr"]
    assert "10 N m" in command.messages()[0]


def test_one_command_runs_at_a_time(tmp_path, monkeypatch):
    (tmp_path / "entrain").write_text("#!/bin/sh\nexec sleep 60\n")
    (tmp_path / "entrain").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    command = Command(["run"])
    command.start()
    try:
        with pytest.raises(ActionError, match="entrain run is running: wait for its end"):
            command.start(preflight=True)
    finally:
        command._process.kill()
        command._process.wait()


def test_a_double_click_starts_one_command(monkeypatch):
    both, started = threading.Barrier(2), []

    def begin(words, **_):
        with contextlib.suppress(threading.BrokenBarrierError):
            both.wait(0.2)  # for a second start, which never comes
        started.append(words)
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(subprocess, "Popen", begin)
    monkeypatch.setattr(Command, "runs", property(lambda self: self._process is not None))
    command = Command(["run"])
    with ThreadPoolExecutor(2) as clicks:
        errors = [click.exception() for click in [clicks.submit(command.start) for _ in "12"]]
    assert len(started) == 1
    assert sum(isinstance(error, ActionError) for error in errors) == 1


@pytest.mark.parametrize(
    ("here", "elsewhere", "messages"),
    [
        ({}, "zero", ["asked over ROS: zero"]),
        ({}, "", ["asked over ROS: no answer", CUT]),
        ({"motor/1": StopAnswer(done=True, message="zero")}, "zero", ["motor/1: zero"]),
        ({"motor/1": NO_ANSWER}, "zero", ["motor/1: does not answer", CUT]),
    ],
)
def test_a_stop_reaches_the_displayed_robot_wherever_it_is(here, elsewhere, messages, monkeypatch):
    asked = threading.Event()

    def ask(what):
        assert what == "stop"
        asked.set()
        if not elsewhere:
            raise ActionError("no answer")
        return elsewhere

    monkeypatch.setattr("gait_entrainment_page.actions.stop_all", lambda: here)
    assert stop(SimpleNamespace(ask=ask, offered=lambda: {"stop"})) == messages
    assert asked.wait(10)


def test_a_stop_waits_for_no_other_action(monkeypatch):
    monkeypatch.setattr("gait_entrainment_page.actions.stop_all", dict)
    answers = threading.Event()

    async def while_others_wait():
        asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(1))
        waits = asyncio.create_task(asyncio.to_thread(answers.wait))
        try:
            return await asyncio.wait_for(stop_at_once(None), 10)
        finally:
            answers.set()
            await waits

    assert asyncio.run(while_others_wait()) == ["no robot is driven by this machine"]
