# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's figures 4 to 8 from our model, in the paper's layout."""

from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.conventions import Side
from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BESIDE, BLACK, COLOURS, DASHES, GREY, ORANGE
from gait_entrainment_studies.locking.branches import branches_of
from gait_entrainment_studies.locking.figures import PLACE_COLOURS
from gait_entrainment_studies.paper.experiments import (
    TABLE_1,
    paper_pulses,
    paper_walk,
    speeds_after_collisions,
    torque_profiles,
)

# Pulse periods drawn in Fig. 5, minus 2 tau_0 [ms].
_ENTRAINED = (-76, -60, -50, -40, -20)
_NOT_ENTRAINED = (-100, -80, 20, 60, 100)


def draw_figures(folder: Path) -> list[Path]:
    """Draw all figures as PNG and SVG into a folder; return their paths."""
    figures = {
        "figure_4": _convergence,
        "figure_5": _entrainment,
        "figure_6b": _phase_locking,
        "figure_7": _torque_profiles,
        "figure_8": _speed_curve,
    }
    paths = []
    for name, draw in figures.items():
        paths += drawing.save_figure(draw(), folder, name)
    return paths


def _convergence() -> Any:
    """Fig. 4: errors of the angular velocity after the collisions."""
    figure, axes = drawing.new_figure()
    fixed, steps = TABLE_1.speed_after_collision, 6
    for factor, colour, dash in zip((1.2, 1.1, 1.05, 0.95, 0.9), COLOURS, DASHES, strict=False):
        speeds = speeds_after_collisions(factor * fixed, steps)
        errors = (np.array([factor * fixed, *speeds]) - fixed) / TABLE_1.leg_length
        # The angle theta falls while the walker advances: the angular velocity is negative.
        label = f"initial error {-errors[0]:+.3f} rad/s"
        axes.plot(range(errors.size), -errors, "o", ls=dash, color=colour, ms=4, label=label)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.set(xlabel="step", ylabel="error of angular velocity [rad/s]")
    axes.set_title("Fig. 4: asymptotic stability of the period-one gait", fontsize=11)
    drawing.add_legend(axes, fontsize=10)
    return figure


def _entrainment() -> Any:
    """Fig. 5: stride period against stride number; entrained on top, the others below."""
    shares = [4.0] + [1.0] * len(_NOT_ENTRAINED)
    figure, (above, *below) = drawing.new_figure(
        len(shares), size=(7.2, 9.0), sharex=True, height_ratios=shares
    )
    period = paper_pulses().unperturbed_period
    panels = [above] * len(_ENTRAINED) + below
    lines = zip(_ENTRAINED + _NOT_ENTRAINED, 2 * COLOURS[:5], 2 * DASHES[:5], strict=True)
    for axes, (offset, colour, dash) in zip(panels, lines, strict=True):
        strides = paper_walk(offset * 1e-3, 0.9, 110).stride_periods[:100]
        label = rf"$\tau_p = 2\tau_0 {offset:+d}$ ms"
        number = np.arange(1, strides.size + 1)
        style = {"ls": dash} if axes is above else {}
        axes.plot(number, strides, color=colour, lw=1.3, label=label, **style)
    for axes in (above, *below):
        axes.set_ylim(period - 0.085, period + 0.004)
        axes.axhline(period, color=GREY, lw=0.8, ls="--")
        drawing.add_legend(axes, **BESIDE)
    above.annotate(
        r"$2\tau_0$", (100, period), textcoords="offset points", xytext=(2, 3), color=GREY
    )
    above.set(ylabel="stride period [s]", title="(a) entrained")
    below[0].set_title("(b) not entrained")
    for axes in below:
        axes.locator_params(axis="y", nbins=3)
    below[len(below) // 2].set_ylabel("stride period [s]")
    below[-1].set_xlabel("stride")
    figure.suptitle("Fig. 5: entrainment with a finite basin", fontsize=11)
    return figure


def _phase_locking() -> Any:
    """Fig. 6b: pulse onset after toe-off, from many initial phases."""
    figure, axes = drawing.new_figure()
    axes.axhline(0, color=GREY, ls="--", lw=1.0)
    axes.annotate("toe-off", (60, 0), textcoords="offset points", xytext=(-40, 4), color=GREY)
    for i, phase in enumerate(np.arange(16) / 16):
        lags = paper_walk(-0.05, float(phase), 62).lags[:61]
        # Break the line where the lag wraps by a stride.
        lags = np.where(np.abs(np.diff(lags, prepend=lags[0])) > 1, np.nan, lags)
        axes.plot(lags, color=COLOURS[i % len(COLOURS)], ls=DASHES[i // 6], lw=1.1)
    axes.set(xlabel="stride", ylabel="pulse onset after toe-off [s]")
    axes.set_title(
        r"Fig. 6b: phase locking at $\tau_p = 2\tau_0 - 50$ ms, 16 initial phases", fontsize=11
    )
    return figure


def _torque_profiles() -> Any:
    """Fig. 7: torque of the trailing ankle, stride by stride."""
    count = 20
    walk = paper_walk(-0.05, 0.86, count + 2)
    figure, axes = drawing.new_figure(size=(7.2, 7.0))
    spacing = 0.62 * TABLE_1.peak_torque
    for number, (time, samples) in enumerate(torque_profiles(walk, 1200)[:count], start=1):
        base = -number * spacing
        ankle = samples.effort[:, 2 + Side.RIGHT]
        delivered = samples.delivered_torque[:, Side.RIGHT]
        idle = np.where((delivered != 0) & (ankle == 0), base + delivered, np.nan)
        intrinsic = samples.intrinsic_torque[:, Side.RIGHT]
        axes.plot(time, base + ankle, color=BLACK, lw=0.9)
        axes.fill_between(
            time, base + intrinsic, base + ankle, where=ankle > intrinsic, color=ORANGE, lw=0
        )
        axes.plot(time, idle, color=ORANGE, lw=1.2, ls=":")
        axes.annotate(
            f"{walk.stride_periods[number - 1]:.4f}",
            (2.02, base),
            color="#C00000",
            fontsize=8,
            va="center",
        )
    axes.set(xlabel="time since heel strike of the perturbed leg [s]", ylabel="stride")
    axes.set_yticks([-n * spacing for n in range(1, count + 1)], range(1, count + 1), fontsize=8)
    axes.set_xlim(0, 2.2)
    axes.plot([0.02, 0.02], [0.2 * spacing, 0.2 * spacing + 100], color=BLACK, lw=2)
    axes.annotate("100 N m", (0.05, 0.2 * spacing + 50), va="center", fontsize=8)
    axes.annotate("stride period [s]", (1.9, 0.2 * spacing), color="#C00000", fontsize=8)
    axes.plot([], [], color=ORANGE, lw=6, label="pulse, acting")
    axes.plot([], [], color=ORANGE, ls=":", label="pulse, without effect")
    drawing.add_legend(axes, loc="upper center", ncols=2)
    title = rf"Fig. 7: ankle torque under pulses every {walk.period:.4f} s ($2\tau_0 - 50$ ms)"
    axes.set_title(title, fontsize=11)
    return figure


def _speed_curve() -> Any:
    """Fig. 8: average speed against the onset of the pulse after the start of double stance."""
    figure, axes = drawing.new_figure()
    for steps, dash, every in ((2, "-", "stride"), (1, "--", "step")):
        gait = paper_pulses(steps_per_pulse=steps)
        slowest = steps * TABLE_1.step_length / gait.unperturbed_period
        for place, first, last, _ in branches_of(gait):
            gaits = gait.gaits(place, np.linspace(first, last, 100))
            speed = steps * TABLE_1.step_length / gaits.period
            axes.plot(gaits.onset, speed, color=PLACE_COLOURS[place], ls=dash, lw=1.8)
        axes.plot([], [], color=BLACK, ls=dash, label=f"pulse in every {every}")
    toe_off = float(gaits.double_stance[-1])
    axes.plot([-0.25, -0.1], [slowest] * 2, color=GREY, lw=1.8)
    axes.plot([toe_off, 0.5], [slowest] * 2, color=GREY, lw=1.8)
    for place, colour in PLACE_COLOURS.items():
        axes.plot([], [], color=colour, lw=3, label=place.value)
    axes.plot([], [], color=GREY, lw=3, label="pulse in swing")
    drawing.mark_instant(axes, 0.0, "start of double stance", 1.027, 0)
    drawing.mark_instant(axes, toe_off, "toe-off", 1.027, 0)
    axes.set(
        xlabel=r"pulse onset $\phi$ after the start of double stance [s]",
        ylabel="average speed [m/s]",
        ylim=(1.025, 1.135),
        xlim=(-0.25, 0.8),
    )
    axes.set_title("Fig. 8: average speed against the phase of the pulse", fontsize=11)
    drawing.add_legend(axes, loc="upper right")
    return figure
