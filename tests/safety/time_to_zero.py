# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Measure how long torque lasts at the motor after anything that ends it, for docs/safety.md.

    python tests/safety/time_to_zero.py --trials 100            every action, both emulated motors
    python tests/safety/time_to_zero.py --trials 12 --seed 5    a short form
    python tests/safety/time_to_zero.py --only stop --busy 8    next to eight busy processes

Each trial is an `entrain run --real-time` with an emulated motor in another process, whose own
timeout is 0.05 s. The action comes at a random time in a pulse. The motor's own trace then shows
when its torque fell below 5 % of the pulse for good, and how many pulses followed. Prints a table:
action, motor, trials, median and worst [ms], further pulses. Each run's first line goes to stderr.
Exits with 1 if torque lasted, or if a run ended before its action.
"""

import argparse
import contextlib
import math
import os
import random
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "system"))
from harness import EntrainRun, entrain_run

# Sixteen times normal gravity, so that a trial takes a quarter of the time.
WALK = (
    "--gravity=156.96", "--mass=5", "--period-offset=-0.0125", "--width=0.08", "--torque=5",
    "--baseline=4", "--pulses=5000", "--real-time", "--arm", "--unproved",
)  # fmt: skip
HEIGHT = 5.0
GONE = 0.05 * HEIGHT
# How long the motor is watched after an action [s]: several strides of this walker.
WATCHED = 2.5
MOTORS = {
    "ak": ("ak_motor_emulator", "ak_mit_can"),
    "odrive": ("odrive_emulator", "odrive_can"),
}
STOPPING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP", "SIGQUIT")
FROZEN = ("experiment", "walker_sim", "gait_analyzer", "bag_recorder", "perturbator")


def torque_loop(run: EntrainRun) -> int:
    """Return the process that streams torque: a child of the perturbator."""
    parent = run.nodes["perturbator"]
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return int(children[0])


def actions() -> dict[str, Callable[[EntrainRun], None]]:
    """Return the actions by name."""
    found: dict[str, Callable[[EntrainRun], None]] = {}
    for node in FROZEN:
        found[f"kill {node}"] = lambda run, n=node: os.kill(run.nodes[n], signal.SIGKILL)
        found[f"freeze {node}"] = lambda run, n=node: os.kill(run.nodes[n], signal.SIGSTOP)
    found["kill torque loop"] = lambda run: os.kill(torque_loop(run), signal.SIGKILL)
    found["freeze torque loop"] = lambda run: os.kill(torque_loop(run), signal.SIGSTOP)
    found["kill entrain run"] = lambda run: os.kill(run.process.pid, signal.SIGKILL)
    found["freeze entrain run"] = lambda run: os.kill(run.process.pid, signal.SIGSTOP)
    for name in STOPPING:
        found[name] = lambda run, n=name: os.kill(run.process.pid, getattr(signal, n))
    found["entrain stop"] = lambda _: subprocess.Popen(
        ["entrain", "stop"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    return found


@contextlib.contextmanager
def emulated_motor(program: str, trace: Path) -> Iterator[int]:
    """Run an emulated motor on its own bus; yield the port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        port = free.getsockname()[1]
    words = [program, f"--port={port}", "--timeout=0.05", f"--trace={trace}"]
    motor = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert motor.stdout is not None
        assert "ready" in motor.stdout.readline()
        yield port
    finally:
        motor.kill()
        motor.wait()


@contextlib.contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep this many processes busy."""
    loop = [sys.executable, "-c", "while True: pass"]
    processes = [subprocess.Popen(loop) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()


def rows_of(trace: Path) -> list[tuple[int, float, float]]:
    """Return time [ns], command and torque [N m] of each complete line of a motor's trace."""
    lines = trace.read_text().splitlines(keepends=True)
    rows = [line.split() for line in lines if line.endswith("\n")]
    return [(int(at), float(command), float(torque)) for at, command, torque in rows]


def wait_for_pulse(run: EntrainRun, trace: Path, number: int) -> bool:
    """Wait until a pulse is under way; return False if the run ends first."""
    pulses, pushing, place = 0, False, 0
    while run.process.poll() is None:
        with trace.open() as file:
            file.seek(place)
            text = file.read()
        complete = text.rfind("\n") + 1
        place += complete
        for line in text[:complete].splitlines():
            under = float(line.split()[2]) > 0.8 * HEIGHT
            pulses += under and not pushing
            pushing = under if under or float(line.split()[2]) < GONE else pushing
        if pushing and pulses >= number:
            return True
        time.sleep(0.001)
    return False


def trial(action: str, motor: str, draw: random.Random, folder: Path) -> tuple[float, int, str]:
    """Carry out an action in a run; return time to zero [ms], further pulses, and its message."""
    program, driver = MOTORS[motor]
    trace = folder / "trace"
    with emulated_motor(program, trace) as port:
        options = f"{driver}:interface=udp_multicast,channel=239.74.163.2,port={port}"
        with entrain_run(folder / "bag", f"--driver={options}", *WALK) as run:
            run.find_nodes()
            if not wait_for_pulse(run, trace, draw.randint(1, 3)):
                return float("nan"), 0, "the run ended before the action: " + run.text[-200:]
            time.sleep(draw.random() * 0.05)
            since = time.time_ns()
            actions()[action](run)
            time.sleep(WATCHED)
            rows = [row for row in rows_of(trace) if row[0] >= since]
            lines = run.text.strip().splitlines()
    pushing = [at for at, _, torque in rows if abs(torque) > GONE]
    further = sum(
        before < 0.5 * HEIGHT <= after for (_, _, before), (_, _, after) in pairwise(rows)
    )
    last = max(pushing, default=since)
    return (last - since) / 1e6, further, lines[0] if lines else ""


def main() -> int:
    """Run the trials and print the table; return 1 if torque lasted to the end of a trial."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--busy", type=int, default=0, help="busy processes next to it")
    parser.add_argument("--only", default="", help="part of the names of the wanted actions")
    options = parser.parse_args()
    draw = random.Random(options.seed)
    wanted = [name for name in actions() if options.only in name]
    plan = [
        (wanted[i % len(wanted)], list(MOTORS)[(i // len(wanted)) % 2])
        for i in range(options.trials)
    ]
    found: dict[tuple[str, str], list[tuple[float, int, str]]] = {}
    with busy(options.busy):
        for number, (action, motor) in enumerate(plan, start=1):
            with tempfile.TemporaryDirectory() as folder:
                result = trial(action, motor, draw, Path(folder))
            found.setdefault((action, motor), []).append(result)
            print(f"{number}/{len(plan)} {action}, {motor}: {result[0]:.0f} ms, {result[1]} "
                  f"further pulses; {result[2][:150]}", file=sys.stderr, flush=True)  # fmt: skip
    print(
        f"{'action':<24}{'motor':<8}{'trials':>7}{'median':>8}{'worst':>8}{'further pulses':>16}"
    )
    for (action, motor), results in sorted(found.items()):
        # Runs that ended before the action are left out.
        times = [result[0] for result in results if not math.isnan(result[0])]
        if not times:
            continue
        print(
            f"{action:<24}{motor:<8}{len(times):>7}{statistics.median(times):>8.0f}"
            f"{max(times):>8.0f}{max(result[1] for result in results):>16}"
        )
    lasting = [
        t for results in found.values() for t, _, _ in results if not t < 1e3 * WATCHED * 0.9
    ]
    return int(bool(lasting))


if __name__ == "__main__":
    sys.exit(main())
