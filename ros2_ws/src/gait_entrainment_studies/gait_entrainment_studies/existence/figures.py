# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figure of the stiffness and leg angle for which a period-one gait exists."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BELOW, BLUE, GREY, ORANGE, SKY
from gait_entrainment_studies.existence.stiffness_range import StiffnessRange, switches


def draw_existence(
    ranges: Sequence[StiffnessRange], walker: WalkerParameters, folder: Path
) -> list[Path]:
    """Draw the range of stiffness along the leg angle, and where the walker lies in it."""
    figure, axes = drawing.new_figure()
    corners = switches(walker, ranges)  # between the points of the map, where its lines bend
    ranges = sorted([*ranges, *corners], key=lambda r: r.leg_angle)
    angles = np.degrees([r.leg_angle for r in ranges])
    least = np.array([r.just_vault_over for r in ranges])
    most = np.array([r.just_fly_off for r in ranges])
    axes.fill_between(angles, least, most, where=least < most, color=SKY, alpha=0.35, lw=0)
    axes.plot(angles, least, color=BLUE, lw=1.8, label="just vaults over: below it, falls")
    axes.plot(angles, most, color=ORANGE, ls="--", lw=1.8, label="just flies off: above it, lifts")
    here = np.degrees(walker.leg_angle)
    axes.plot([here], [walker.ankle_stiffness], "*", color="black", ms=11, label="this walker")
    for corner in corners:
        axes.axvline(np.degrees(corner.leg_angle), color=GREY, ls=":", lw=0.8)
    axes.plot([], [], color=GREY, ls=":", lw=0.8, label="another instant decides")
    axes.set(xlabel="leg angle at heel strike [deg]", ylabel="ankle stiffness [N m/rad]", ylim=0)
    axes.set_title("Where a period-one gait exists", fontsize=11)
    drawing.add_legend(axes, **BELOW, ncols=2)
    return drawing.save_figure(figure, folder, "existence")
