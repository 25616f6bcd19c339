# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of one run: stride period, phase lag, timing of the pulses, ankle torque by stride."""

from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.drawing import BLUE, GREEN, GREY, ORANGE, new_figure
from gait_entrainment.outcome import holes_of
from gait_entrainment.robot.timing import distribution, lateness_ms
from gait_entrainment_bags.recorded_run import RecordedRun, drawn_strides

_WIDTH, _HEIGHT = 7.2, 3.6  # [inch]
_DOTTED_LINE = {"color": BLUE, "marker": ".", "lw": 0.8}


def draw_figures(run: RecordedRun, folder: Path) -> list[Path]:
    """Draw the figures of a run as PNG files into a folder; return their paths."""
    figures = {
        "stride_period.png": _stride_period(run),
        "phase_lag.png": _phase_lag(run),
        "pulse_timing.png": _pulse_timing(run),
        "ankle_torque.png": _ankle_torque(run),
    }
    for name, figure in figures.items():
        figure.savefig(folder / name, dpi=130)
    return [folder / name for name in figures]


def _new_figure(
    height: float = _HEIGHT, *, right: float = 0.15, top: float = 0.4, bottom: float = 0.55
) -> tuple[Any, Any]:
    """Return a figure and its axes; fitting the margins [inch] would take as long as to draw."""
    figure, axes = new_figure(size=(_WIDTH, height), layout=None)
    figure.subplots_adjust(
        left=0.8 / _WIDTH, right=1 - right / _WIDTH, bottom=bottom / height, top=1 - top / height
    )
    return figure, axes


def _stride_period(run: RecordedRun) -> Any:
    figure, axes = _new_figure()
    if given := [pulse.stride for pulse in run.analysis.pulses]:
        span = min(given) - 0.5, max(given) + 0.5
        axes.axvspan(*span, color=ORANGE, alpha=0.10, lw=0, label="pulses")
    for period, text, colour, style in (
        (run.measured_period, "unperturbed", GREY, "--"),
        (run.pulse_period, "pulse period", ORANGE, "-."),
    ):
        if np.isfinite(period):
            axes.axhline(period, color=colour, ls=style, lw=1.2, label=f"{text} {period:.4f} s")
    periods = {s.number: s.period for s in run.strides}
    numbers = range(1, max(periods, default=0) + 1)
    axes.plot(numbers, [periods.get(number, np.nan) for number in numbers], **_DOTTED_LINE)
    _shade_holes(axes, run)
    axes.set(xlabel="stride", ylabel="stride period [s]", title="Stride period")
    axes.ticklabel_format(useOffset=False)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False)
    return figure


def _phase_lag(run: RecordedRun) -> Any:
    figure, axes = _new_figure()
    axes.axhline(0, color=GREY, ls="--", lw=1.2, label="toe-off: end of double stance")
    pulses = {pulse.number: pulse for pulse in run.analysis.pulses}
    points = [
        (pulses[number].stride, pulses[number].phase_lag * 1e3)
        if number in pulses
        else (np.nan, np.nan)  # no line across a hole
        for number in range(1, max(pulses, default=0) + 1)
    ]
    axes.plot(*np.array(points).reshape(-1, 2).T, label="pulse onset", **_DOTTED_LINE)
    _shade_holes(axes, run)
    last = run.analysis.entrainments[-1] if run.analysis.entrainments else None
    if last is not None and (since := last.entrained_since_stride):
        label = f"near its final lag since stride {since}"
        axes.axvline(since, color=GREEN, lw=1.2, label=label)
    axes.set(xlabel="stride", ylabel="onset minus toe-off [ms]", title="Phase lag of the pulses")
    axes.legend(frameon=False)
    return figure


def _shade_holes(axes: Any, run: RecordedRun) -> None:
    """Shade the strides of which the record lacks something."""
    strides = run.analysis.strides
    for place, hole in enumerate(holes_of(run)):
        before = max((s.number for s in strides if s.end <= hole.start), default=0)
        after = min((s.number for s in strides if s.start >= hole.end), default=before + 2)
        label = None if place else "not in the record"
        axes.axvspan(before + 0.5, after - 0.5, color=GREY, alpha=0.25, lw=0, label=label)


def _pulse_timing(run: RecordedRun) -> Any:
    """Draw which share of the pulses was sent, and was measured, by how late at most."""
    figure, axes = _new_figure(_HEIGHT + 0.7, top=0.9, bottom=1.15)
    for kind, colour, style in (("sent", ORANGE, "--"), ("measured", BLUE, "-")):
        late = distribution(run.timings, kind, run.measured_period)
        if late is None:
            continue
        missing = f"; {late['missing']} never seen" if late["missing"] else ""
        label = (
            f"{kind}: median {late['median_ms']:.1f}, 99 % {late['p99_ms']:.1f}, "
            f"worst {late['worst_ms']:.1f} ms{missing}"
        )
        axes.ecdf(lateness_ms(run.timings, kind), color=colour, ls=style, label=label)
    axes.set(
        xlabel="onset after its command [ms]",
        ylabel="share of the pulses",
        ylim=(0, 1.02),
        title=f"Timing of {len(run.timings)} pulses",
    )
    if np.isfinite(run.measured_period):
        percent = 10 * run.measured_period  # [ms]
        scales = (lambda ms: ms / percent, lambda share: share * percent)
        axes.secondary_xaxis("top", functions=scales).set_xlabel("[% of the unperturbed stride]")
    if axes.get_legend_handles_labels()[0]:
        axes.axvline(0, color=GREY, lw=1.2)  # so that the command is in view
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), frameon=False)
    return figure


def _ankle_torque(run: RecordedRun) -> Any:
    """Draw one line of ankle torque per stride, from the other leg's heel strike on, as Fig. 7."""
    rows = drawn_strides(run)
    figure, axes = _new_figure(2 + 0.28 * len(rows), right=0.7)
    torques = run.torques
    peak = torques.intrinsic.max(initial=1.0)
    scale = 0.9 / peak
    longest = 0.0
    for row, stride in enumerate(rows):
        inside = (torques.stamps >= stride.start) & (torques.stamps < stride.end)
        time = (torques.stamps[inside] - stride.start) / NANOSECONDS_PER_SECOND
        longest = max(longest, stride.period)
        own = torques.intrinsic[inside] * scale
        whole = own + torques.effective[inside] * scale
        delivered = torques.delivered[inside] != 0
        axes.fill_between(time, row, row - own, color=BLUE, alpha=0.35, lw=0)
        axes.fill_between(time, row - own, row - whole, color=ORANGE, lw=0)
        axes.plot(time, row - whole, color=BLUE, lw=0.6)
        axes.plot(time[delivered], np.full(delivered.sum(), row + 0.12), "s", ms=1.5, color=ORANGE)
        axes.text(longest * 1.01, row, f"{stride.period:.4f} s", fontsize=7, va="bottom")
    axes.text(longest * 1.01, -0.85, "stride period", fontsize=7)
    axes.set_yticks(range(len(rows)), [str(s.number) for s in rows], fontsize=7)
    axes.invert_yaxis()
    axes.set_ylim(len(rows) - 0.5, -1.1)
    axes.set(
        xlabel="time since heel strike of the perturbed leg [s]",
        ylabel="stride",
        title=f"Ankle torque: own push-off (blue, peak {peak:.0f} N m), "
        "pulse that acts (orange), pulse delivered (bar)",
    )
    axes.title.set_fontsize(9)
    return figure
