# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain sweep: the Arnold tongue."""

import argparse
import re
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_studies.commands import question
from gait_entrainment_studies.sweep.engine import JOBS, by_processes, chosen_jobs, rows_by_dask
from gait_entrainment_studies.sweep.figures import draw_locked_lags, draw_tongue
from gait_entrainment_studies.sweep.plan import Axis, SweepPlan
from gait_entrainment_studies.sweep.row import StableInterval, exact_borders, sweep_row
from gait_entrainment_studies.sweep.store import SweepStore, read_sweep

# The exact borders are drawn at this many torques or more, so a coarse sweep has smooth ones.
_BORDER_TORQUES = 50

_OUT = "folder of table and figures; rows that it already has are not walked again; default sweep"
DESCRIPTION = (
    "Two maps: whether a stable lock exists (solved), and the share of initial phases locked "
    "by the last stride (walked). Writes tongue.parquet and figures."
)
EXAMPLES = """examples:
  entrain sweep --out tongue                 100 offsets x 50 torques x 16 initial phases
  entrain sweep --out tongue                 again, after an interruption: continues
  entrain sweep --out both --torque-fractions -0.2 0.2 81 --period-offsets -0.2 0.2 81
  entrain sweep --out tongue --scheduler tcp://host:8786
"""

_OFFSET = Setting("pulse period minus stride period", unit="s")
_FRACTION = Setting("torque over the peak ankle torque", unit="1")
_COUNT = Setting("number of values", int, least=1, most=10_000)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    for name, axis, *default in (
        ("period_offsets", _OFFSET, "-0.12", "0.02", "100"),
        ("torque_fractions", _FRACTION, "0.005", "0.25", "50"),
    ):
        parser.add_argument(
            "--" + name.replace("_", "-"),
            nargs=3,
            default=default,
            metavar=("MIN", "MAX", "COUNT"),
            help=f"{axis.meaning} [{axis.unit}]; default {' '.join(default)}",
        )
    cli.add_settings(parser, SweepPlan)
    cli.add_setting(parser, "jobs", JOBS)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="use a Dask cluster instead")
    question.add_walker_options(parser)
    cli.add_output_options(parser, _OUT, Path("sweep"))


def run(options: argparse.Namespace) -> int:
    """Compute the missing rows, join all, draw."""
    jobs = chosen_jobs(options.jobs)
    plan = cli.chosen(
        options,
        SweepPlan,
        walker=cli.chosen(options, WalkerParameters),
        period_offsets=_axis("period_offsets", _OFFSET, options.period_offsets),
        torque_fractions=_axis("torque_fractions", _FRACTION, options.torque_fractions),
    )
    store = SweepStore(options.out, plan)
    try:
        _fill(plan, store, jobs, options.scheduler)
    except KeyboardInterrupt:
        count = plan.torque_fractions.count
        print(
            f"entrain sweep: interrupted after {count - len(store.missing())} of {count} torques;"
            " the same command continues",
            file=sys.stderr,
        )
        return 1
    return _report(plan, store, options)


def _axis(name: str, setting: Setting, texts: Sequence[str]) -> Axis:
    least, most = (setting.parse(name, text) for text in texts[:2])
    return Axis(least, most, _COUNT.parse(name, texts[2]))


def _fill(plan: SweepPlan, store: SweepStore, jobs: int, scheduler: str | None) -> None:
    """Compute and write the missing rows."""
    missing = store.missing()
    if not missing:
        return
    if scheduler:
        rows = rows_by_dask(plan, missing, scheduler)
    else:
        rows = by_processes(partial(sweep_row, plan), missing, jobs)
    tqdm.monitor_interval = 0  # no thread: see by_processes
    walks = plan.period_offsets.count * plan.phases
    total = plan.torque_fractions.count * walks
    with tqdm(total=total, initial=total - len(missing) * walks, unit="walk", disable=None) as bar:
        for index, row in rows:
            store.add(index, row)
            bar.update(walks)


def draw_sweep(
    plan: SweepPlan, table: Any, borders: Sequence[StableInterval], folder: Path
) -> list[Path]:
    """Draw the figures of a finished sweep; return their paths."""
    return [*draw_tongue(plan, table, borders, folder), *draw_locked_lags(plan, table, folder)]


def borders_of(plan: SweepPlan) -> list[StableInterval]:
    """Solve for the borders at the torques of a sweep, or at more if they are few."""
    torques = plan.torque_fractions
    fractions = np.linspace(torques.least, torques.most, max(torques.count, _BORDER_TORQUES))
    return exact_borders(plan.walker, fractions, plan.width)


def _report(plan: SweepPlan, store: SweepStore, options: argparse.Namespace) -> int:
    table, _ = read_sweep(store.finish())
    borders = borders_of(plan)
    counts = _counts(plan, {name: np.asarray(table[name]) for name in table.column_names})

    def draw(folder: Path) -> list[Path]:
        return [store.table_path, *draw_sweep(plan, table, borders, folder)]

    outcome = {re.sub(r"\W", "_", name): count for name, count in counts.items()}
    return cli.answer(
        options,
        {**outcome, "borders": [vars(one) for one in borders]},
        "\n".join(f"{name:25} {count}" for name, count in counts.items()),
        draw,
        f"{'written':25} ",
    )


def _counts(plan: SweepPlan, columns: dict[str, Any]) -> dict[str, int]:
    # If walks were long enough to decide, both maps must agree.
    walked = columns["problem"] == ""
    ended = columns["share_fell"] + columns["share_flew_off"]
    decided = walked & (columns["share_censored"] == 0) & (columns["share_alternating"] == 0)
    decided &= ended == 0
    agree = (columns["stable_locks"] > 0) == (columns["share_locked"] > 0)
    counts = {
        "cells": walked.size,
        "cells not asked": (~walked).sum(),
        "walks": walked.sum() * plan.phases,
        "strides of each": plan.strides,
        "cells with a stable lock": (columns["stable_locks"] > 0).sum(),
        "cells told by walking": decided.sum(),
        "of these agreeing": (decided & agree).sum(),
        "cells with 2:2 locks": (columns["share_alternating"] > 0).sum(),
        "cells with falls": (columns["share_fell"] > 0).sum(),
        "cells with flights": (columns["share_flew_off"] > 0).sum(),
    }
    return {name: int(count) for name, count in counts.items()}
