# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How long a session of six blocks, the report of an hour's session and a plan take."""

import re
import subprocess
import time
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples/sessions/basin_of_entrainment.yaml"
# For walkers whose strides vary as a person's do.
TEXT = EXAMPLE.read_text().replace("protocol:\n", "protocol:\n  variation: {coefficient: 0.02}\n")

pytestmark = pytest.mark.benchmark


def seconds(*words):
    begin = time.perf_counter()
    subprocess.run(["entrain", *map(str, words)], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def test_a_session_of_six_blocks_with_its_report(tmp_path):
    path = tmp_path / "session.yaml"
    path.write_text(TEXT)
    walked = seconds("session", path, "--out", tmp_path / "study")
    extra = seconds("report", tmp_path / "study")
    print(f"\nsix blocks, recorded: {walked:.1f} s, with report {walked + extra:.1f} s (below 60)")


def test_the_report_of_an_hour(tmp_path):
    path = tmp_path / "session.yaml"
    # Six times 320 strides of 1.84 s.
    path.write_text(re.sub(r", session_pulses: \d+", "", TEXT.replace("count: 50", "count: 290")))
    seconds("session", path, "--out", tmp_path / "study")
    print(f"\nreport of an hour: {seconds('report', tmp_path / 'study'):.1f} s (below 10)")


def test_a_plan():
    print(f"\nplan: {seconds('plan'):.1f} s (below 5)")
