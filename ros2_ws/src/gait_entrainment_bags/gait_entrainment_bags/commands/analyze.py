# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain analyze: the outcome of a recorded run, from its bag alone, or from tables."""

import argparse
import json
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.gait import analyze
from gait_entrainment.robot import PulseTiming
from gait_entrainment.run import Run
from gait_entrainment_bags.commands.record_options import add_record_options, record_overrides
from gait_entrainment_bags.figures import draw_figures
from gait_entrainment_bags.recorded_run import (
    conducted,
    messages_line,
    periods_of,
    read_run,
    recorded_outcome,
)
from gait_entrainment_bags.truth import TOE_OFF_BIAS, detection_lines, without_bias
from gait_entrainment_commands import cli
from gait_entrainment_commands.drawing import add_dpi_option, chosen_dpi
from gait_entrainment_commands.outcome import outcome_of, summary, timing_summary
from gait_entrainment_sensors.offline import read_events, read_onsets

DESCRIPTION = "Analyze a bag again, and compare the result with what was published live."
EXAMPLES = """examples:
  entrain analyze bags/paper_example            outcome of a recorded run
  entrain analyze bags/paper_example --json     one JSON object, as from entrain simulate
  entrain analyze bags/mine --onset measured    pulses begin where the measured torque rises
  entrain analyze bags/mine --figures out --dpi 300    also draws figures into the folder out
  entrain analyze theirs --protocol mine.yaml   recorded by ros2 bag record
  entrain analyze --events walk_events.tsv --pulses pulses.tsv --side right
                                                recorded without this project
"""
TABLES = ("events", "pulses")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_record_options(parser, needed=False)
    parser.add_argument(
        "--events",
        type=Path,
        metavar="FILE",
        help="instead of a bag: gait events, as entrain detect writes them",
    )
    parser.add_argument(
        "--pulses", type=Path, metavar="FILE", help="with --events: a column onset [s], same clock"
    )
    parser.add_argument(
        "--toe-off-bias",
        metavar="SECONDS",
        help=f"with --events: {TOE_OFF_BIAS.meaning} (default 0)",
    )
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw figures into FOLDER")
    add_dpi_option(parser)
    cli.add_onset_option(parser, onset=None)
    cli.add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Analyze and print."""
    if options.bag is None or any(getattr(options, name) is not None for name in TABLES):
        return _of_tables(options)
    drawn = options.figures is not None
    given = record_overrides(options)
    recorded = read_run(options.bag, torques=drawn, onset=options.onset, **given)
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


def _of_tables(options: argparse.Namespace) -> int:
    """Analyze a table of events and a table of pulses, and print."""
    lacking = [f"--{name}" for name in (*TABLES, "side") if getattr(options, name) is None]
    if options.bag is not None or lacking:
        wrong = f"missing: {', '.join(lacking)}" if lacking else "not both"
        raise UsageError(f"give either BAG or --events, --pulses and --side; {wrong}")
    if options.figures is not None or options.onset is not None:
        raise UsageError("--figures and --onset need a BAG")
    given = record_overrides(options)
    bias = float(TOE_OFF_BIAS.parse("--toe-off-bias", options.toe_off_bias or "0"))
    events, onsets = read_events(options.events), read_onsets(options.pulses)
    analysis = analyze(without_bias(events, bias), onsets, given["side"])
    if not analysis.strides:
        raise UsageError(
            f"{options.events}: holds no plausible stride of the {options.side} leg, from heel "
            "strike to heel strike; onset is in seconds, and step counts both legs"
        )
    start, end = analysis.strides[0].start, analysis.strides[-1].end
    if not any(start <= onset <= end for onset in onsets):
        raise UsageError(
            f"{options.pulses}: column onset: {onsets[0] / 1e9:g} to {onsets[-1] / 1e9:g} s; "
            f"allowed: some in the strides, {start / 1e9:g} to {end / 1e9:g} s on the same clock"
        )
    periods = periods_of(conducted(given["protocol"], events), analysis)
    delivered = tuple((given["side"], PulseTiming(onset)) for onset in onsets)
    run = Run(given["protocol"], tuple(events), delivered, *periods, analysis, ())
    outcome = outcome_of(run) | ({"toe_off_bias": bias} if bias else {})
    lines = [summary(outcome), *detection_lines(outcome)]
    print(json.dumps(outcome) if options.json else "\n".join(lines))
    return 0
