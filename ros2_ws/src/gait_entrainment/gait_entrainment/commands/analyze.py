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

"""entrain analyze: the outcome of a recorded run, from its bag alone."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from gait_entrainment.commands.outcome_options import add_outcome_options

_EXAMPLES = """examples:
  entrain analyze bags/paper_example            outcome of a recorded run
  entrain analyze bags/paper_example --json     one JSON object, as of entrain simulate
  entrain analyze bags/mine --onset measured    pulses begin where the measured torque rises
  entrain analyze bags/mine --figures out       draws the figures into the folder out
"""


def add_command(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "analyze",
        help="the outcome of a recorded run, without ROS",
        description="Analyze a bag anew, and hold the result against what was published live.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder or .mcap file")
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw figures into it")
    add_outcome_options(parser, onset=None)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Analyze and print; 1 where the bag cannot be analyzed, 2 where there is none."""
    # Imported here: other commands do without the readers.
    from gait_entrainment.bags import BagError
    from gait_entrainment.report.pulse_timing import timing_summary
    from gait_entrainment.report.recorded_run import read_run
    from gait_entrainment.report.summary import messages_line, recorded_outcome, summary

    if not options.bag.exists():
        print(f"entrain analyze: {options.bag}: no such file or folder", file=sys.stderr)
        return 2
    figures: list[Path] = []
    try:
        drawn = options.figures is not None
        recorded = read_run(options.bag, torques=drawn, onset=options.onset)
        if drawn:
            from gait_entrainment.report.figures import draw_figures

            options.figures.mkdir(parents=True, exist_ok=True)
            figures = draw_figures(recorded, options.figures)
    except (BagError, OSError) as error:
        print(f"entrain analyze: {error}", file=sys.stderr)
        return 1
    outcome = recorded_outcome(recorded, options.bag) | {
        "ended_early": recorded.ended_early or None,
        "as_published_live": (None if recorded.differences is None else not recorded.differences),
        "differences": list(recorded.differences or ()),
    }
    if options.json:
        print(json.dumps(outcome))
        return 0
    for line in (summary(outcome), *timing_summary(outcome["pulse_timing"])):
        print(line)
    print(f"live analysis    {_comparison(recorded.differences)}")
    print(messages_line(recorded))
    for figure in figures:
        print(f"figure           {figure}")
    return 0


def _comparison(differences: tuple[str, ...] | None) -> str:
    """Say how the analysis compares with what the analyzer published during the run."""
    if differences is None:
        return "none was recorded"
    return f"differs: {'; '.join(differences)}" if differences else "the same to the last bit"
