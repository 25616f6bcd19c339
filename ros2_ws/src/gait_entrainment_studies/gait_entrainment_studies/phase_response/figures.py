# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The phase response curve, with the lock that it predicts beside the exact one."""

from collections.abc import Sequence
from pathlib import Path

from gait_entrainment.drawing import BLACK, BLUE, GREY, ORANGE, new_figure, save_figure
from gait_entrainment_studies.phase_response.response import PhaseResponse, Prediction


def draw_response(
    response: PhaseResponse, predictions: Sequence[Prediction], folder: Path
) -> list[Path]:
    """Draw shift against phase, and for each prediction the shift that locking asks for."""
    figure, axes = new_figure()
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
    for index, one in enumerate(predictions):
        wanted = -one.period_offset * 1e3
        axes.axhline(wanted, color=GREY, ls=":", lw=0.8)
        phases = [0.5 + lock.onset / stride for lock in (one.predicted, one.exact)]
        labels = ("lock predicted", "lock, exact") if index == 0 else (None, None)
        axes.plot(phases[:1], [wanted], "o", mfc="white", mec=BLACK, label=labels[0])
        axes.plot(phases[1:], [wanted], "x", color=BLACK, label=labels[1])
    for place, name in ((0.5, "other leg's\nheel strike"), (0.5 + _toe_off(response), "toe-off")):
        axes.axvline(place, color=GREY, ls=":", lw=1.0)
        axes.annotate(
            name, (place, 0), xytext=(3, 3), textcoords="offset points", color=GREY, fontsize=8
        )
    axes.set(
        xlabel="phase of the pulse in the perturbed leg's gait cycle",
        ylabel="advance of the heel strikes [ms]",
        xlim=(0, 1),
    )
    axes.set_title("Phase response to a single pulse", fontsize=11)
    axes.legend(frameon=False, fontsize=8, loc="upper left")
    return save_figure(figure, folder, "phase_response")


def _toe_off(response: PhaseResponse) -> float:
    """Return the unperturbed double stance as a fraction of the stride."""
    return float(response.onset[0] - response.lag[0]) / response.stride_period
