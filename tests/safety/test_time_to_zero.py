# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A short form of time_to_zero.py: torque ends, no pulse follows, the cause is reported."""

import math
import random
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from time_to_zero import MOTORS, trial

# A pulse comes every 470 ms: torque that lasts longer than that has not ended.
PERIOD_MS = 470


@pytest.mark.parametrize(
    ("action", "cause"),
    [
        ("entrain stop", "latched: stopped"),
        ("SIGTSTP", "interrupted"),
        ("freeze walker_sim", "walker_sim has been silent"),
        ("kill torque loop", "torque_loop_ended"),
    ],
)
def test_torque_ends_and_no_pulse_follows(tmp_path, action, cause):
    draw = random.Random(action)
    for attempt in "abc":  # a run that ends before the action on a busy computer is repeated
        (tmp_path / attempt).mkdir()
        time, further, output = trial(action, draw.choice(list(MOTORS)), draw, tmp_path / attempt)
        if not math.isnan(time):
            break
    print(f"{action}: {time:.0f} ms, {output}")
    assert further == 0
    assert time < PERIOD_MS
    assert cause in output
