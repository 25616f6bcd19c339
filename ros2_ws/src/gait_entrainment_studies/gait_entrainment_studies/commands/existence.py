# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain existence: for which stiffness and leg angle there is a gait."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from gait_entrainment_studies.commands.pulse_options import (
    add_walker_options,
    check_at_least,
    chosen_walker,
)

DESCRIPTION = "Range of stiffness between falling and flying off, along the leg angle."
EXAMPLES = "examples:\n  entrain existence --out figures\n  entrain existence --json"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--points", type=int, default=120, metavar="INT", help="leg angles; default 120"
    )
    add_walker_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw the map into a folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Print the range of the walker, and the map in JSON."""
    from gait_entrainment_studies.existence.stiffness_range import existence_map, stiffness_range

    try:
        walker = chosen_walker(options)
        own = stiffness_range(walker)
        check_at_least("points", options.points, 2)
        ranges = existence_map(walker, options.points)
    except ValueError as error:
        print(f"entrain existence: {error}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps({"walker": asdict(own), "map": [asdict(r) for r in ranges]}))
    else:
        print(f"leg angle        {own.leg_angle:.6f} rad")
        print(f"just vaults over {own.just_vault_over:.6f} N m/rad, felt at: {own.falls_at.value}")
        print(
            f"just flies off   {own.just_fly_off:.6f} N m/rad, felt at: {own.flies_off_at.value}"
        )
        print(
            f"map              {len(ranges)} leg angles with a linkage, "
            f"{sum(r.exists for r in ranges)} with a gait"
        )
    if options.out is not None:
        from gait_entrainment_studies.existence.figures import draw_existence

        for path in draw_existence(ranges, walker, options.out):
            if not options.json:
                print(f"figure           {path}")
    return 0
