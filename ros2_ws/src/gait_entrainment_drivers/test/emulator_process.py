# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The motor emulator as a process of its own, on a bus of its own."""

import contextlib
import socket
import subprocess
import sys
import time

CHANNEL = "239.74.163.2"


@contextlib.contextmanager
def emulator(*arguments, trace=None, program="ak_motor_emulator", driver="ak_mit_can"):
    """Run an emulator; yields the text that names the driver for it."""
    # A port of its own keeps a test apart from others that run at the same time.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", f"gait_entrainment_drivers.{program}"]
    command += ["--channel", CHANNEL, "--port", str(port), *arguments]
    if trace is not None:
        command += ["--trace", str(trace)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert "ready" in process.stdout.readline()
        # Patience for a machine that others share; the limits themselves are tested one by one.
        generous = "rate=250,silence=0.3,lateness=0.5,host_silence=3"
        yield f"{driver}:interface=udp_multicast,channel={CHANNEL},port={port},{generous}"
    finally:
        process.terminate()
        process.wait(10)
        process.stdout.close()


def read_trace(path):
    """Time [ns], command and torque [N m] of each complete line."""
    lines = path.read_text().splitlines(keepends=True)
    rows = [line.split() for line in lines if line.endswith("\n")]
    return [(int(time_ns), float(command), float(torque)) for time_ns, command, torque in rows]


def until(condition, timeout=10.0):
    """Wait for a condition, with an end."""
    give_up = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < give_up, "it did not happen in time"
        time.sleep(0.005)
