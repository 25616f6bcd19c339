# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options for what the bag of a recorded run may lack if it is from another recorder."""

import argparse
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.protocol import read_protocol


def add_record_options(parser: argparse.ArgumentParser, *, needed: bool = True) -> None:
    """Add the bag, and options that replace its protocol and perturbed leg."""
    nargs = None if needed else "?"
    parser.add_argument("bag", nargs=nargs, type=Path, metavar="BAG", help="folder or .mcap file")
    parser.add_argument(
        "--protocol",
        type=Path,
        metavar="FILE",
        help="the protocol of the run (default: the one in the bag, if any)",
    )
    parser.add_argument(
        "--side",
        choices=[side.name.lower() for side in Side],
        help="the perturbed leg (default: as in the protocol, or else the one with the robot)",
    )


def record_overrides(options: argparse.Namespace) -> dict[str, Any]:
    """Return the protocol and the side given as options, None if not given."""
    return {
        "protocol": options.protocol and read_protocol(options.protocol),
        "side": None if options.side is None else Side[options.side.upper()],
    }
