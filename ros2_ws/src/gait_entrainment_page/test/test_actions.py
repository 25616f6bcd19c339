# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the page starts, with which words, and what of its output a blinded operator is told."""

import pytest

from gait_entrainment_page.actions import ActionError, Command


@pytest.fixture
def told(tmp_path, monkeypatch):
    """Return a function that starts a command and returns what is told of it at its end."""
    program = tmp_path / "entrain"
    program.write_text('#!/bin/sh\necho "$@"\n[ "$2" != fails ]\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")

    def tell(words, *, preflight=False, outcome=True, **options):
        command = Command(words, **options)
        assert command.start(preflight=preflight) == f"entrain {command.name} has started"
        command._process.wait(10)
        return command.told(outcome=outcome)

    return tell


@pytest.mark.parametrize(
    ("kind", "checklist"), [("run", "preflight"), ("session", "preflight --session")]
)
def test_a_run_or_session_is_started_or_its_checklist(told, kind, checklist):
    words = (kind, "file.yaml", "--real-time")
    assert told(words, preflight=True, heartbeat=True) == [
        f"{checklist} file.yaml --real-time",
        "entrain preflight has ended with exit code 0",
    ]
    assert told(words, heartbeat=True)[0] == f"{kind} file.yaml --real-time --heartbeat"


def test_a_blinded_operator_is_told_of_a_run_only_that_it_ended_or_why_it_failed(told):
    assert told(("run", "well"), outcome=False) == ["entrain run has ended with exit code 0"]
    assert told(("run", "fails"), outcome=False) == [
        "run fails", "entrain run has ended with exit code 1",
    ]  # fmt: skip
    assert told(("session", "well"), outcome=False)[0] == "session well"  # neutral by itself


def test_one_goes_on_at_a_time(tmp_path, monkeypatch):
    (tmp_path / "entrain").write_text("#!/bin/sh\nexec sleep 60\n")
    (tmp_path / "entrain").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    command = Command(["run"])
    command.start()
    try:
        with pytest.raises(ActionError, match="entrain run goes on: wait for its end"):
            command.start(preflight=True)
    finally:
        command._process.kill()
        command._process.wait()
