# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain existence: for which stiffness and leg angle a gait exists."""

import argparse
from dataclasses import asdict

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_studies.commands import question
from gait_entrainment_studies.existence.figures import draw_existence
from gait_entrainment_studies.existence.stiffness_range import existence_map, stiffness_range

DESCRIPTION = "Range of stiffness between falling and flying off, along the leg angle."
EXAMPLES = "examples:\n  entrain existence --out figures\n  entrain existence --json"

_POINTS = Setting("leg angles", int, least=2, most=100_000)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    cli.add_setting(parser, "points", _POINTS, "120")
    question.add_walker_options(parser)
    cli.add_output_options(parser, "draw the map into a folder")


def run(options: argparse.Namespace) -> int:
    """Print the range of the walker, and the map in JSON."""
    walker = cli.chosen(options, WalkerParameters)
    own = stiffness_range(walker)
    ranges = existence_map(walker, _POINTS.parse("points", options.points))
    text = (
        f"leg angle        {own.leg_angle:.6f} rad\n"
        f"just vaults over {own.just_vault_over:.6f} N m/rad, decided at: {own.falls_at.value}\n"
        f"just flies off   {own.just_fly_off:.6f} N m/rad, decided at: {own.flies_off_at.value}\n"
        f"map              {len(ranges)} leg angles with a closed linkage,"
        f" {sum(r.exists for r in ranges)} with a gait"
    )
    outcome = {"walker": asdict(own), "map": [asdict(r) for r in ranges]}
    return cli.answer(options, outcome, text, lambda out: draw_existence(ranges, walker, out))
