# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures: one size, one look, as PNG and SVG."""

import argparse
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gait_entrainment.settings import Setting

# Colours of Okabe and Ito (2008); lines also differ in their dashes.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#777777"
SKY, YELLOW, PINK, BLACK = "#56B4E9", "#E69F00", "#CC79A7", "#000000"
COLOURS = (BLUE, ORANGE, GREEN, PINK, YELLOW, SKY)
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)))

# Places for a legend that would hide something inside the axes.
BESIDE = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
BELOW = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.13)}

_DPI = Setting("resolution of a figure", int, "1", 50, 1200)


def new_figure(
    *shape: int,
    size: tuple[float, float] = (7.2, 4.2),
    layout: Literal["constrained"] | None = "constrained",
    **options: Any,
) -> tuple[Any, Any]:
    """Return a matplotlib figure with this layout, and its axes as `subplots` returns them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout=layout)
    axes = figure.subplots(*shape, **options)
    for single in np.atleast_1d(axes).ravel():
        single.spines[["top", "right"]].set_visible(False)
    return figure, axes


def add_legend(axes: Any, **options: Any) -> None:
    """Add a small legend without a frame that has each label once, if there are any labels."""
    named: dict[str, Any] = {}
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        named.setdefault(label, handle)
    if named:
        style = {"frameon": False, "fontsize": 8, **options}
        axes.legend(list(named.values()), list(named), **style)


def mark_instant(axes: Any, place: float, name: str, height: float = 0.0, lift: float = 3) -> None:
    """Draw a vertical line at an instant, with its name `lift` points above this height."""
    axes.axvline(place, color=GREY, ls=":", lw=1.0)
    offset = {"xytext": (3, lift), "textcoords": "offset points"}
    axes.annotate(name, (place, height), color=GREY, fontsize=8, **offset)


def save_figure(figure: Any, folder: Path, name: str) -> list[Path]:
    """
    Write a figure as PNG and SVG into a folder, created if necessary; return the paths.

    The PNG has 130 dots per inch, unless matplotlib's ``savefig.dpi`` is set.
    """
    from matplotlib import rcParams

    given = rcParams["savefig.dpi"]
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / (name + ending) for ending in (".png", ".svg")]
    for path in paths:
        path.unlink(missing_ok=True)  # do not write through a link
        figure.savefig(path, dpi=130 if given == "figure" else given)
    return paths


def add_dpi_option(parser: argparse.ArgumentParser) -> None:
    """Add the option for the resolution of figures, for `chosen_dpi`."""
    text = "resolution of figures as PNG, default 130; each is also written as SVG"
    parser.add_argument("--dpi", metavar="INT", help=text)


def chosen_dpi(options: argparse.Namespace) -> AbstractContextManager[None]:
    """
    Return a context in which figures have the resolution of the option, if given.

    Raises SettingError if the resolution is not allowed.
    """
    from matplotlib import rc_context

    return rc_context(options.dpi and {"savefig.dpi": _DPI.parse("dpi", options.dpi)})
