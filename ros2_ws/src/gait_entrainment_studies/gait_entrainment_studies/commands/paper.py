# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain paper: every published number and figure beside ours."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gait_entrainment_studies.paper.comparison import Comparison

DESCRIPTION = "Hold the model against Ahn and Hogan (2012), with the parameters of Table 1."
EXAMPLES = """examples:
  entrain paper                      the table
  entrain paper --out figures        and figures 4 to 8 as PNG and SVG
  entrain paper --json               a list of {name, paper, ours, unit, agrees, note}
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw the figures into a folder")
    parser.add_argument("--json", action="store_true", help="print one JSON list")


def run(options: argparse.Namespace) -> int:
    """Print the comparison; a number that differs is a finding, not a failure."""
    from gait_entrainment_studies.paper.comparison import compare, explain

    rows, explanations = compare(), explain()
    paths = []
    if options.out is not None:
        from gait_entrainment_studies.paper.figures import draw_figures

        options.out.mkdir(parents=True, exist_ok=True)
        paths = draw_figures(options.out)
    if options.json:
        print(json.dumps([asdict(row) for row in [*rows, *explanations]]))
    else:
        print(table(rows))
        stated = [row.agrees for row in rows if row.agrees is not None]
        print(f"\n{sum(stated)} of {len(stated)} agree.")
        print(
            "\nExplanations tested: Table 1 with k, mu or both as they may have been unrounded\n"
        )
        print(table(explanations))
        for path in paths:
            print(f"figure           {path}")
    return 0


def table(rows: "list[Comparison]") -> str:
    """Return comparisons as a Markdown table."""
    lines = ["| what | paper | ours | unit | agrees | note |", "| --- " * 6 + "|"]
    for row in rows:
        ours = row.ours if isinstance(row.ours, str) else f"{row.ours:.6g}"
        agrees = {True: "yes", False: "no", None: "-"}[row.agrees]
        lines.append(f"| {row.name} | {row.paper} | {ours} | {row.unit} | {agrees} | {row.note} |")
    return "\n".join(lines)
