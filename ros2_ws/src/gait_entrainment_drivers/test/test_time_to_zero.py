# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
How long torque lasts after each way to end it: the figures in docs/safety.md.

    pytest -s -m benchmark ros2_ws/src/gait_entrainment_drivers/test

The motor is emulated in another process (30 Hz torque bandwidth, AK80-9, multicast bus), the host
loop runs at 500 Hz. Torque counts as gone once the motor's own trace is below 5 % of the pulse.
"""

import statistics
import time

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceLimits, PulseTrain, find_driver

from .emulator_process import emulator, read_trace, until
from .test_ak_mit_can import host_that

HEIGHT = 8.0
TRIALS = 10
SILENCE = 0.1


def pushing_robot(driver, limits=None):
    robot = find_driver(driver.replace("rate=250", "rate=500")).make(Side.RIGHT, limits)
    robot.configure()
    robot.activate()
    robot.arm()
    robot.begin(time.time_ns())
    onset = time.time_ns() + 50_000_000
    robot.schedule(PulseTrain.periodic(Side.RIGHT, onset, 2.0, 1, HEIGHT, 0.5))
    return robot


def under_torque(trace):
    return bool(read_trace(trace)) and read_trace(trace)[-1][2] > 0.95 * HEIGHT


def gone_after(trace, since):
    """Return the times [ms] from ``since`` to the end of the command and to that of the torque."""
    until(lambda: abs(read_trace(trace)[-1][2]) < 0.05 * HEIGHT)
    rows = [row for row in read_trace(trace) if row[0] >= since]
    command = next(t for t, command, _ in rows if abs(command) < 0.05 * HEIGHT)
    torque = next(t for t, _, torque in rows if abs(torque) < 0.05 * HEIGHT)
    return (command - since) / 1e6, (torque - since) / 1e6


def by_call(name):
    def end(trace, driver):
        with pushing_robot(driver) as robot:
            until(lambda: under_torque(trace))
            since = time.time_ns()
            getattr(robot, name)()
            return gone_after(trace, since)

    return end


def by_silent_experiment(trace, driver):
    with pushing_robot(driver, DeviceLimits(silence=SILENCE)) as robot:
        while not under_torque(trace):
            robot.heard()
            time.sleep(0.001)
        robot.heard()
        return gone_after(trace, time.time_ns())


def by_silent_motor(trace, driver):
    with pushing_robot(driver):
        until(lambda: under_torque(trace))
        # It stops answering 0.1 s after the first torque.
        began = next(t for t, command, _ in read_trace(trace) if command > 0.1)
        return gone_after(trace, began + 100_000_000)


def by_exception(trace, driver):
    with pytest.raises(ZeroDivisionError), pushing_robot(driver):  # noqa: PT012
        until(lambda: under_torque(trace))
        since = time.time_ns()
        raise ZeroDivisionError
    return gone_after(trace, since)


def by_kill(trace, driver):
    host = host_that("", driver)
    until(lambda: trace.exists() and under_torque(trace))
    since = time.time_ns()
    host.kill()
    host.wait(10)
    return gone_after(trace, since)


@pytest.mark.benchmark
def test_time_to_zero(tmp_path):
    cases = {
        "stop": (by_call("stop"), ()),
        "cancel": (by_call("cancel"), ()),
        "deactivate": (by_call("deactivate"), ()),
        "close": (by_call("close"), ()),
        "exception in the host": (by_exception, ()),
        "experiment silent (limit 0.1 s)": (by_silent_experiment, ()),
        "motor silent (limit 0.05 s)": (by_silent_motor, ("--silent-after", "0.1")),
        "kill -9, motor's own timeout 0.05 s": (by_kill, ("--timeout", "0.05")),
    }
    print(f"\n{'from':<38}{'command gone [ms]':>20}{'torque gone [ms]':>20}   (median, worst)")
    for name, (end, options) in cases.items():
        times = []
        for trial in range(TRIALS):
            trace = tmp_path / f"{name}-{trial}".replace(" ", "_").replace("/", "_")
            with emulator(*options, trace=trace) as driver:
                if "motor silent" in name:
                    driver = driver.replace("silence=0.3", "silence=0.05")
                times.append(end(trace, driver))
        columns = "".join(
            f"{statistics.median(t[i] for t in times):>11.1f}{max(t[i] for t in times):>9.1f}"
            for i in (0, 1)
        )
        print(f"{name:<38}{columns}")
