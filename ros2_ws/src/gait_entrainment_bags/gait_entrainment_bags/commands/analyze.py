# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain analyze: the outcome of a recorded run, from its bag alone."""

import argparse
import json
import sys
from pathlib import Path

from gait_entrainment.commands.outcome_options import add_outcome_options

DESCRIPTION = "Analyze a bag anew, and hold the result against what was published live."
EXAMPLES = """examples:
  entrain analyze bags/paper_example            outcome of a recorded run
  entrain analyze bags/paper_example --json     one JSON object, as of entrain simulate
  entrain analyze bags/mine --onset measured    pulses begin where the measured torque rises
  entrain analyze bags/mine --figures out       draws the figures into the folder out
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder or .mcap file")
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw figures into it")
    add_outcome_options(parser, onset=None)


def run(options: argparse.Namespace) -> int:
    """Analyze and print; 1 where the bag cannot be analyzed, 2 where there is none."""
    # Imported here: other commands do without the readers.
    from gait_entrainment.outcome import summary, timing_summary
    from gait_entrainment_bags import BagError
    from gait_entrainment_bags.recorded_run import messages_line, read_run, recorded_outcome

    if not options.bag.exists():
        print(f"entrain analyze: {options.bag}: no such file or folder", file=sys.stderr)
        return 2
    figures: list[Path] = []
    try:
        drawn = options.figures is not None
        recorded = read_run(options.bag, torques=drawn, onset=options.onset)
        if drawn:
            from gait_entrainment_bags.figures import draw_figures

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
