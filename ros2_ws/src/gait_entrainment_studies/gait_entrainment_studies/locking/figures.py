# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The branches of locked gaits as a picture: pulse period against pulse phase."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_entrainment.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    new_figure,
    save_figure,
)
from gait_entrainment_studies.locking.branches import Border, LockedGait, Piece
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait

_COLOURS = {Place.EARLY: ORANGE, Place.INSIDE: BLUE, Place.LATE: GREEN}


def draw_branches(
    gait: PulsedGait, pieces: Sequence[Piece], locks: Sequence[LockedGait], folder: Path
) -> list[Path]:
    """Draw all branches, stable or not, their borders, and the locked gaits at one period."""
    figure, axes = new_figure()
    named: set[object] = set()
    for piece in pieces:
        if not piece.feasible:
            continue
        gaits = gait.along(piece.place)(np.linspace(piece.first.angle, piece.last.angle, 80))
        offsets = (gaits.period - gait.unperturbed_period) * 1e3
        label = None if piece.place in named else piece.place.value
        named.add(piece.place)
        dash, width = ("-", 2.2) if piece.stable else ((0, (2, 2)), 1.2)
        axes.plot(offsets, gaits.lag, color=_COLOURS[piece.place], ls=dash, lw=width, label=label)
        for end in (piece.first, piece.last):
            mark = "o" if end.border.value.startswith("corner") else "D"
            text = "corner" if mark == "o" else end.border.value
            first = text not in named
            named.add(text)
            offset = (end.period - gait.unperturbed_period) * 1e3
            face = "white" if end.border is not Border.NO_GAIT else BLACK
            axes.plot(
                [offset], [end.lag], mark, ms=5, mec=BLACK, mfc=face, label=text if first else None
            )
    for lock in locks:
        offset = (lock.period - gait.unperturbed_period) * 1e3
        mark, text = ("*", "stable lock") if lock.stable else ("x", "unstable lock")
        text += f" at {offset:+g} ms"
        label = None if text in named else text
        named.add(text)
        axes.plot([offset], [lock.lag], mark, color=BLACK, ms=9, ls="none", label=label)
    axes.axhline(0, color=GREY, ls=":", lw=1.0)
    axes.annotate("toe-off", (0, 0), xytext=(4, 3), textcoords="offset points", color=GREY)
    axes.plot([], [], color=GREY, lw=2.2, label="stable")
    axes.plot([], [], color=GREY, lw=1.2, ls=(0, (2, 2)), label="unstable")
    axes.set(
        xlabel=r"pulse period $\tau_p - 2\tau_0$ [ms]",
        ylabel="pulse onset after toe-off [s]",
    )
    axes.set_title(
        f"Locked gaits: pulses of {gait.torque:.2f} N m for {gait.width:g} s", fontsize=11
    )
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save_figure(figure, folder, "locked_gaits")
