# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The motor emulator in its own process, on its own bus."""

import contextlib
import socket
import subprocess
import sys
import time

CHANNEL = "239.74.163.2"


@contextlib.contextmanager
def emulator(*arguments, trace=None, program="ak_motor_emulator", driver="ak_mit_can"):
    """Run an emulator; yield the text that selects the driver for it."""
    # A separate port keeps tests that run at the same time apart.
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
        # Generous limits for a shared machine; each limit has its own test.
        generous = "rate=250,silence=0.3,lateness=0.5,host_silence=3"
        yield f"{driver}:interface=udp_multicast,channel={CHANNEL},port={port},{generous}"
    finally:
        process.terminate()
        process.wait(10)
        process.stdout.close()


def read_trace(path):
    """Return time [ns], command and torque [N m] of each complete line."""
    lines = path.read_text().splitlines(keepends=True)
    rows = [line.split() for line in lines if line.endswith("\n")]
    return [(int(time_ns), float(command), float(torque)) for time_ns, command, torque in rows]


def until(condition, timeout=10.0):
    """Wait until a condition holds, at most for a timeout [s]."""
    give_up = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < give_up, "it did not happen in time"
        time.sleep(0.005)
