# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of the questions asked of the model: one size, one look, PNG and SVG."""

from pathlib import Path
from typing import Any

import numpy as np

# Colours of Okabe and Ito (2008); lines also differ in their dashes.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#777777"
SKY, YELLOW, PINK, BLACK = "#56B4E9", "#E69F00", "#CC79A7", "#000000"
COLOURS = (BLUE, ORANGE, GREEN, PINK, YELLOW, SKY)
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)))


def new_figure(
    *shape: int, size: tuple[float, float] = (7.2, 4.2), **options: Any
) -> tuple[Any, Any]:
    """Return a matplotlib figure and its axes, as `subplots` gives them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(*shape, **options)
    for one in np.atleast_1d(axes).ravel():
        one.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save_figure(figure: Any, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG into a folder, made if need be; return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / (name + ending) for ending in (".png", ".svg")]
    for path in paths:
        figure.savefig(path, dpi=130)
    return paths
