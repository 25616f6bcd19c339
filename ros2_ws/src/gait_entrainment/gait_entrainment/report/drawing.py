# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Figures of the questions asked of the model: one size, one look, PNG and SVG."""

from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.report.figures import BLUE, GREEN, GREY, ORANGE

# Further colours of Okabe and Ito (2008); lines also differ in their dashes.
SKY, YELLOW, PINK, BLACK = "#56B4E9", "#E69F00", "#CC79A7", "#000000"
COLOURS = (BLUE, ORANGE, GREEN, PINK, YELLOW, SKY)
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)))

__all__ = [
    "BLACK", "BLUE", "COLOURS", "DASHES", "GREEN", "GREY", "ORANGE", "PINK", "SKY", "YELLOW",
    "new_figure", "save_figure",
]  # fmt: skip


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
