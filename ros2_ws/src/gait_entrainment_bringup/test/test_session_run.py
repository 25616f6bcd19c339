# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The course of a session, without nodes: answers of the operator, rests, doses, failures."""

import argparse
import itertools
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from gait_entrainment_bringup import session_run
from gait_entrainment_bringup.commands.run import kept
from gait_entrainment_bringup.session_run import BlockFailedError, SessionRun
from gait_entrainment_drivers.proof import keep_preflight
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.session_file import SessionError, read_session

TEXT = """\
protocol: {driver: DRIVER}
person: {code: P01, mass: 72, leg_length: 0.91}
LIMITS
blocks:
  - {name: one}
  - {name: two, rest: 0.05, protocol: {pulses: {count: 60}}}
"""


@pytest.fixture
def conduct(tmp_path, monkeypatch):
    """Return a function that conducts the remaining blocks; ``ends`` are their errors, if any."""
    conducted = []

    def conducting(answers=(), ends=(), limits="", driver="ideal", **options):
        path = tmp_path / "session.yaml"
        path.write_text(TEXT.replace("LIMITS", limits).replace("DRIVER", driver))
        session = read_session(path)
        folder = SessionFolder.begin(tmp_path / "study", session)
        defaults = {"note": "", "repeat": None, "reason": "", "real_time": False, "no_rest": False}
        defaults["page"] = False
        ended = itertools.chain(ends, itertools.repeat(""))

        def in_a_process(_self, protocol, bag, about):
            conducted.append((protocol, bag.name, about["block_name"]))
            return next(ended)

        monkeypatch.setattr(SessionRun, "_in_a_process", in_a_process)
        ask = None
        if answers:
            replies = iter(answers)
            ask = lambda question: next(replies)  # noqa: E731, ARG005
        run = SessionRun(session, folder, argparse.Namespace(**{**defaults, **options}), 0, ask)
        run.conduct()
        return folder

    conducting.conducted = conducted
    return conducting


def ledger(folder):
    return [(entry.what, entry.block, entry.text) for entry in folder.ledger]


def test_blocks_follow_one_another_without_an_operator(conduct):
    folder = conduct()
    assert [bag for _, bag, _ in conduct.conducted] == ["block-01", "block-02"]
    assert [what for what, _, _ in ledger(folder)] == ["begun", "done", "begun", "done"]
    conduct()  # nothing is left
    assert len(conduct.conducted) == 2


def test_the_operator_notes_pauses_and_repeats_with_a_reason(conduct, capsys):
    answers = ["p", "n shoes untied", "", "r walked on the wrong belt", "", "p tired"]
    folder = conduct(answers)
    assert "p REASON pauses" in capsys.readouterr().out  # a pause without a reason
    assert ledger(folder) == [
        ("note", "1", "shoes untied"),
        ("begun", "1", ""),
        ("done", "1", ""),
        ("repeat", "1", "walked on the wrong belt"),
        ("begun", "1", ""),
        ("done", "1", ""),
        ("pause", "2", "tired"),
    ]
    conduct([""])
    assert [bag for _, bag, _ in conduct.conducted] == ["block-01", "block-01_run-2", "block-02"]


def test_a_paused_session_waits_and_repeats_the_block_before_it_goes_on(
    conduct, tmp_path, monkeypatch
):
    def desk(folder=tmp_path / "study/sub-P01/ses-1"):
        return SessionFolder(folder)

    def first_block():
        desk().note("pause", 2, text="belt stopped")
        yield ""
        yield from itertools.repeat("")

    def meanwhile(_seconds):
        assert len(conduct.conducted) == 1
        desk().repeat("belt stopped")
        desk().note("go on", 1)

    # Only the module's clock: other threads of the test's process also sleep.
    monkeypatch.setattr(session_run, "time", SimpleNamespace(sleep=meanwhile))
    folder = conduct(ends=first_block())
    assert [bag for _, bag, _ in conduct.conducted] == ["block-01", "block-01_run-2", "block-02"]
    assert [what for what, _, _ in ledger(folder)][:5] == [
        "begun", "pause", "done", "repeat", "go on",
    ]  # fmt: skip
    folder.note("pause", text="and then the computer crashed")
    conduct(repeat=2, reason="why")
    assert [what for what, _, _ in ledger(folder)][-4:] == ["repeat", "go on", "begun", "done"]


def test_the_end_of_the_input_is_a_pause(conduct, monkeypatch):
    def ended(_question):
        raise EOFError

    monkeypatch.setattr(session_run.sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", ended)
    assert ledger(conduct()) == [("pause", "1", "the input ended")]


def test_a_block_that_fails_ends_the_session_and_is_the_next_one(conduct):
    message = r"block 2: it fell; the same command resumes at this block\n  walker_sim\| more"
    with pytest.raises(BlockFailedError, match=message):
        conduct(ends=["", "it fell\n  walker_sim| more"])
    folder = conduct()
    assert ledger(folder)[3:5] == [("failed", "2", "it fell walker_sim| more"), ("begun", "2", "")]
    assert sorted(folder.runs()) == [1, 2]


def test_nothing_is_kept_of_a_run_that_could_not_be_recorded(tmp_path):
    assert kept(tmp_path / "removed, as the disk is full") == ""


def test_a_repetition_needs_a_block_that_is_done(conduct):
    with pytest.raises(SessionError, match="block 2 is not done; allowed: none yet"):
        conduct(repeat=2, reason="why")
    conduct()
    assert ledger(conduct(repeat=2, reason="why", note="again"))[4:6] == [
        ("note", "", "again"),
        ("repeat", "2", "why"),
    ]


def test_rests_are_counted_down_only_for_a_person(conduct, capsys, monkeypatch):
    slept = []
    clock = SimpleNamespace(monotonic=lambda: sum(slept), sleep=slept.append)
    monkeypatch.setattr(session_run, "time", clock)
    conduct(real_time=True)
    assert sum(slept) == pytest.approx(0.05)
    assert "rest: 1 s" in capsys.readouterr().err
    conduct(repeat=2, reason="why")
    assert sum(slept) == pytest.approx(0.05)


def test_limits_of_a_session_apply_across_its_blocks(conduct):
    limits = "limits: {session_pulses: 120}"
    folder = conduct(limits=limits)
    assert [p.limits.session_pulses for p, _, _ in conduct.conducted] == [120, 120]
    # What a crash left of a record may have been a complete block.
    for name in ("block-01", "block-02"):
        (folder.path / "bags" / name / "broken.mcap").write_bytes(b"no bag")
    with pytest.raises(SessionError, match=r"50 in all; allowed: at most 10, since 110 pulses"):
        conduct(limits=limits, repeat=1, reason="why")


def test_the_delivered_dose_is_that_of_the_record(conduct):
    limits = "limits: {session_impulse: 200}"
    folder = conduct(limits=limits)
    for file in (Path(__file__).parents[4] / "bags/paper_example").glob("*.mcap"):
        shutil.copy(file, folder.path / "bags/block-01")
    conduct(limits=limits, repeat=2, reason="why")
    # 50 square pulses of 13.35 N m and 0.1 s.
    assert conduct.conducted[-1][0].limits.session_impulse == pytest.approx(200 - 66.73, abs=0.01)


def test_the_preflight_of_a_real_robot_is_noted_before_each_block(conduct, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    real = {"limits": "limits: {torque: 15}", "driver": "odrive_can"}
    folder = conduct(**real)
    assert ledger(folder)[0] == ("preflight", "1", "none")
    keep_preflight("odrive_can", "")
    assert ledger(conduct(**real, repeat=1, reason="why"))[-3][2].endswith(": passed")
