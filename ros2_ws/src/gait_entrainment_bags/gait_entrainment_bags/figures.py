# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of one run: stride period, phase lag, timing of the pulses, ankle torque by stride."""

import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind
from gait_entrainment.gait import Analysis, Verdict
from gait_entrainment.run import JudgedBlock
from gait_entrainment_bags.recorded_run import RecordedRun, drawn_strides
from gait_entrainment_commands import drawing
from gait_entrainment_commands.drawing import BLACK, BLUE, GREEN, GREY, ORANGE
from gait_entrainment_commands.outcome import (
    distribution,
    from_strikes,
    holes_of,
    timing_outcome,
    timing_summary,
)
from gait_entrainment_commands.timing import lateness_ms

_WIDTH, _HEIGHT = 7.2, 3.6  # [inch]
_LETTERS = 100  # in a line below the title
_DOTTED_LINE = {"color": BLUE, "marker": ".", "lw": 0.8}


def run_figures(run: RecordedRun) -> dict[str, Any]:
    """
    Return the figures of a run by name.

    If all pulses begin at their command, there is no figure of their timing.
    """
    figures = {"stride_period": _stride_period(run), "phase_lag": _phase_lag(run)}
    if timing_summary(timing_outcome(run.timings, run.measured_period)):
        figures["pulse_timing"] = _pulse_timing(run)
    figures["ankle_torque"] = _ankle_torque(run)
    return figures


def draw_figures(run: RecordedRun, folder: Path) -> list[Path]:
    """Draw the figures of a run as PNG and SVG files into a folder; return their paths."""
    drawn = run_figures(run).items()
    return [path for name, figure in drawn for path in drawing.save_figure(figure, folder, name)]


def _new_figure(
    run: RecordedRun, title: str, height: float = _HEIGHT, *, right: float = 0.15, top: float = 0.6
) -> tuple[Any, Any]:
    """Return a figure and its axes; fixed margins [inch], as fitting them doubles the time."""
    figure, axes = drawing.new_figure(size=(_WIDTH, height), layout=None)
    figure.subplots_adjust(
        left=0.8 / _WIDTH, right=1 - right / _WIDTH, bottom=0.9 / height, top=1 - top / height
    )
    about = run.name if run.protocol is None else f"{run.name}, {run.protocol.driver}"
    verdicts = []
    for name, part in _parts(run):
        if last := part.entrainments[-1:]:
            verdicts.append(f"{name} {last[0].verdict.name.lower()}".strip())
            if last[0].verdict is Verdict.ENTRAINED:
                verdicts[-1] += f" since stride {last[0].entrained_since_stride}"
    if verdicts:
        about += f": {', '.join(verdicts)}"
    about = "\n".join(textwrap.wrap(about, _LETTERS, max_lines=2, placeholder=" ..."))
    place = {"x": 0.8 / _WIDTH, "ha": "left", "va": "top"}
    figure.text(s=title, y=1 - 0.08 / height, fontsize=11, **place)
    figure.text(s=about, y=1 - 0.3 / height, fontsize=8, color=GREY, **place)
    return figure, axes


def _parts(run: RecordedRun) -> list[tuple[str, Analysis]]:
    """Return the name and analysis of each block, or of the whole run if it has no blocks."""
    return [(block.name, block.analysis) for block in run.blocks] or [("", run.analysis)]


def _add_legend_below(figure: Any, axes: Any) -> None:
    """Add the legend at the bottom of the figure, where it hides nothing."""
    place = {"bbox_to_anchor": (0.5, 0), "bbox_transform": figure.transFigure, "ncols": 4}
    drawing.add_legend(axes, loc="lower center", **place)


def _add_percent(run: RecordedRun, add_axis: Any, place: str) -> None:
    """Add a scale in percent of the unperturbed stride to one in ms, if that stride is known."""
    if np.isfinite(run.measured_period):
        percent = 10 * run.measured_period  # [ms]
        scales = (lambda ms: ms / percent, lambda share: share * percent)
        add_axis(place, functions=scales).set(
            **{"xlabel" if place == "top" else "ylabel": "[% of the unperturbed stride]"}
        )


def _stride_period(run: RecordedRun) -> Any:
    figure, axes = _new_figure(run, "Stride period")
    # Each block has its own periods; those of a run without blocks apply throughout.
    for part in run.blocks or [run]:
        line = {"color": GREY, "ls": "--", "lw": 1.2}
        if isinstance(part, JudgedBlock):
            strides = part.first_stride, part.last_stride or part.first_stride
            axes.plot(strides, [part.measured_period] * 2, label="unperturbed", **line)
        elif np.isfinite(period := part.measured_period):
            axes.axhline(period, label=f"unperturbed {period:.4f} s", **line)
        if not (pulses := part.analysis.pulses):
            continue
        span = pulses[0].stride - 0.5, pulses[-1].stride + 0.5
        axes.axvspan(*span, color=ORANGE, alpha=0.10, lw=0, label="pulses")
        found = np.array([(p.number, p.stride, p.onset) for p in pulses], np.int64)
        count, strides, elapsed = np.diff(found, axis=0).T
        # No interval across a pause, nor for pulses by phase, which follow the strides.
        follows = (strides <= 4 * count) & np.isfinite(part.pulse_period)
        intervals = np.where(follows, elapsed / count / NANOSECONDS_PER_SECOND, np.nan)
        line = {"color": ORANGE, "ls": "-.", "lw": 1.2}
        if follows.any():
            axes.plot(found[1:, 1], intervals, label="pulse period", **line)
    periods = {s.number: s.period for s in run.strides}
    numbers = range(1, max(periods, default=0) + 1)
    axes.plot(numbers, [periods.get(number, np.nan) for number in numbers], **_DOTTED_LINE)
    axes.set(ylabel="stride period [s]")
    axes.ticklabel_format(useOffset=False)
    _over_strides(figure, axes, run, 0.01)
    return figure


def _phase_lag(run: RecordedRun) -> Any:
    """Draw each lag at its pulse's place in the walk, with the double stance that it refers to."""
    figure, axes = _new_figure(run, "Phase lag of the pulses", right=0.8)
    strikes = np.sort([e.stamp for e in run.events if e.kind is EventKind.HEEL_STRIKE])
    rows: list[tuple[float, float, float]] = []  # place, lag and double stance [ms]
    latest = None
    for pulse in run.analysis.pulses:
        stance = np.nan
        if pulse.toe_off is not None and (before := np.searchsorted(strikes, pulse.toe_off)):
            stance = (pulse.toe_off - strikes[before - 1]) / 1e6
        place, lag = pulse.stride + pulse.phase, pulse.phase_lag
        # No line across a hole or a pause, nor from one end of the stride to the other.
        if latest and (pulse.number > latest.number + 1 or pulse.stride > latest.stride + 4):
            rows.append((np.nan, np.nan, np.nan))
        elif latest and abs(lag - latest.phase_lag) > 0.5 * run.measured_period:
            rows.append((place, np.nan, stance))
        rows.append((place, lag * 1e3, stance))
        latest = pulse
    places, lags, stances = np.array(rows).reshape(-1, 3).T
    shade = {"color": BLUE, "alpha": 0.15, "lw": 0, "label": "double stance"}
    axes.fill_between(places, -stances, 0, **shade)
    zero = "heel strike" if from_strikes(run.analysis) else "toe-off"
    axes.axhline(0, color=GREY, ls="--", lw=1.2, label=zero)
    axes.plot(places, lags, label="pulse onset", **_DOTTED_LINE)
    for last in (entrainment for _, part in _parts(run) for entrainment in part.entrainments[-1:]):
        if since := last.entrained_since_stride:
            axes.axvline(since, color=GREEN, lw=1.2, label="near its final lag from here on")
    axes.set(ylabel=f"onset minus {zero} [ms]")
    _add_percent(run, axes.secondary_yaxis, "right")
    _over_strides(figure, axes, run, 20.0)
    return figure


def _over_strides(figure: Any, axes: Any, run: RecordedRun, least: float) -> None:
    """Shade strides with holes, set a range of at least ``least``, add labels and a legend."""
    strides, shaded = run.analysis.strides, set[int]()
    for hole in holes_of(run):
        before = max((s.number for s in strides if s.end <= hole.start), default=0)
        after = min((s.number for s in strides if s.start >= hole.end), default=before + 2)
        shaded |= set(range(before + 1, after))
    for number in shaded:
        span = number - 0.5, number + 0.5
        axes.axvspan(*span, color=GREY, alpha=0.25, lw=0, label="not in the record")
    low, high = axes.get_ylim()
    spare = max(least - (high - low), 0) / 2
    axes.set(xlabel="stride", ylim=(low - spare, high + spare))
    axes.xaxis.get_major_locator().set_params(integer=True)
    _add_legend_below(figure, axes)


def _pulse_timing(run: RecordedRun) -> Any:
    """Draw the distribution of how late pulses were sent, and were measured."""
    title = f"Timing of {len(run.timings)} pulses"
    figure, axes = _new_figure(run, title, _HEIGHT + 0.7, top=1.1)
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
    axes.set(xlabel="onset after its command [ms]", ylabel="share of the pulses", ylim=(0, 1.02))
    _add_percent(run, axes.secondary_xaxis, "top")
    axes.axvline(0, color=GREY, lw=1.2)  # keeps the command in view
    _add_legend_below(figure, axes)
    return figure


def _ankle_torque(run: RecordedRun) -> Any:
    """Draw one line of ankle torque per stride, from its heel strike on, as in Fig. 7."""
    rows = drawn_strides(run)
    figure, axes = _new_figure(
        run, "Ankle torque stride by stride", 2.2 + 0.24 * len(rows), right=0.7
    )
    torques = run.torques
    peak = float(np.max(torques.intrinsic, initial=1.0, where=np.isfinite(torques.intrinsic)))
    scale = 0.9 / peak
    longest = max((stride.period for stride in rows), default=1.0)
    for row, stride in enumerate(rows):
        inside = (torques.stamps >= stride.start) & (torques.stamps < stride.end)
        time = (torques.stamps[inside] - stride.start) / NANOSECONDS_PER_SECOND
        own = torques.intrinsic[inside] * scale
        total = own + torques.effective[inside] * scale
        bar = np.where(torques.delivered[inside] != 0, row + 0.12, np.nan)
        filled = {"color": BLUE, "alpha": 0.35, "lw": 0, "label": "own push-off"}
        axes.fill_between(time, row, row - own, **filled)
        filled = {"color": ORANGE, "lw": 0, "label": "pulse that acts"}
        axes.fill_between(time, row - own, row - total, **filled)
        axes.plot(time, row - total, color=BLUE, lw=0.6)
        axes.plot(time, bar, color=ORANGE, lw=2, solid_capstyle="butt", label="pulse delivered")
        axes.text(longest * 1.02, row, f"{stride.period:.4f} s", fontsize=7, va="bottom")
    axes.text(longest * 1.02, -0.85, "stride period", fontsize=7)
    height = 10 ** np.floor(np.log10(peak))  # of the scale [N m]
    axes.plot([0, 0], [0, -height * scale], color=BLACK, lw=2, solid_capstyle="butt")
    axes.text(0.01 * longest, -0.5 * height * scale, f"{height:g} N m", fontsize=7, va="center")
    axes.set_yticks(range(len(rows)), [str(s.number) for s in rows], fontsize=7)
    axes.set_ylim(len(rows) - 0.5, -1.1)
    axes.set(xlabel="time since heel strike of the perturbed leg [s]", ylabel="stride")
    _add_legend_below(figure, axes)
    return figure
