# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The short form of time_to_zero.py: torque ends, no pulse follows, the cause is named."""

import math
import random
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from time_to_zero import MOTORS, trial

# Pulses follow each other by 470 ms: torque that lasts longer than this [ms] goes on.
GOES_ON = 470


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ("entrain stop", "latched: stopped"),
        ("SIGTSTP", "interrupted"),
        ("freeze walker_sim", "walker_sim has been silent"),
        ("kill torque loop", "torque_loop_ended"),
    ],
)
def test_torque_ends_and_no_pulse_follows(tmp_path, action, said):
    draw = random.Random(action)
    for attempt in "abc":  # a run that a busy computer ended before counts for nothing
        (tmp_path / attempt).mkdir()
        time, further, told = trial(action, draw.choice(list(MOTORS)), draw, tmp_path / attempt)
        if not math.isnan(time):
            break
    print(f"{action}: {time:.0f} ms, {told}")
    assert further == 0
    assert time < GOES_ON
    assert said in told
