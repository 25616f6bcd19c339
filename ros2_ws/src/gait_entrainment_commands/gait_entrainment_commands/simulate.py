# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain simulate: the experiment in one process, without ROS."""

import argparse
import json
import sys

from gait_entrainment.simulation import simulate
from gait_entrainment_commands import cli
from gait_entrainment_commands.outcome import outcome_of, summary, timing_outcome, timing_summary
from gait_entrainment_commands.protocol_options import add_protocol_options, chosen_protocol
from gait_entrainment_commands.timing import timings_of

DESCRIPTION = "Conduct a protocol on the simulated walker, in one process."
EXAMPLES = """examples:
  entrain simulate                              the paper's example
  entrain simulate --period-offset -0.07        pulses 70 ms faster than the walker
  entrain simulate my_protocol.yaml --json      one JSON object with every stride and pulse
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_protocol_options(parser)
    cli.add_onset_option(parser)
    cli.add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Simulate and print; return 1 if the walker falls or flies off."""
    protocol = chosen_protocol(options)
    simulation = simulate(
        protocol, timings_of=timings_of, measured_onsets=options.onset == "measured"
    )
    outcome = outcome_of(simulation)
    outcome["pulse_timing"] = timing_outcome(simulation.timings, simulation.measured_period)
    lines = [summary(outcome), *timing_summary(outcome["pulse_timing"])]
    print(json.dumps(outcome) if options.json else "\n".join(lines))
    if simulation.ending is not None:
        print(f"entrain simulate: {simulation.ending.message}", file=sys.stderr)
        return 1
    return 0
