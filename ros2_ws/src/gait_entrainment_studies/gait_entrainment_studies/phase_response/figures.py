# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The phase response curve, with the lock that it predicts and the exact one."""

from collections.abc import Sequence
from pathlib import Path

from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BELOW, BLACK, BLUE, GREY, ORANGE
from gait_entrainment_studies.phase_response.response import PhaseResponse, Prediction


def draw_response(
    response: PhaseResponse, predictions: Sequence[Prediction], folder: Path
) -> list[Path]:
    """Draw shift against phase, and for each prediction the shift that locking requires."""
    figure, axes = drawing.new_figure()
    axes.plot(response.phase, response.shift * 1e3, color=BLUE, lw=2, label="in the end")
    axes.plot(
        response.phase,
        response.first_stride_shift * 1e3,
        color=ORANGE,
        ls="--",
        lw=1.5,
        label="at the end of the stride",
    )
    stride = response.stride_period
    for prediction in predictions:
        wanted = -prediction.period_offset * 1e3
        axes.axhline(wanted, color=GREY, ls=":", lw=0.8, label="what a lock asks for")
        phases = [0.5 + lock.onset / stride for lock in (prediction.predicted, prediction.exact)]
        style = {"mfc": "white", "mec": BLACK, "label": "lock predicted"}
        axes.plot(phases[:1], [wanted], "o", **style)
        axes.plot(phases[1:], [wanted], "x", color=BLACK, label="lock, exact")
    drawing.mark_instant(axes, 0.5, "other leg's\nheel strike")
    # Toe-off is an unperturbed double stance later.
    drawing.mark_instant(
        axes, 0.5 + float(response.onset[0] - response.lag[0]) / stride, "toe-off"
    )
    axes.set(
        xlabel="phase of the pulse in the perturbed leg's gait cycle",
        ylabel="advance of the heel strikes [ms]",
        xlim=(0, 1),
    )
    axes.set_title("Phase response to a single pulse", fontsize=11)
    drawing.add_legend(axes, **BELOW, ncols=3)
    return drawing.save_figure(figure, folder, "phase_response")
