# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain paper: every published number and figure, compared with ours."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict

from gait_entrainment_commands import cli
from gait_entrainment_studies.paper.comparison import Comparison, compare, explain
from gait_entrainment_studies.paper.figures import draw_figures

DESCRIPTION = "Compare the model with Ahn and Hogan (2012), with the parameters of Table 1."
EXAMPLES = """examples:
  entrain paper                      the table
  entrain paper --out figures        also figures 4 to 8 as PNG and SVG
  entrain paper --json               a list of {name, paper, ours, unit, agrees, note}
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    cli.add_output_options(parser, "draw the figures into a folder")


def run(options: argparse.Namespace) -> int:
    """Print the comparison; a number that differs is a finding, not a failure."""
    rows, explanations = compare(), explain()
    stated = [row.agrees for row in rows if row.agrees is not None]
    text = (
        f"{_table(rows)}\n\n{sum(stated)} of {len(stated)} agree.\n\n"
        "Explanation tested: Table 1 with possible unrounded values of k, mu or both\n\n"
        f"{_table(explanations)}"
    )
    outcome = [asdict(row) for row in [*rows, *explanations]]
    return cli.answer(options, outcome, text, draw_figures)


def _table(rows: Sequence[Comparison]) -> str:
    """Return comparisons as a Markdown table."""
    lines = ["| what | paper | ours | unit | agrees | note |", "| --- " * 6 + "|"]
    for row in rows:
        ours = row.ours if isinstance(row.ours, str) else f"{row.ours:.6g}"
        agrees = {True: "yes", False: "no", None: "-"}[row.agrees]
        lines.append(f"| {row.name} | {row.paper} | {ours} | {row.unit} | {agrees} | {row.note} |")
    return "\n".join(lines)
