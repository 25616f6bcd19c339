# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How punctual real time is: joint states at 1 kHz for a minute, next to a bare loop of sleeps."""

import json
import subprocess
import time
from concurrent.futures import ProcessPoolExecutor

import pytest

from gait_entrainment_bags import BagReader
from gait_entrainment_nodes.messaging.environment import come_before_others

pytestmark = pytest.mark.benchmark

RATE = 1000
SECONDS = 60


def lateness_of_sleeping(rate, seconds):
    """Return how late [s] a loop wakes that only sleeps until each deadline."""
    begin, late = time.monotonic(), []
    for k in range(1, int(rate * seconds)):
        due = begin + k / rate
        time.sleep(max(due - time.monotonic(), 0))
        late.append(time.monotonic() - due)
    return late


def lateness_with_priority(seconds):
    """Return the same for a loop with the priority of a node."""
    come_before_others()
    return lateness_of_sleeping(RATE, seconds)


def quantiles(late):
    """Return the median, the 99 % quantile and the worst of some latenesses [s], in ms."""
    late = sorted(late)
    return {
        "p50": 1e3 * late[len(late) // 2],
        "p99": 1e3 * late[len(late) * 99 // 100],
        "worst": 1e3 * late[-1],
    }


def test_joint_states_at_1_khz_for_a_minute(tmp_path):
    strides = round(SECONDS / 1.92)
    # Only a loop at the same time has to share the processors as the run does.
    with ProcessPoolExecutor(1) as process:
        during = process.submit(lateness_with_priority, SECONDS)
        done = subprocess.run(
            [
                *("entrain", "run", "--real-time", "--json", "--no-figures"),
                *("--out", str(tmp_path / "bag"), f"--sample-rate={RATE}"),
                *("--baseline=5", f"--pulses={strides - 6}", "--washout=1"),
            ],
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        after = process.submit(lateness_with_priority, 10).result()
    outcome = json.loads(done.stdout)
    with BagReader(tmp_path / "bag") as reader:
        recorded = reader.counts["/joint_states"]
        stamps = [m.log_time for m in reader.messages(["/joint_states"])]
    due = [stamps[0] + k * 10**9 // RATE for k in range(len(stamps))]
    print(
        f"\nreal time, {len(stamps) / RATE:.0f} s at {RATE} Hz: {recorded} joint states recorded,"
        f" {'each' if stamps == due else 'NOT each'} with its exact stamp,"
        f" {outcome['lost']} of {outcome['messages']} messages lost"
    )
    for name, late in (
        ("stamp to publish", outcome["publish_lateness_ms"]),
        ("a loop of sleeps during the run", quantiles(during.result())),
        ("a loop of sleeps after it", quantiles(after)),
    ):
        print(
            f"{name}: p50 {late['p50']:.2f} ms, p99 {late['p99']:.2f} ms,"
            f" worst {late['worst']:.2f} ms"
        )
    assert outcome["lost"] == 0
    assert stamps == due
