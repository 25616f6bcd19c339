# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain analyze: the outcome of a recorded run, from its bag alone."""

import argparse
import json
from pathlib import Path

from gait_entrainment.commands.outcome_options import add_outcome_options
from gait_entrainment.drawing import add_dpi_option, chosen_dpi
from gait_entrainment.outcome import summary, timing_summary
from gait_entrainment_bags.commands.record_options import add_record_options, told_of_record
from gait_entrainment_bags.figures import draw_figures
from gait_entrainment_bags.recorded_run import messages_line, read_run, recorded_outcome
from gait_entrainment_bags.truth import detection_lines

DESCRIPTION = "Analyze a bag anew, and hold the result against what was published live."
EXAMPLES = """examples:
  entrain analyze bags/paper_example            outcome of a recorded run
  entrain analyze bags/paper_example --json     one JSON object, as of entrain simulate
  entrain analyze bags/mine --onset measured    pulses begin where the measured torque rises
  entrain analyze bags/mine --figures out --dpi 300    draws the figures into the folder out
  entrain analyze theirs --protocol mine.yaml   recorded by ros2 bag record
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_record_options(parser)
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw figures into it")
    add_dpi_option(parser)
    add_outcome_options(parser, onset=None)


def run(options: argparse.Namespace) -> int:
    """Analyze and print."""
    drawn = options.figures is not None
    told = told_of_record(options)
    recorded = read_run(options.bag, torques=drawn, onset=options.onset, **told)
    figures: list[Path] = []
    if drawn:
        with chosen_dpi(options):
            figures = draw_figures(recorded, options.figures)
    differences = recorded.differences
    outcome = recorded_outcome(recorded, options.bag) | {
        "ended_early": recorded.ended_early or None,
        "as_published_live": None if differences is None else not differences,
        "differences": list(differences or ()),
    }
    if options.json:
        print(json.dumps(outcome))
        return 0
    timing = timing_summary(outcome["pulse_timing"])
    for line in (summary(outcome), *detection_lines(outcome), *timing):
        print(line)
    comparison = "none was recorded" if differences is None else "the same to the last bit"
    if differences:
        comparison = f"differs: {'; '.join(differences)}"
    print(f"live analysis    {comparison}")
    print(messages_line(recorded))
    for figure in figures:
        print(f"figure           {figure}")
    return 0
