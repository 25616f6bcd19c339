# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The command line: missing packages, signals, output that fails, commands that do not load."""

import os
import signal
import subprocess
import sys

import pytest

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_commands import main
from gait_entrainment_commands.signals import STOPPING

WITHOUT_NUMBA = """
import sys
sys.modules["numba"] = None
from gait_entrainment_commands.__main__ import main
sys.exit(main(["simulate"]))
"""


def test_a_missing_package_is_reported_in_one_line():
    done = subprocess.run([sys.executable, "-c", WITHOUT_NUMBA], capture_output=True, text=True)
    assert done.returncode == 1
    assert "package numba is missing" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(("command", "handled"), [("driver", True), ("simulate", False)])
def test_robot_commands_handle_signals_before_they_are_loaded(monkeypatch, command, handled):
    before = {number: signal.signal(number, signal.SIG_IGN) for number in STOPPING}
    seen = {}
    make_parser = "gait_entrainment_commands.make_parser"
    monkeypatch.setattr(
        make_parser, lambda _: seen.update({n: signal.getsignal(n) for n in STOPPING})
    )
    try:
        with pytest.raises(AttributeError):  # there is no parser
            main([command])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert set(seen.values()) == {signal.default_int_handler if handled else signal.SIG_IGN}


@pytest.mark.parametrize(
    ("stream", "arguments", "code"),
    [
        ("stdout", ["--help"], 1),
        ("stdout", ["simulate", "--help"], 1),
        ("stderr", ["simulate", "--baseline=-3"], 2),
    ],
)
def test_the_exit_code_is_right_if_nothing_can_be_written(monkeypatch, stream, arguments, code):
    with open("/dev/full", "w", buffering=1) as full:
        monkeypatch.setattr(sys, stream, full)
        assert main(arguments) == code
        os.dup2(os.open(os.devnull, os.O_WRONLY), full.fileno())


def test_an_error_is_one_line_followed_by_the_end_of_a_log(monkeypatch, capsys):
    def fail(_):
        raise EntrainmentError("no file a\nb\n  walker_sim| started\n  walker_sim| failed")

    monkeypatch.setattr("gait_entrainment_commands.make_parser", fail)
    assert main(["run_it"]) == 1
    expected = "entrain run_it: no file a\\nb\n  walker_sim| started\n  walker_sim| failed\n"
    assert capsys.readouterr().err == expected


def test_figures_ignore_a_backend_with_windows(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "module://of.a.notebook")
    assert main(["simulate", "--baseline=-3"]) == 2
    assert "MPLBACKEND" not in os.environ


def test_a_broken_external_command_does_not_break_the_others(monkeypatch, tmp_path, capsys):
    (tmp_path / "of_somebody.py").write_text("1 / 0")
    monkeypatch.syspath_prepend(tmp_path)
    about = tmp_path / "of_somebody-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: of_somebody\nVersion: 1\n")
    (about / "entry_points.txt").write_text("[gait_entrainment.commands]\nodd = of_somebody\n")
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    out, err = capsys.readouterr()
    assert "simulate" in out
    assert "analyze" in out
    assert err == (
        "entrain: the commands of of_somebody cannot be loaded: "
        "ZeroDivisionError('division by zero')\n"
    )
