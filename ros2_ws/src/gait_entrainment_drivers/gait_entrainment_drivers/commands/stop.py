# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop: torque to zero, latched, for every ankle robot that this machine drives."""

import argparse
import json
import sys
from dataclasses import asdict

from gait_entrainment_drivers.stop_channel import stop_all

DESCRIPTION = (
    "Bring the torque of every ankle robot that this machine drives to zero, latched, and say "
    "what the device measures. Needs no ROS, no home folder and no writable disk. Exit code 0 if "
    "every robot confirmed it. No substitute for a switch in the hand: see docs/safety.md."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    # Whoever is in a hurry mistypes: nothing keeps it from stopping.
    parser.add_argument("words", nargs="*", help=argparse.SUPPRESS)


def run(options: argparse.Namespace) -> int:
    """Stop everything; 1 if there is nothing to stop, or somebody did not confirm it."""
    answers = stop_all()
    if options.json:
        print(json.dumps({"stopped": {name: asdict(a) for name, a in answers.items()}}))
    else:
        for name, answer in answers.items():
            print(f"{name}: {answer.message}")
    if not answers:
        nobody = "no robot is driven by this machine: if one pushes, cut its power"
        print(f"entrain stop: {nobody}", file=sys.stderr)
        return 1
    if options.words:
        print(f"entrain stop: unknown words: {' '.join(options.words)}", file=sys.stderr)
    failed = [name for name, answer in answers.items() if not answer.done]
    if failed:
        print(
            f"entrain stop: {', '.join(failed)} did not confirm the stop: cut the power",
            file=sys.stderr,
        )
    return 1 if failed else 0
