# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain phase-response: what a single pulse does, and the lock that it predicts."""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_studies.commands import question
from gait_entrainment_studies.phase_response.figures import draw_response
from gait_entrainment_studies.phase_response.response import (
    PhaseResponse,
    Prediction,
    phase_response,
    predictions,
)

DESCRIPTION = (
    "Advance of the heel strikes by one pulse, at every phase, and the locked phase at which the "
    "advance is the unperturbed minus the pulse period, compared with the exact one."
)
EXAMPLES = """examples:
  entrain phase-response                          predicted and exact lock at -50 ms
  entrain phase-response --out figures            also phase_response.csv and the curve
  entrain phase-response --period-offset -0.07 --period-offset -0.02
"""

_COLUMNS = ("phase", "onset", "lag", "shift", "first_stride_shift")
_HEADER = "phase [1],onset [s],lag [s],shift [s],first_stride_shift [s]"
_POINTS = Setting("points on each branch", int, least=2, most=100_000)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shown = "-0.05; may be repeated"
    cli.add_setting(parser, "period_offset", question.PERIOD_OFFSET, shown=shown, action="append")
    cli.add_setting(parser, "points", _POINTS, "201")
    question.add_gait_options(parser)
    cli.add_output_options(parser, "write curve and CSV to a folder")


def run(options: argparse.Namespace) -> int:
    """Solve and print; the curve itself goes to JSON and CSV."""
    gait = question.chosen_gait(options)
    texts = options.period_offset or ["-0.05"]
    offsets = np.array([question.chosen_offset(text, gait) for text in texts])
    response = phase_response(gait, _POINTS.parse("points", options.points))
    found = predictions(gait, offsets)
    curve = np.column_stack([getattr(response, name) for name in _COLUMNS])
    locks = [
        {
            "period_offset": prediction.period_offset,
            "predicted_lag": prediction.predicted.lag,
            "exact_lag": prediction.exact.lag,
            "predicted_stable": prediction.predicted.stable,
        }
        for prediction in found
    ]

    def write(folder: Path) -> list[Path]:
        paths = [*draw_response(response, found, folder), folder / "phase_response.csv"]
        np.savetxt(paths[-1], curve, "%.12g", ",", header=_HEADER, comments="")
        return paths

    outcome = {"columns": _COLUMNS, "curve": curve.tolist(), "locks": locks}
    return cli.answer(options, outcome, _summary(response, found), write, "written          ")


def _summary(response: PhaseResponse, found: Sequence[Prediction]) -> str:
    most, least = np.nanmax(response.shift), np.nanmin(response.shift)
    lines = [
        f"stride period    {response.stride_period:.9f} s",
        f"advance          {least * 1e3:.4f} to {most * 1e3:.4f} ms in the end",
    ]
    ended = response.phase[np.isnan(response.shift)]
    if ended.size:
        lines.append(
            f"falls or flies off at {ended.size} of {response.phase.size} phases, between"
            f" {np.nanmin(ended):.4f} and {np.nanmax(ended):.4f}"
        )
    lines += [
        f"lock at {lock.period_offset * 1e3:+.3f} ms: lag predicted"
        f" {lock.predicted.lag * 1e3:.4f} ms, exact {lock.exact.lag * 1e3:.4f} ms,"
        f" difference {lock.lag_error * 1e3:+.4f} ms"
        for lock in found
    ]
    return "\n".join(lines if found else [*lines, "no stable lock at the chosen pulse periods"])
