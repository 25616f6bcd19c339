# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Detectors in real time: what is lost, and how soon an event is published once it is decided."""

import json
import subprocess

import pytest

from gait_entrainment_bags import BagReader
from gait_entrainment_sensors.detection import detector_names

pytestmark = pytest.mark.benchmark

STRIDES = 15
TOPICS = ("/ground_reaction/", "/foot_switch/", "/imu/", "/ankle_encoder/")


@pytest.mark.parametrize("detector", detector_names())
def test_events_come_soon_after_the_sample_that_decides(detector, tmp_path):
    done = subprocess.run(
        [
            *("entrain", "run", "--real-time", "--json", "--no-figures", "--walker=sensed"),
            *(f"--detector={detector}", "--out", str(tmp_path / "bag")),
            *("--baseline=5", f"--pulses={STRIDES - 6}", "--washout=1"),
            "--sample-rate=500",  # what sensors measured is sent every 2 ms
        ],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    outcome = json.loads(done.stdout)
    with BagReader(tmp_path / "bag") as reader:
        delays = sorted(
            raw.publish_time / 1e6 - (at.sec * 1e3 + at.nanosec / 1e6)
            for raw, message in reader.decoded(["/gait_events"])
            for at in (message.detected_at,)
        )
        samples = max(n for name, n in reader.counts.items() if name.startswith(TOPICS))
    errors = outcome["detector_errors"]
    print(
        f"\n{detector}: {samples} samples a foot, {outcome['lost']} messages lost; received "
        f"{delays[len(delays) // 2]:.2f} ms (median), {delays[len(delays) * 99 // 100]:.2f} ms "
        f"(99 %) after the sample that decided; strikes missed {errors['heel_strike']['missed']}, "
        f"false {errors['heel_strike']['false']}"
    )
    assert outcome["lost"] == 0
