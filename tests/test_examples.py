# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The programs in docs/examples run and print what they should."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def lines_of(name, *arguments):
    command = [sys.executable, ROOT / "docs/examples" / name, *arguments]
    return subprocess.check_output(command, text=True).splitlines()


def test_a_protocol_is_simulated():
    lines = lines_of("simulate_a_protocol.py")
    assert lines[:2] == ["stride period 1.9332 s", "pulse period  1.8632 s"]
    assert lines[-1] == "verdict: entrained"


def test_a_driver_keeps_every_promise():
    lines = lines_of("ankle_robot_driver.py")
    assert len(lines) > 10
    assert {line.split()[-1] for line in lines} == {"kept"}


def test_the_strides_of_a_bag_are_listed():
    lines = lines_of("strides_of_a_bag.py", ROOT / "bags/paper_example")
    assert lines[-1] == "stride  80 ends at 152.834 s, period 1.9332 s"
