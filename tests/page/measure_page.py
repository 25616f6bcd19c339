# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Measure what the page costs a run and how soon its STOP acts: the figures of docs/page.md.

    python tests/page/measure_page.py cpu speed lateness frozen stop      all of them, or some
"""

import os
import resource
import signal
import statistics
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / name) for name in ("page", ".", "system", "safety")]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

from browser import chromium  # noqa: E402
from harness import NODES, QUICK, cpu_seconds, entrain_run  # noqa: E402
from pages import Look, free_port, page, until_served  # noqa: E402
from test_drivers import emulated_motor  # noqa: E402
from time_to_zero import GONE, WALK, rows_of, wait_for_pulse  # noqa: E402

from gait_entrainment_bringup.node_list import PAGE  # noqa: E402

WATCHED = 12.0  # [s]
BROWSERS = 10
PAIRS = 6


def share(process: int) -> str:
    """Return the share of a core that a process uses."""
    before, begin = cpu_seconds(process), time.monotonic()
    time.sleep(WATCHED)
    return f"{100 * (cpu_seconds(process) - before) / (time.monotonic() - begin):.1f} %"


def cpu(folder: Path) -> None:
    """Print what the page uses with no browser, one and ten."""
    port, robot = free_port(), "--driver=emulated:state_rate=200"
    walk = ("--real-time", robot, "--pulses=300", "--page", f"--port={port}")
    with entrain_run(folder / "cpu", *walk) as run:
        process = run.find_nodes((*NODES, PAGE))[PAGE]
        until_served(port, run)
        print("cpu, no browser:", share(process), flush=True)
        with chromium() as browser:
            Look(browser, port).until("baseline")
            print("cpu, one browser:", share(process), flush=True)
            for _ in range(BROWSERS - 1):
                browser.switch_to.new_window("tab")
                browser.get(f"http://127.0.0.1:{port}/")
            print(f"cpu, {BROWSERS} browsers:", share(process), flush=True)


def speed(folder: Path) -> None:
    """
    Print what a page that watches costs a lock-step run, from pairs in either order.

    On a shared machine, processor time is a better measure than speed.
    """
    ratios, used = [], {"55": [], "56": [], "page": []}
    with page(folder, ROS_DOMAIN_ID="55") as served:
        for pair in range(PAIRS):
            speeds = {}
            for domain in ("55", "56") if pair % 2 else ("56", "55"):
                walk = ("--pulses=200", "--json")
                seen, walked = cpu_seconds(served.process.pid), ended_cpu_seconds()
                with entrain_run(folder / f"{domain}_{pair}", *walk, ROS_DOMAIN_ID=domain) as run:
                    speeds[domain] = run.outcome()["real_time_factor"]
                used[domain].append(ended_cpu_seconds() - walked)
                if domain == "55":
                    used["page"].append(cpu_seconds(served.process.pid) - seen)
            ratios.append(speeds["55"] / speeds["56"])
            print(f"lock-step without {speeds['56']:.1f}, with {speeds['55']:.1f}", flush=True)
    medians = [statistics.median(used[of]) for of in ("56", "55", "page")]
    print(f"ratio, median: {statistics.median(ratios):.3f}; processor time of a run without and")
    print("with, and of the page meanwhile: {:.2f}, {:.2f}, {:.2f} s".format(*medians))


def ended_cpu_seconds() -> float:
    """Return the processor time of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def lateness(folder: Path) -> None:
    """Print how late samples are in real time, without and with a page."""
    for number in range(4):
        walk = (*QUICK, "--real-time", "--json", "--baseline=3", "--pulses=45", "--washout=2")
        with_page = ("--page", f"--port={free_port()}") if number % 2 else ()
        with entrain_run(folder / f"late_{number}", *walk, *with_page) as run:
            outcome = run.outcome()
            print("with page:" if with_page else "without:", outcome["publish_lateness_ms"],
                  outcome["promises"], "lost", outcome["lost"], flush=True)  # fmt: skip


def frozen(folder: Path) -> None:
    """Print what happens to a run whose page is frozen, in real time and in lock-step."""
    port = free_port()
    walk = (*QUICK, "--real-time", "--json", "--pulses=50", "--sample-rate=1000")
    with entrain_run(folder / "frozen", *walk, "--page", f"--port={port}") as run:
        process = run.find_nodes((*NODES, PAGE))[PAGE]
        until_served(port, run)
        os.kill(process, signal.SIGSTOP)
        outcome = run.outcome()
        print("frozen, real time:", outcome["promises"], "lost", outcome["lost"], flush=True)
    with page(folder, ROS_DOMAIN_ID="57") as served:
        os.kill(served.process.pid, signal.SIGSTOP)
        with entrain_run(folder / "held", "--json", ROS_DOMAIN_ID="57") as run:
            print("frozen, lock-step:", run.outcome()["real_time_factor"], "times real time")


def stop(folder: Path) -> None:
    """Print how long an emulated motor's torque lasts after STOP is clicked in mid-pulse."""
    for number in range(4):
        place = folder / f"stop_{number}"
        place.mkdir()
        with emulated_motor(place) as (driver, trace), chromium() as browser:
            port = free_port()
            walk = (f"--driver={driver}", *WALK, "--pulses=300", "--page", f"--port={port}")
            with entrain_run(place / "bag", *walk) as run:
                until_served(port, run)
                look = Look(browser, port)
                look.until("ak_mit_can")
                since = look.press_stop(partial(wait_for_pulse, run, trace, 1))
                run.wait()
        pushing = [at for at, _, torque in rows_of(trace) if at >= since and abs(torque) > GONE]
        print(f"STOP: {(max(pushing, default=since) - since) / 1e6:.0f} ms", flush=True)


def main() -> None:
    """Run the requested measurements."""
    measures = {m.__name__: m for m in (cpu, speed, lateness, frozen, stop)}
    for name in sys.argv[1:] or measures:
        with tempfile.TemporaryDirectory() as folder:
            measures[name](Path(folder))


if __name__ == "__main__":
    main()
