# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The cohort as a picture: verdicts by pulse period, and the basins."""

from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BLUE, GREEN, GREY, ORANGE, PINK, SKY, YELLOW
from gait_entrainment_studies.cohort.study import Study, verdicts

_COLOURS = {
    "entrained": GREEN,
    "undecided": GREY,
    "untestable": SKY,
    "drifting": ORANGE,
    "lost": YELLOW,
    "fell": BLUE,
    "flew off": PINK,
}


def draw_cohort(study: Study, folder: Path) -> list[Path]:
    """Draw the share of each verdict, and each subject's basin without noise."""
    figure, (left, right) = drawing.new_figure(1, 2, size=(9.6, 4.0))
    _draw_verdicts(study, left)
    if study.basins.size:
        _draw_basins(study, right)
    else:
        right.set_axis_off()
    for axes in (left, right):
        axes.locator_params(axis="y", integer=True)
        drawing.add_legend(axes, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=4)
    return drawing.save_figure(figure, folder, "cohort")


def _draw_verdicts(study: Study, axes: Any) -> None:
    offsets = sorted({trial.period_offset for trial in study.trials})
    place, base = np.arange(len(offsets)), np.zeros(len(offsets))
    for name, colour in _COLOURS.items():
        counts = np.array([verdicts(study, offset).get(name, 0) for offset in offsets])
        if counts.any():
            axes.bar(place, counts, bottom=base, color=colour, label=name, width=0.8)
            base = base + counts
    axes.set_xticks(place, [f"{offset * 1e3:+.0f}" for offset in offsets], fontsize=8)
    axes.set(xlabel="pulse period off the measured stride period [ms]", ylabel="subjects")
    axes.set_title("verdicts, with variability", fontsize=10)


def _draw_basins(study: Study, axes: Any) -> None:
    percent = np.sort(study.basin_widths)
    axes.plot(percent, np.arange(1, percent.size + 1), "o", color=BLUE, ms=4)
    axes.axvline(percent.mean(), color=BLUE, ls="--", lw=1, label=f"mean {percent.mean():.2f} %")
    axes.axvspan(6.7 - 3.6, 6.7 + 3.6, color=ORANGE, alpha=0.15, lw=0, label="human 6.7 ± 3.6 %")
    axes.axvline(6.7, color=ORANGE, lw=1)
    axes.set(xlabel="basin of entrainment [% of the stride]", ylabel="subjects, sorted", xlim=0)
    axes.set_title("basins without noise, solved", fontsize=10)
