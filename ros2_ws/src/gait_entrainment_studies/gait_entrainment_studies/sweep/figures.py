# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The Arnold tongue: what is solved and what is walked, side by side, never mixed."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    new_figure,
    save_figure,
)
from gait_entrainment_studies.sweep.borders import StableInterval
from gait_entrainment_studies.sweep.plan import SweepPlan

_FIRST_COLOURS = (ORANGE, BLUE, GREEN)


def draw_tongue(
    plan: SweepPlan, table: Any, borders: Sequence[StableInterval], folder: Path
) -> list[Path]:
    """Draw the exact map and the walked one, with the exact borders over both."""
    figure, (left, right) = new_figure(1, 2, size=(9.6, 4.6), sharex=True, sharey=True)
    shape = plan.torque_fractions.count, plan.period_offsets.count
    offsets, fractions = plan.period_offsets.values * 1e3, plan.torque_fractions.values
    extent = [*_edges(offsets), *_edges(fractions)]
    places = {"pulse begins before double stance": ORANGE, "pulse inside double stance": BLUE}
    for place in dict.fromkeys(one.place for one in borders):
        colour = places.get(place, GREEN)
        rows = [one for one in borders if one.place == place]
        for one, following in _neighbours(rows):
            low = [one.shortest * 1e3, following.shortest * 1e3]
            high = [one.longest * 1e3, following.longest * 1e3]
            heights = [one.torque_fraction, following.torque_fraction]
            left.fill_betweenx(heights, low, high, color=colour, alpha=0.35, lw=0)
            for axes in (left, right):
                axes.plot(low, heights, color=BLACK if axes is left else "white", lw=0.8)
                axes.plot(high, heights, color=BLACK if axes is left else "white", lw=0.8)
        left.fill_between([], [], [], color=colour, alpha=0.35, label=f"stable: {place}")
    share = np.asarray(table["share_locked"]).reshape(shape)
    image = right.imshow(
        share, origin="lower", extent=extent, aspect="auto", vmin=0, vmax=1, cmap="cividis"
    )
    figure.colorbar(image, ax=right, label="share of the initial phases")
    # Marks keep cells apart in which no walk can lock because it ends, or is not made.
    for column, marker, label in (
        ("share_fell", "v", "a walk fell"),
        ("share_flew_off", "^", "a walk flew off"),
    ):
        cells = np.nan_to_num(np.asarray(table[column]).reshape(shape))
        torques, periods = np.nonzero(cells)
        if torques.size:
            style = {"color": ORANGE, "ms": 3, "mew": 0, "label": label}
            right.plot(offsets[periods], fractions[torques], marker, **style)
    if np.isnan(share).any():
        right.fill_between([], [], [], fc="white", ec=GREY, lw=0.6, label="not asked")
    if right.get_legend_handles_labels()[0]:
        right.legend(
            frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3
        )
    for axes in (left, right):
        axes.axvline(0, color=GREY, lw=0.6, ls=":")
        axes.set(xlabel=r"pulse period $\tau_p - 2\tau_0$ [ms]", xlim=extent[:2], ylim=extent[2:])
    left.set(ylabel="torque of the pulse / peak ankle torque")
    left.set_title("a stable 1:1 lock exists (solved)", fontsize=10)
    right.set_title(f"locked by stride {plan.strides} (walked)", fontsize=10)
    if left.get_legend_handles_labels()[0]:
        left.legend(
            frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=1
        )
    return save_figure(figure, folder, "tongue")


def _edges(values: Any) -> list[float]:
    """Outer edges of the cells around evenly spaced values."""
    half = 0.5 * (values[1] - values[0]) if values.size > 1 else 0.5
    return [float(values[0] - half), float(values[-1] + half)]


def _neighbours(rows: Sequence[StableInterval]) -> list[tuple[StableInterval, StableInterval]]:
    """Pairs of intervals at neighbouring torques that continue each other."""
    by_torque: dict[float, list[StableInterval]] = {}
    for one in rows:
        by_torque.setdefault(one.torque_fraction, []).append(one)
    pairs = []
    for here, there in pairwise(by_torque[torque] for torque in sorted(by_torque)):
        if len(here) == len(there):
            pairs += list(zip(here, there, strict=True))
        else:
            # One has split or ended: those belong together that overlap.
            pairs += [
                (one, other)
                for one in here
                for other in there
                if max(one.shortest, other.shortest) < min(one.longest, other.longest)
            ]
    return pairs


def draw_locked_lags(plan: SweepPlan, table: Any, folder: Path) -> list[Path]:
    """Draw where in the gait cycle the walks lock, over period and torque."""
    figure, axes = new_figure(size=(7.2, 4.6))
    shape = plan.torque_fractions.count, plan.period_offsets.count
    offsets, fractions = plan.period_offsets.values * 1e3, plan.torque_fractions.values
    lags = np.asarray(table["median_lag"]).reshape(shape) * 1e3
    extent = [*_edges(offsets), *_edges(fractions)]
    image = axes.imshow(lags, origin="lower", extent=extent, aspect="auto", cmap="viridis")
    figure.colorbar(image, ax=axes, label="locked pulse onset after toe-off [ms]")
    axes.axvline(0, color=GREY, lw=0.6, ls=":")
    axes.set(
        xlabel=r"pulse period $\tau_p - 2\tau_0$ [ms]",
        ylabel="torque of the pulse / peak ankle torque",
    )
    axes.set_title("Where the pulses lock (blank: no walk locked)", fontsize=11)
    return save_figure(figure, folder, "locked_lags")
