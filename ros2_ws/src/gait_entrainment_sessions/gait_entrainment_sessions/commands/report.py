# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain report: one HTML page about a run, a session or a study."""

import argparse
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment_sessions.report import write_report

DESCRIPTION = (
    "Write a self-contained HTML page about a run, a session or a study: whether the data are "
    "sound, the protocol as run, then the results with statistics. It is laid out for phones and "
    "for A4 paper."
)
EXAMPLES = """examples:
  entrain report bags/paper_example                 into bags/paper_example/report.html
  entrain report sessions/pilot/sub-P01/ses-1
  entrain report sessions/pilot --out pilot.html    all persons and sessions
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("path", type=Path, metavar="FOLDER", help="bag, session or study")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="default: report.html in the folder"
    )


def run(options: argparse.Namespace) -> int:
    """Write the page."""
    path = options.path
    out = options.out or (path if path.is_dir() else path.parent) / "report.html"
    if not out.parent.is_dir():
        raise UsageError(f"--out: {out.parent} is not a folder; allowed: a file in a folder")
    write_report(path, out)
    print(f"report           {out}")
    return 0
