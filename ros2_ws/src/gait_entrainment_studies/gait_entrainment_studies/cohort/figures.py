# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figure of a cohort: verdicts by pulse period, and the basins."""

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

# Mean and standard deviation over the subjects of the human study [% of the stride].
_HUMANS = (6.7, 3.6)


def draw_cohort(study: Study, folder: Path) -> list[Path]:
    """Draw the share of each verdict, and each subject's basin without noise."""
    figure, (left, right) = drawing.new_figure(1, 2, size=(9.6, 4.0))
    _draw_verdicts(study, left)
    if study.basins.size:
        _draw_basins(study, right)
    else:
        right.set_axis_off()
    for axes, columns in ((left, 4), (right, 2)):
        axes.locator_params(axis="y", integer=True)
        drawing.add_legend(axes, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=columns)
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
    ours = percent.mean(), percent.std(ddof=1) if percent.size > 1 else 0.0
    for who, (mean, deviation), colour, dash in (
        ("subjects", ours, BLUE, "--"),
        ("humans", _HUMANS, ORANGE, "-"),
    ):
        axes.axvline(mean, color=colour, ls=dash, lw=1.2, label=f"mean of the {who} {mean:.3g} %")
        shade = {"color": colour, "alpha": 0.15, "lw": 0}
        span = mean - deviation, mean + deviation
        axes.axvspan(*span, **shade, label=f"± standard deviation {deviation:.2g} %")
    axes.set(xlabel="basin of entrainment [% of the stride]", ylabel="subjects, sorted", xlim=0)
    axes.set_title("basins without noise, solved", fontsize=10)
