# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop: bring every ankle robot driven by this machine to zero torque, latched."""

import argparse
import json
import sys
from dataclasses import asdict

from gait_entrainment_drivers.stop_channel import stop_all

DESCRIPTION = (
    "Bring every ankle robot driven by this machine to zero torque, latched, and print what the "
    "device measures. Needs no ROS, home folder or writable disk. The exit code is 0 if every "
    "robot confirmed the stop. This is no substitute for a hand-held switch: see docs/safety.md."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    # People mistype in a hurry: superfluous words do not prevent the stop.
    parser.add_argument("words", nargs="*", help=argparse.SUPPRESS)


def run(options: argparse.Namespace) -> int:
    """Stop every robot; return 1 if there is none, or if one did not confirm the stop."""
    answers = stop_all()
    if options.json:
        print(json.dumps({"stopped": {name: asdict(a) for name, a in answers.items()}}))
    else:
        for name, answer in answers.items():
            print(f"{name}: {answer.message}")
    if not answers:
        reason = "no robot is driven by this machine: if one pushes, cut its power"
        print(f"entrain stop: {reason}", file=sys.stderr)
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
