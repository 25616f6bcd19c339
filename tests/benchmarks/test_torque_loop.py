# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How late torque commands are at 500 Hz, quiet and with busy processes, and a bare loop."""

import contextlib
import os
import sys
import time
from pathlib import Path

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceLimits, find_driver

sys.path.insert(0, str(Path(__file__).parents[1] / "safety"))
from test_real_time import lateness_of_sleeping, quantiles
from time_to_zero import busy, emulated_motor

pytestmark = pytest.mark.benchmark

RATE = 500
SECONDS = 10.0


def lateness_of_commands(port):
    """Return how late the torque loop sent its commands [s], and what it was not permitted."""
    bus = f"interface=udp_multicast,channel=239.74.163.2,port={port}"
    # Long timeouts for a system that does not permit it priority over others.
    driver = find_driver(f"ak_mit_can:{bus},rate={RATE},silence=0.9,lateness=0.9")
    with driver.make(Side.RIGHT, DeviceLimits(silence=60.0)) as robot:
        robot.configure()
        robot.activate()
        robot.begin(time.time_ns())
        give_up = time.monotonic() + SECONDS
        while time.monotonic() < give_up:
            time.sleep(0.02)
            robot.promise(max(time.time_ns(), robot.promised_until))
            robot.read()
        assert not robot.faults, robot.faults
        return list(robot.timing.late), robot.timing.refused


@pytest.mark.parametrize("count", [0, 8])
def test_commands_at_500_hz(tmp_path, count):
    with emulated_motor("ak_motor_emulator", tmp_path / "trace") as port, busy(count):
        late, refused = lateness_of_commands(port)
        bare = lateness_of_sleeping(RATE, SECONDS)
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
        first = lateness_of_sleeping(RATE, SECONDS)
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    print(f"\nwith {count} busy processes; not permitted: {refused or 'nothing'}")
    for name, lateness in (
        ("torque loop", late),
        ("a bare loop of sleeps", bare),
        ("the same with SCHED_FIFO, if permitted", first),
    ):
        found = quantiles(lateness)
        print(f"{name}: " + ", ".join(f"{key} {value:.2f} ms" for key, value in found.items()))
