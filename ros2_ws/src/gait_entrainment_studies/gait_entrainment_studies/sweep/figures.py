# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of the Arnold tongue: what is solved and what is walked, side by side, never mixed."""

from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BELOW, BLACK, GREY, ORANGE
from gait_entrainment_studies.locking.figures import PLACE_COLOURS
from gait_entrainment_studies.sweep.plan import SweepPlan
from gait_entrainment_studies.sweep.row import StableInterval

_PERIOD = r"pulse period $\tau_p - 2\tau_0$ [ms]"
_TORQUE = "torque of the pulse / peak ankle torque"


def draw_tongue(
    plan: SweepPlan, table: Any, borders: Sequence[StableInterval], folder: Path
) -> list[Path]:
    """Draw the exact map and the walked one, with the exact borders over both."""
    figure, (left, right) = drawing.new_figure(1, 2, size=(9.6, 4.6), sharex=True, sharey=True)
    for place in dict.fromkeys(row.place for row in borders):
        colour = PLACE_COLOURS[place]
        for pair in _neighbours([row for row in borders if row.place == place]):
            low, high = [row.shortest * 1e3 for row in pair], [row.longest * 1e3 for row in pair]
            heights = [row.torque_fraction for row in pair]
            left.fill_betweenx(heights, low, high, color=colour, alpha=0.35, lw=0)
            for axes, line in ((left, BLACK), (right, "white")):
                axes.plot(low, heights, color=line, lw=0.8)
                axes.plot(high, heights, color=line, lw=0.8)
        left.fill_between([], [], [], color=colour, alpha=0.35, label=f"stable: {place.value}")
    offsets, fractions = plan.period_offsets.values * 1e3, plan.torque_fractions.values
    share = _cells(plan, table, "share_locked")
    _draw_map(plan, right, share, "share of the initial phases", vmin=0, vmax=1, cmap="cividis")
    # Marks distinguish cells in which no walk can lock, because it ends or is not made.
    for column, marker, label in (
        ("share_fell", "v", "a walk fell"),
        ("share_flew_off", "^", "a walk flew off"),
    ):
        torques, periods = np.nonzero(np.nan_to_num(_cells(plan, table, column)))
        if torques.size:
            cells = offsets[periods], fractions[torques]
            right.plot(*cells, marker, color=ORANGE, ms=3, mew=0, label=label)
    if np.isnan(share).any():
        right.fill_between([], [], [], fc="white", ec=GREY, lw=0.6, label="not asked")
    drawing.add_legend(right, **BELOW, ncols=3)
    left.axvline(0, color=GREY, lw=0.6, ls=":")
    extent = _extent(plan)
    left.set(xlabel=_PERIOD, ylabel=_TORQUE, xlim=extent[:2], ylim=extent[2:])
    right.set(ylabel="", xlim=extent[:2], ylim=extent[2:])
    left.set_title("a stable 1:1 lock exists (solved)", fontsize=10)
    right.set_title(f"locked by stride {plan.strides} (walked)", fontsize=10)
    drawing.add_legend(left, **BELOW, ncols=1)
    return drawing.save_figure(figure, folder, "tongue")


def draw_locked_lags(plan: SweepPlan, table: Any, folder: Path) -> list[Path]:
    """Draw where in the gait cycle the walks lock, over period and torque."""
    figure, axes = drawing.new_figure(size=(7.2, 4.6))
    lags = _cells(plan, table, "median_lag") * 1e3
    _draw_map(plan, axes, lags, "locked pulse onset after toe-off [ms]", cmap="viridis")
    axes.set_title("Where the pulses lock (blank: no walk locked)", fontsize=11)
    return drawing.save_figure(figure, folder, "locked_lags")


def _draw_map(plan: SweepPlan, axes: Any, cells: Any, label: str, **style: Any) -> None:
    """Draw one number per cell, as colours."""
    image = axes.imshow(cells, origin="lower", extent=_extent(plan), aspect="auto", **style)
    axes.figure.colorbar(image, ax=axes, label=label)
    axes.axvline(0, color=GREY, lw=0.6, ls=":")
    axes.set(xlabel=_PERIOD, ylabel=_TORQUE)


def _cells(plan: SweepPlan, table: Any, column: str) -> Any:
    shape = plan.torque_fractions.count, plan.period_offsets.count
    return np.asarray(table[column]).reshape(shape)


def _extent(plan: SweepPlan) -> list[float]:
    """Outer edges of the cells: left, right, bottom, top."""
    edges = []
    for values in (plan.period_offsets.values * 1e3, plan.torque_fractions.values):
        half = 0.5 * (values[1] - values[0]) if values.size > 1 else 0.5
        edges += [float(values[0] - half), float(values[-1] + half)]
    return edges


def _neighbours(rows: Sequence[StableInterval]) -> list[tuple[StableInterval, StableInterval]]:
    """Pairs of intervals at neighbouring torques that continue each other."""
    by_torque: dict[float, list[StableInterval]] = {}
    for row in sorted(rows, key=lambda row: row.torque_fraction):
        by_torque.setdefault(row.torque_fraction, []).append(row)
    pairs: list[tuple[StableInterval, StableInterval]] = []
    for here, there in pairwise(by_torque.values()):
        if len(here) == len(there):
            pairs += zip(here, there, strict=True)
        else:  # an interval has split or ended: those that overlap belong together
            pairs += [
                (one, other)
                for one, other in product(here, there)
                if max(one.shortest, other.shortest) < min(one.longest, other.longest)
            ]
    return pairs
