# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How long commands take to start and end, next to a Python and a ROS node that do nothing."""

import statistics
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.benchmark

ROUNDS = 7
EMPTY_NODE = """
import rclpy
rclpy.init()
rclpy.create_node("empty").destroy_node()
rclpy.shutdown()
"""
COMMANDS = {
    "baseline, an empty Python": (sys.executable, "-c", ""),
    "baseline, an empty node of rclpy": (sys.executable, "-c", EMPTY_NODE),
    "entrain --help": ("entrain", "--help"),
    "entrain simulate, default protocol": ("entrain", "simulate"),
    "entrain run, one pulse": (
        *("entrain", "run", "--no-figures"),
        *("--baseline=2", "--pulses=1", "--washout=1"),
    ),
    "entrain run, default protocol, figures": ("entrain", "run"),
}


def seconds(command, folder):
    if command[:2] == ("entrain", "run"):
        command = (*command, "--out", str(folder))
    begin = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def test_startup(tmp_path):
    # In turns, so that all see the same load; the first round loads what is not yet in memory.
    times = {name: [] for name in COMMANDS}
    for number in range(1 + ROUNDS):
        for name, command in COMMANDS.items():
            times[name].append(seconds(command, tmp_path / f"{name} {number}"))
    print(f"\nmedian of {ROUNDS}, least and greatest [s]")
    for name, (_, *measured) in times.items():
        median, least, most = statistics.median(measured), min(measured), max(measured)
        print(f"{name:40} {median:6.3f}  {least:.3f} to {most:.3f}")
