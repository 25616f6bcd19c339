# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""entrain existence: for which stiffness and leg angle there is a gait."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gait_entrainment.commands.pulse_options import (
    add_walker_options,
    check_at_least,
    chosen_walker,
)


def add_command(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "existence",
        help="for which ankle stiffness and leg angle a gait exists",
        description="Range of stiffness between falling and flying off, along the leg angle.",
        epilog="examples:\n  entrain existence --out figures\n  entrain existence --json",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--points", type=int, default=120, metavar="INT", help="leg angles; default 120"
    )
    add_walker_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw the map into a folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Print the range of the walker, and the map in JSON."""
    from gait_entrainment.existence import existence_map, stiffness_range

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
        from gait_entrainment.existence.figures import draw_existence

        for path in draw_existence(ranges, walker, options.out):
            if not options.json:
                print(f"figure           {path}")
    return 0
