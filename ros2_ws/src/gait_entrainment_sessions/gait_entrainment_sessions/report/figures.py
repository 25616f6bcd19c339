# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of a report, as SVG inside the page."""

import io
import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BESIDE, BLUE, GREEN, GREY, ORANGE, PINK, SKY
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.statistics import Direction

COLOURS = {
    "entrained": GREEN,
    "drifting": ORANGE,
    "lost": PINK,
    "undecided": GREY,
    "untestable": SKY,
}
_MARKERS = {"entrained": "o", "drifting": "x", "lost": "s", "undecided": "d", "untestable": "^"}


def svg_of(figure: Any, name: str) -> str:
    """Return a figure as an SVG element; ``name`` keeps its ids apart from other figures'."""
    from matplotlib import rc_context

    text = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    return re.sub(r' d="([^"]*)"', lambda path: f' d="{_thinned(path[1])}"', svg)


def _thinned(path: str) -> str:
    """Return a path in hundredths of a point, without the points inside horizontal lines."""
    lines = re.sub(r"(\.\d\d)\d+", r"\1", path).strip().split("\n")
    words = [line.split() for line in lines]
    level = [word[0] == "L" and word[2:] for word in words]
    inside = (
        0 < n < len(words) - 1 and level[n] and level[n - 1] == level[n] == level[n + 1]
        for n in range(len(words))
    )
    return " ".join(line for line, left_out in zip(lines, inside, strict=True) if not left_out)


def draw_circle(findings: Findings) -> Any:
    """Draw the phase of each pulse, from the first in the centre to the last at the rim."""
    figure, axes = _new_circle(findings.direction)
    pulses = findings.part.analysis.pulses
    angles = 2 * np.pi * np.array([pulse.phase for pulse in pulses])
    places = np.array([pulse.number for pulse in pulses])
    places = places / places.max(initial=1)
    last = len(pulses) - findings.direction.count
    axes.plot(angles[:last], places[:last], ".", color=GREY, ms=5)
    axes.plot(angles[last:], places[last:], ".", color=BLUE, ms=5)
    return figure


def draw_directions(study: StudyFindings) -> Any:
    """Draw the mean phase of each person, and their mean."""
    figure, axes = _new_circle(study.direction)
    axes.plot(2 * np.pi * np.array(study.phases), np.ones(len(study.phases)), "o", color=BLUE)
    return figure


def _new_circle(direction: Direction) -> tuple[Any, Any]:
    """Return a figure and its polar axes: the stride around them, an arrow to a mean phase."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6, 4.6), layout="constrained")
    axes: Any = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_ylim(0, 1.08)
    axes.set_yticks([])
    axes.set_xticks(
        np.arange(8) * math.pi / 4,
        ["0\nheel strike", "", "0.25", "", "0.5", "", "0.75", ""],
    )
    if direction.count:
        mean = 2 * math.pi * direction.phase, direction.resultant
        arrow = {"arrowstyle": "-|>", "color": ORANGE, "lw": 2}
        axes.annotate("", mean, (0, 0), arrowprops=arrow)
    return figure, axes


def draw_verdicts(findings: Sequence[Findings]) -> Any:
    """Draw the verdict of each run over its pulse period, one line per person."""
    persons = sorted({finding.placed.place.person for finding in findings})
    figure, axes = drawing.new_figure(size=(7.2, 1.6 + 0.28 * len(persons)))
    axes.axvline(0, color=GREY, ls="--", lw=1.2)
    for finding in findings:
        verdict = finding.verdict
        axes.plot(
            finding.offset_percent,
            persons.index(finding.placed.place.person),
            _MARKERS[verdict],
            color=COLOURS[verdict],
            label=verdict,
        )
    axes.set_yticks(range(len(persons)), persons)
    axes.set_ylim(len(persons) - 0.5, -0.5)
    axes.set(xlabel="pulse period minus stride period [% of the stride]")
    drawing.add_legend(axes, **BESIDE)
    return figure
