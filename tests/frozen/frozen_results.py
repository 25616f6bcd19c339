# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Results in which no restructuring may change a digit: hashes of what the commands print.

    python tests/frozen/frozen_results.py                  compare with results.json
    python tests/frozen/frozen_results.py --write          freeze again: say why in the commit
    python tests/frozen/frozen_results.py --keep DIR       also keep the hashed output, to diff it
    python tests/frozen/frozen_results.py --only run       only results with "run" in their names

Only the command line and the mcap library are used, so that the script outlives any refactoring.
The last bit of a number may differ on another processor: freeze there from a commit that is known
to be good, then compare.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pyarrow.parquet
from mcap.reader import make_reader

FROZEN = Path(__file__).with_name("results.json")
BAG = Path(__file__).parents[2] / "bags" / "paper_example"
PROTOCOLS = {
    "default": (),
    "faster": ("--period-offset", "-0.07", "--initial-phase", "0.2"),
    "slower": ("--period-offset", "0.02"),
    "period": ("--period", "1.88", "--side", "left"),
    "low": ("--torque", "8", "--width", "0.05", "--pulses", "100"),
    "dorsiflexion": ("--torque-fraction", "-0.05", "--pulses", "30"),
    "sham": ("--torque", "0", "--pulses", "10"),
    "body": ("--leg-length", "0.92", "--foot-length", "0.184", "--mass", "70",
             "--ankle-stiffness", "70.3"),
    "emulated": ("--driver", "emulated", "--onset", "measured", "--seed", "3"),
    "jittery": ("--driver", "emulated:delay=0.02,jitter=0.05,loss=0.1"),
    "fall": ("--torque", "-30", "--width", "0.3", "--pulses", "20"),
}  # fmt: skip
QUESTIONS = {
    "lock": ("lock",),
    "lock early": ("lock", "--torque-fraction", "0.05", "--width", "0.2"),
    "paper": ("paper",),
    "existence": ("existence",),
    "phase-response": ("phase-response",),
    "cohort": ("cohort", "--subjects", "4", "--seed", "5"),
}
# What docs/architecture.md promises to be the same, byte for byte, in two lock-step runs.
RUN_TOPICS = {
    "/joint_states", "/gait_events", "/ankle_torque", "/ground_reaction/left",
    "/ground_reaction/right", "/perturbation/torque_profile", "/perturbation/pulses",
    "/perturbator/state", "/gait/strides", "/gait/pulse_phases", "/gait/entrainment", "/clock",
}  # fmt: skip
REPLAY_TOPICS = {"/gait/strides", "/gait/pulse_phases", "/gait/entrainment"}


def printed(*words: str) -> bytes:
    """Return what a command prints, and its exit code, because some fail by design."""
    done = subprocess.run(["entrain", *words], capture_output=True, check=False)
    if done.returncode > 1 or not done.stdout:
        raise SystemExit(f"entrain {' '.join(words)}: {done.stderr.decode()}")
    return done.stdout + f"exit code {done.returncode}\n".encode()


def payloads(bag: Path, topics: set[str]) -> Iterator[tuple[str, bytes]]:
    """Yield topic and all payloads with their log times, in the order of the record."""
    found: dict[str, list[bytes]] = {topic: [] for topic in sorted(topics)}
    for file in sorted(bag.glob("*.mcap")):
        with file.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
                if channel.topic in found:
                    stamped = message.log_time.to_bytes(8, "little") + message.data
                    found[channel.topic].append(stamped)
    for topic, messages in found.items():
        yield topic, b"".join(messages)


def sweep(folder: Path) -> bytes:
    """Return the rows of a small sweep."""
    words = ("--torque-fractions", "0", "0.15", "3", "--period-offsets", "-0.09", "0.01", "5")
    printed("sweep", *words, "--out", str(folder / "sweep"), "--jobs", "1", "--json")
    rows = pyarrow.parquet.read_table(folder / "sweep" / "tongue.parquet").to_pylist()
    rows.sort(key=lambda row: json.dumps(row, sort_keys=True, default=str))
    return json.dumps(rows, sort_keys=True, default=str).encode()


def results(folder: Path) -> Iterator[tuple[str, Callable[[], Iterable[tuple[str, bytes]]]]]:
    """Yield each result's name and the function that computes its parts by name."""
    for name, options in PROTOCOLS.items():
        yield f"simulate {name}", lambda o=options: [("", printed("simulate", "--json", *o))]
    for name, words in QUESTIONS.items():
        yield name, lambda w=words: [("", printed(*w, "--json"))]
    yield "sweep", lambda: [("", sweep(folder))]

    def run() -> Iterator[tuple[str, bytes]]:
        printed("run", "--out", str(folder / "run"), "--no-figures", "--json")
        return payloads(folder / "run", RUN_TOPICS)

    def replay() -> Iterator[tuple[str, bytes]]:
        printed("replay", str(BAG), "--out", str(folder / "replay"), "--json")
        return payloads(folder / "replay", REPLAY_TOPICS)

    yield "run", run
    yield "replay", replay


def main() -> int:
    """Freeze or compare; return 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--write", action="store_true", help="freeze the current results")
    parser.add_argument("--keep", type=Path, help="folder for the hashed output")
    parser.add_argument("--only", default="", help="only results whose names contain this")
    options = parser.parse_args()
    frozen = json.loads(FROZEN.read_text()) if FROZEN.exists() else {}
    now = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, compute in results(Path(folder)):
            if options.only not in name:
                continue
            for part, content in compute():
                full = f"{name} {part}".strip()
                now[full] = hashlib.sha256(content).hexdigest()
                same = frozen.get(full) == now[full]
                print(f"{'same   ' if same else 'DIFFERS'} {full}", flush=True)
                if options.keep is not None:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / full.replace("/", "_")).write_bytes(content)
    if options.write:
        FROZEN.write_text(json.dumps(frozen | now, indent=1) + "\n")
        return 0
    return int(any(frozen.get(name) != value for name, value in now.items()))


if __name__ == "__main__":
    sys.exit(main())
