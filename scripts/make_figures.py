# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Redraw the pictures in docs: the run in README.md, and the results.

    python scripts/make_figures.py        into docs, listing those that have changed

Sweeps take longer, so their pictures are drawn from the tables that `entrain results` leaves next
to them. docs/figures/display.png shows RViz's scene and is not drawn here.
"""

import contextlib
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.image import imread
from PIL import Image

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_commands import main as entrain
from gait_entrainment_studies.commands.results import COMMAND, FIGURE, TEMPLATE
from gait_entrainment_studies.commands.sweep import borders_of, draw_sweep
from gait_entrainment_studies.paper.figures import draw_figures
from gait_entrainment_studies.sweep.plan import Axis, SweepPlan
from gait_entrainment_studies.sweep.store import read_sweep

DOCS = Path(__file__).resolve().parents[1] / "docs"
RUN = Path("figures/ankle_torque.png")
# Commands whose pictures take seconds.
QUICK = ("paper", "lock", "existence", "phase-response", "cohort")
TABLES = sorted((DOCS / "results").glob("*_tongue.parquet"))
# Share of the pixels. A line moved by its own width changes more.
_MAY_DIFFER = 0.0005


def draw_run(out: Path) -> dict[Path, Path]:
    """Run the paper's example on the nodes; return its picture by the one in docs."""
    subprocess.run(["entrain", "run", "--out", out / "run"], check=True, stdout=subprocess.DEVNULL)
    return {RUN: out / "run/ankle_torque.png"}


def draw_results(out: Path, commands: Sequence[str] = QUICK) -> dict[Path, Path]:
    """Draw what `entrain results` shows of some commands; return each by the picture in docs."""
    drawn = {}
    _, *page = COMMAND.split(TEMPLATE.read_text(encoding="utf-8"))
    for command, text in zip(page[::2], page[1::2], strict=True):
        name, figures = command.split()[0], FIGURE.findall(text)
        if name not in commands or not figures:
            continue
        if name == "paper":  # without its table, which takes longer than its figures
            draw_figures(out / name)
        else:
            entrain([*command.split(), "--out", str(out / name)])
        drawn |= {Path("results") / place: out / name / f"{file}.png" for place, file in figures}
    return drawn


def swept(table: Path) -> tuple[SweepPlan, Any]:
    """Return the plan and the table of a sweep that `entrain results` left."""
    rows, provenance = read_sweep(table)
    plan = provenance["plan"]
    axes = {name: Axis(**plan[name]) for name in ("period_offsets", "torque_fractions")}
    return SweepPlan(**{**plan, **axes, "walker": WalkerParameters(**plan["walker"])}), rows


def draw_sweeps(out: Path) -> dict[Path, Path]:
    """Draw the sweeps from their tables; return each picture by the one in docs."""
    drawn = {}
    for table in TABLES:
        plan, rows = swept(table)
        number = table.name.partition("_")[0]
        for picture in draw_sweep(plan, rows, borders_of(plan), out / number):
            place = Path("results") / f"{number}_{picture.name}"
            if (DOCS / place).exists():
                drawn[place] = picture
    return drawn


def same(picture: Path, other: Path) -> bool:
    """
    Return whether two pictures show the same.

    matplotlib brings its own font and renderer, so one version draws the same pixels everywhere,
    except for the last bits of its arithmetic: a few pixels may differ.
    """
    a, b = imread(picture), imread(other)
    return a.shape == b.shape and np.mean(abs(a - b).max(axis=2) > 0.1) <= _MAY_DIFFER


def drawn_by_this_matplotlib(picture: Path) -> bool:
    """Return whether a picture was drawn by the installed version."""
    with Image.open(picture) as opened:
        return f"version{matplotlib.__version__}," in opened.info["Software"]


def main() -> int:
    """Draw all pictures; return the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = draw_run(Path(folder))
        with contextlib.redirect_stdout(io.StringIO()):
            drawn |= draw_results(Path(folder))
            drawn |= draw_sweeps(Path(folder))
        for place, picture in drawn.items():
            known = DOCS / place
            if known.exists() and drawn_by_this_matplotlib(known) and same(known, picture):
                continue
            shutil.copyfile(picture, known)
            print(f"changed  docs/{place}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
