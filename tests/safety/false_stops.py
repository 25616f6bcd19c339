# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Check whether anything ends the torque without a cause, for docs/safety.md.

    python tests/safety/false_stops.py --minutes 30 --busy 8

Starts one `entrain run --real-time` on an emulated motor, next to busy processes. Prints how long
it ran and how many pulses the motor gave; if it ended early, prints its output and exits with 1.
Meanwhile a bare loop of sleeps, by SCHED_FIFO above everything in the run if the system permits
it, shows how late any process on this machine woke up.
"""

import argparse
import contextlib
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from time_to_zero import HEIGHT, MOTORS, WALK, busy, emulated_motor, rows_of

sys.path.insert(0, str(Path(__file__).parents[1] / "system"))
from harness import entrain_run

LATENESS = 0.05  # the torque loop latches at this [s]


def pulses(trace: Path) -> int:
    """Return how many pulses an emulated motor gave."""
    torques = [torque for _, _, torque in rows_of(trace)]
    return sum(before < 0.5 * HEIGHT <= after for before, after in pairwise(torques))


@contextlib.contextmanager
def bare_loop() -> Iterator[None]:
    """Run a loop that sleeps until each millisecond; print its worst lateness at the end."""
    worst, over = multiprocessing.Value("d", 0.0), multiprocessing.Value("i", 0)

    def sleep() -> None:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(70))
        due = time.monotonic()
        while True:
            due = max(due + 0.001, time.monotonic())
            time.sleep(max(due - time.monotonic(), 0.0))
            late = time.monotonic() - due
            worst.value = max(worst.value, late)
            over.value += late > LATENESS

    process = multiprocessing.get_context("fork").Process(target=sleep, daemon=True)
    process.start()
    try:
        yield
    finally:
        process.kill()
        print(
            f"a bare loop next to it: at worst {1e3 * worst.value:.1f} ms late, "
            f"{over.value} times above {1e3 * LATENESS:g} ms"
        )


def main() -> int:
    """Walk for the given time unless something ends the run; print the outcome."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--busy", type=int, default=8, help="busy processes next to it")
    parser.add_argument("--motor", choices=MOTORS, default="ak")
    options = parser.parse_args()
    program, driver = MOTORS[options.motor]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace = folder / "trace"
        with emulated_motor(program, trace) as port, busy(options.busy), bare_loop():
            words = f"{driver}:interface=udp_multicast,channel=239.74.163.2,port={port}"
            with entrain_run(folder / "bag", f"--driver={words}", *WALK) as run:
                run.find_nodes()
                for minute in range(1, int(options.minutes) + 1):
                    try:
                        run.process.wait(60)
                    except subprocess.TimeoutExpired:
                        print(f"{minute} of {options.minutes:g} min", file=sys.stderr, flush=True)
                        continue
                    break
                stopped = run.process.poll() is not None
                print(f"{pulses(trace)} pulses next to {options.busy} busy processes")
                if stopped:
                    print(f"ended in minute {minute}: {run.text}")
                else:
                    print(f"no stop in {options.minutes:g} min")
    return int(stopped)


if __name__ == "__main__":
    sys.exit(main())
