# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Every command: help, one line when it refuses arguments, and the exit codes of the README."""

import argparse
import subprocess
from pathlib import Path

import pytest

from gait_entrainment_commands import main, make_parser

ROOT = Path(__file__).parents[1]
BAG = ROOT / "bags" / "paper_example"
SHORT = ["--baseline=2", "--pulses=2", "--washout=0"]


def subparsers(parser):
    """Return the parsers of a parser's actions, by name."""
    groups = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return groups[0].choices if groups else {}


def all_commands():
    """Return every command, with each of its actions if it has any."""
    found = []
    for command in subparsers(make_parser()):
        actions = subparsers(subparsers(make_parser(command))[command])
        found += [[command, action] for action in actions] or [[command]]
    return found


def needed(words):
    """Return placeholders for the arguments that a command requires."""
    parser = make_parser(words[0])
    for word in words:
        parser = subparsers(parser)[word]
    positional = [a for a in parser._actions if not a.option_strings]
    return [next(iter(a.choices or ["x"])) for a in positional]


def run(capsys, *words):
    """Run a command; return its exit code, its output and its errors."""
    try:
        code = main([*map(str, words)])
    except SystemExit as end:  # argparse's
        code = end.code
    return code, *capsys.readouterr()


@pytest.mark.parametrize("words", all_commands(), ids=" ".join)
def test_each_command_has_help_and_refuses_an_unknown_option_in_one_line(words, capsys):
    code, out, err = run(capsys, *words, "--help")
    assert (code, err) == (0, "")
    usage = f"usage: entrain {' '.join(words)} "
    assert out.startswith(usage)
    code, out, err = run(capsys, *words, *needed(words), "--nonsense")
    assert (code, out) == (2, "")
    name = f"entrain {' '.join(words)}"
    assert err == f"{name}: unrecognized arguments: --nonsense; see {name} --help\n"


@pytest.mark.parametrize("words", [[], ["nonsense"], ["--nonsense"], ["non\nsense"]])
def test_an_unknown_command_gives_one_line_that_refers_to_the_help(words, capsys):
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert err.startswith("entrain: ")
    assert err.endswith("; see entrain --help\n")
    assert err.count("\n") == 1


# 0: done, 1: failed, 2: wrong usage.
EXIT_CODES = [
    (0, ["simulate", *SHORT]),
    (0, ["analyze", BAG]),
    (0, ["bag", "info", BAG]),
    (0, ["bag", "check", BAG]),
    (0, ["driver", "list"]),
    (0, ["plan", "--trials=20", "--pulses", "10"]),
    (1, ["simulate", "--torque=31"]),
    (1, ["simulate", "--torque=-29", "--width=0.4"]),  # the walker falls
    (1, ["simulate", "--driver=magic"]),
    (1, ["analyze", "README.md"]),
    (1, ["bag", "info", "README.md"]),
    (1, ["bag", "check", "README.md"]),
    (1, ["driver", "check", "magic"]),
    (1, ["report", "docs"]),
    (1, ["analyze", BAG, "--figures=README.md/x"]),
    (2, ["simulate", "--width=-1"]),
    (2, ["simulate", "nowhere.yaml"]),
    (2, ["analyze", "nowhere"]),
    (2, ["analyze", BAG, "--protocol=nowhere.yaml"]),
    (2, ["analyze", BAG, "--side=middle"]),
    (2, ["bag", "check", "nowhere"]),
    (2, ["bag", "export", BAG, "docs"]),
    (2, ["run", f"--out={BAG}"]),
    (2, ["replay", "nowhere"]),
    (2, ["replay", BAG, "--rate=-1"]),
    (2, ["node", "walker_sim", "--lead-time=20"]),
    (2, ["plan", "--period-offset=-0.2"]),
    (2, ["session", "nowhere.yaml"]),
    (2, ["session", "unblind", "docs"]),
    (2, ["session", "export", BAG]),
    (1, ["page", "--bag=docs"]),
    (2, ["page", "--session"]),
    (2, ["page", "--session", "nowhere.yaml"]),
    (2, ["page", "--foxglove=8765", "--blinded"]),
    (2, ["page", "--host=192.0.2.1"]),
    (2, ["page", "--token=short"]),
    (2, ["preflight", "--session", "examples/sessions/blinded_sham.yaml"]),
    (2, ["report", BAG, "--out=nowhere/page.html"]),
    (2, ["cohort", "nowhere.yaml"]),
]


@pytest.mark.parametrize(
    ("code", "words"), EXIT_CODES, ids=[f"{c} {' '.join(map(str, w))}" for c, w in EXIT_CODES]
)
def test_exit_codes(code, words, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    found, _, err = run(capsys, *words)
    assert found == code
    if code != 0 and words[:2] != ["bag", "check"]:  # whose findings are its output
        prog = "entrain " + " ".join(str(word) for word in words[:2] if str(word).isalpha())
        assert err.splitlines()[-1].startswith((f"{prog}: ", f"entrain {words[0]}: ")), err
        assert "Traceback" not in err
        assert "[Errno" not in err


@pytest.mark.parametrize(("out", "code", "error"), [("full", 1, "No space left"), ("head", 0, "")])
def test_output_that_cannot_be_written_ends_with_the_right_exit_code(out, code, error):
    command = "entrain bag info bags/paper_example --json"
    script = {
        "full": f"{command} > /dev/full",
        "head": f"{command} | true; exit $((${{PIPESTATUS[0]}} > 1))",
    }
    done = subprocess.run(
        ["bash", "-c", script[out]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == code
    assert error in done.stderr
    assert len(done.stderr.splitlines()) == bool(error)
