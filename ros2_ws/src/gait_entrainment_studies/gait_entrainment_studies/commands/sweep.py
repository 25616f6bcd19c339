# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain sweep: the Arnold tongue."""

import argparse
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_entrainment_studies.commands.pulse_options import (
    PAPER_WIDTH,
    add_walker_options,
    chosen_walker,
)

if TYPE_CHECKING:
    from gait_entrainment_studies.sweep.plan import Axis

# The exact borders are drawn at this many torques or more: a coarse sweep has smooth borders too.
_BORDER_TORQUES = 50

_OUT = "folder of table and picture; what is there already is not walked again; default sweep"
DESCRIPTION = (
    "Two maps: whether a stable lock exists (solved), and the share of initial phases locked "
    "by the last stride (walked). Writes tongue.parquet and a picture."
)
EXAMPLES = """examples:
  entrain sweep --out tongue                 100 offsets x 50 torques x 16 initial phases
  entrain sweep --out tongue                 again, after an interruption: goes on
  entrain sweep --out both --torque-fractions -0.2 0.2 81 --period-offsets -0.2 0.2 81
  entrain sweep --out tongue --scheduler tcp://host:8786
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    for option, default, text in (
        ("--period-offsets", (-0.12, 0.02, 100), "pulse period minus stride period [s]"),
        ("--torque-fractions", (0.005, 0.25, 50), "torque over the peak ankle torque"),
    ):
        parser.add_argument(
            option,
            nargs=3,
            type=float,
            default=default,
            metavar=("MIN", "MAX", "COUNT"),
            help=f"{text}; default {' '.join(map(str, default))}",
        )
    for option, count, text in (
        ("--phases", 16, "initial phases walked from"),
        ("--strides", 100, "strides of each walk"),
    ):
        parser.add_argument(
            option, type=int, default=count, metavar="INT", help=f"{text}; default {count}"
        )
    parser.add_argument(
        "--width",
        type=float,
        default=PAPER_WIDTH,
        metavar="FLOAT",
        help=f"duration of the pulse [s]; default {PAPER_WIDTH}",
    )
    add_walker_options(parser)
    parser.add_argument("--out", type=Path, default=Path("sweep"), metavar="DIR", help=_OUT)
    parser.add_argument("--jobs", type=int, metavar="INT", help="processes; default: all cores")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="use a Dask cluster instead")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Sweep what is missing, join, draw."""
    from gait_entrainment.parameters import ParameterError
    from gait_entrainment_studies.sweep.plan import SweepError, SweepPlan
    from gait_entrainment_studies.sweep.store import SweepStore

    try:
        if options.jobs is not None and options.jobs < 1:
            raise SweepError(f"jobs: {options.jobs}; allowed: at least 1")
        plan = SweepPlan(
            walker=chosen_walker(options),
            period_offsets=_axis("period_offsets", options.period_offsets),
            torque_fractions=_axis("torque_fractions", options.torque_fractions),
            phases=options.phases,
            strides=options.strides,
            width=options.width,
        )
        store = SweepStore(options.out, plan)
    except (ParameterError, SweepError) as error:
        print(f"entrain sweep: {error}", file=sys.stderr)
        return 2
    try:
        _fill(plan, store, options)
    except SweepError as error:
        print(f"entrain sweep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        done = plan.torque_fractions.count - len(store.missing())
        print(
            f"entrain sweep: interrupted after {done} of {plan.torque_fractions.count} torques;"
            " the same command goes on",
            file=sys.stderr,
        )
        return 1
    _report(plan, store, options)
    return 0


def _axis(name: str, values: Sequence[float]) -> "Axis":
    from gait_entrainment_studies.sweep.plan import Axis, SweepError

    least, most, count = values
    if not float(count).is_integer():
        raise SweepError(f"{name}: {count:g} values; allowed: a whole number")
    return Axis(least, most, int(count))


def _fill(plan: Any, store: Any, options: argparse.Namespace) -> None:
    """Make and write the rows that are missing."""
    from tqdm import tqdm

    from gait_entrainment_studies.sweep.engine import (
        available_cores,
        rows_by_dask,
        rows_by_processes,
    )

    missing = store.missing()
    if not missing:
        return
    if options.scheduler:
        rows = rows_by_dask(plan, missing, options.scheduler)
    else:
        rows = rows_by_processes(plan, missing, options.jobs or available_cores())
    tqdm.monitor_interval = 0  # no thread: see rows_by_processes
    walks = plan.walks // plan.torque_fractions.count
    total = plan.torque_fractions.count * walks
    with tqdm(total=total, initial=total - len(missing) * walks, unit="walk", disable=None) as bar:
        for index, row in rows:
            store.add(index, row)
            bar.update(walks)


def _report(plan: Any, store: Any, options: argparse.Namespace) -> None:
    import numpy as np

    from gait_entrainment_studies.sweep.borders import exact_borders
    from gait_entrainment_studies.sweep.figures import draw_locked_lags, draw_tongue
    from gait_entrainment_studies.sweep.store import read_sweep

    table, _ = read_sweep(store.finish())
    torques = plan.torque_fractions
    fractions = np.linspace(torques.least, torques.most, max(torques.count, _BORDER_TORQUES))
    borders = exact_borders(plan.walker, fractions, plan.width)
    paths = [store.table_path, *draw_tongue(plan, table, borders, options.out)]
    paths += draw_locked_lags(plan, table, options.out)
    columns = {name: np.asarray(table[name]) for name in table.column_names}
    # Where walks were long enough to tell, both maps must agree.
    asked = columns["problem"] == ""
    told = (columns["share_censored"] == 0) & asked
    told &= columns["share_alternating"] == 0
    told &= columns["share_fell"] + columns["share_flew_off"] == 0
    agree = (columns["stable_locks"] > 0) == (columns["share_locked"] > 0)
    counts = {
        "cells": asked.size,
        "cells not asked": (~asked).sum(),
        "walks": asked.sum() * plan.phases,
        "strides of each": plan.strides,
        "cells with a stable lock": (columns["stable_locks"] > 0).sum(),
        "cells told by walking": told.sum(),
        "of these agreeing": (told & agree).sum(),
        "cells with 2:2 locks": (columns["share_alternating"] > 0).sum(),
        "cells with falls": (columns["share_fell"] > 0).sum(),
        "cells with flights": (columns["share_flew_off"] > 0).sum(),
    }
    if options.json:
        outcome = {re.sub(r"\W", "_", name): int(count) for name, count in counts.items()}
        print(json.dumps({**outcome, "borders": [vars(one) for one in borders]}))
        return
    for name, count in counts.items():
        print(f"{name:25} {count}")
    for path in paths:
        print(f"{'written':25} {path}")
