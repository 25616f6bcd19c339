# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figure of the branches of locked gaits: pulse onset after toe-off against pulse period."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BESIDE, BLACK, BLUE, GREEN, GREY, ORANGE
from gait_entrainment_studies.locking.branches import Border, LockedGait, Piece
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait

PLACE_COLOURS = {Place.EARLY: ORANGE, Place.INSIDE: BLUE, Place.LATE: GREEN}


def draw_branches(
    gait: PulsedGait, pieces: Sequence[Piece], locks: Sequence[LockedGait], folder: Path
) -> list[Path]:
    """Draw all branches, stable or not, their borders, and the locked gaits at one period."""
    figure, axes = drawing.new_figure()
    for piece in (piece for piece in pieces if piece.feasible):
        gaits = gait.gaits(piece.place, np.linspace(piece.first.angle, piece.last.angle, 80))
        dash, width = ("-", 2.2) if piece.stable else ((0, (2, 2)), 1.2)
        style = {"color": PLACE_COLOURS[piece.place], "ls": dash, "lw": width}
        offsets = (gaits.period - gait.unperturbed_period) * 1e3
        axes.plot(offsets, gaits.lag, **style, label=piece.place.value)
        for end in (piece.first, piece.last):
            name = end.border.value.partition(":")[0]
            mark = "o" if name == "corner" else "D"
            face = "white" if end.border is not Border.NO_GAIT else BLACK
            offset = (end.period - gait.unperturbed_period) * 1e3
            style = {"ms": 5, "mec": BLACK, "mfc": face, "label": name}
            axes.plot([offset], [end.lag], mark, **style)
    for lock in locks:
        offset = (lock.period - gait.unperturbed_period) * 1e3
        mark, text = ("*", "stable lock") if lock.stable else ("x", "unstable lock")
        style = {"color": BLACK, "ms": 9, "ls": "none"}
        axes.plot([offset], [lock.lag], mark, **style, label=f"{text} at {offset:+g} ms")
    axes.axhline(0, color=GREY, ls=":", lw=1.0)
    axes.annotate("toe-off", (0, 0), xytext=(4, 3), textcoords="offset points", color=GREY)
    axes.plot([], [], color=GREY, lw=2.2, label="stable")
    axes.plot([], [], color=GREY, lw=1.2, ls=(0, (2, 2)), label="unstable")
    axes.set(
        xlabel=r"pulse period $\tau_p - 2\tau_0$ [ms]", ylabel="pulse onset after toe-off [s]"
    )
    axes.set_title(
        f"Locked gaits: pulses of {gait.torque:.2f} N m for {gait.width:g} s", fontsize=11
    )
    drawing.add_legend(axes, **BESIDE)
    return drawing.save_figure(figure, folder, "locked_gaits")
