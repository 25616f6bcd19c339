# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The outcome of an experiment, as one mapping for machines and a few lines for people."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind
from gait_entrainment.gait import Analysis, GaitEvent, Hole, Reason, Stride, Verdict
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import PulseTiming
from gait_entrainment.robot.timing import distribution

# Pulses whose lags make up the final one: the paper's locked gait repeats itself exactly.
FINAL_PULSES = 5
# What a verdict other than entrained, or the reason for claiming nothing, says to a person.
_MEANINGS = {
    "drifting": "the pulses run through the stride",
    "lost": "the gait followed the pulses, then drifted",
    "few_pulses": "neither locked nor drifting for certain: too few pulses yet",
    "hole": "the record has a hole, and too few pulses follow it",
    "unclear": "neither locked nor drifting for certain; more pulses may tell",
    "creeping": "the lag creeps: a slow passage or an unfinished approach; more pulses tell",
    "too_close": "pulse period and stride period are too close to tell them apart",
    "baseline_unknown": "fewer than two complete strides before the first pulse to compare with",
    "not_one_to_one": "only pulses at about one a stride are analyzed",
}


@dataclass(frozen=True)
class Run:
    """What a simulated and a recorded run have in common; stamps are integer nanoseconds."""

    protocol: Protocol | None  # None if nobody told it
    events: tuple[GaitEvent, ...]  # in the order in which they came
    onsets: tuple[int, ...]  # of the pulses
    timings: tuple[PulseTiming, ...]  # commanded, sent and measured onset of each pulse
    measured_period: float  # mean stride period before the pulses [s]; NaN if unknown
    pulse_period: float  # as planned, without a protocol as seen [s]; NaN if unknown
    analysis: Analysis

    @property
    def strides(self) -> list[Stride]:
        """The strides of the protocol, which more may follow; without a protocol, all."""
        last = math.inf if self.protocol is None else self.protocol.strides
        return [stride for stride in self.analysis.strides if stride.number <= last]


def outcome_of(run: Run) -> dict[str, Any]:
    """Return what ``--json`` prints; times in seconds, None for what is not known."""
    analysis, strides = run.analysis, run.strides
    start = strides[0].start if strides else 0
    last = analysis.entrainments[-1] if analysis.entrainments else None
    verdict = last.verdict if last else Verdict.UNDECIDED
    reason = last.reason if last else Reason.FEW_PULSES
    entrained = verdict is Verdict.ENTRAINED
    placed = [p for p in analysis.pulses if p.toe_off is not None]  # the others have no lag
    uncertainty = max((p.phase_lag_uncertainty for p in placed[-FINAL_PULSES:]), default=0.0)

    def seconds(stamp: int) -> float:
        return max(stamp - start, 0) / NANOSECONDS_PER_SECOND

    outcome: dict[str, Any] = _without_nan(
        {
            "unperturbed_stride_period": run.measured_period,
            "perturbation_period": run.pulse_period,
            "stride_period": [stride.period for stride in strides],
            "pulses": [
                {
                    "onset": (pulse.onset - start) / NANOSECONDS_PER_SECOND,
                    "phase": pulse.phase,
                    "phase_lag": pulse.phase_lag,
                }
                for pulse in analysis.pulses
                if strides and pulse.stride <= strides[-1].number
            ],
            "verdict": verdict.name.lower(),
            "reason": reason.name.lower() if reason else None,
            "entrained": entrained,
            "entrained_since_stride": last.entrained_since_stride if last and entrained else None,
            "final_phase_lag": final_phase_lag(analysis),
            **({"final_phase_lag_uncertainty": uncertainty} if uncertainty else {}),
            "double_stance": _double_stance(run.events, placed[-1].toe_off if placed else None),
            "stretches": [
                {"last_stride": e.stride, "verdict": e.verdict.name.lower()}
                for e in {e.stretch: e for e in analysis.entrainments}.values()
            ],
            "holes": [
                {"start": seconds(h.start), "end": seconds(h.end), "missing": h.missing}
                for h in holes_of(run)
            ],
            "gait_events": asdict(analysis.event_counts),
            "parameters": run.protocol and _parameters(run.protocol),
        }
    )
    return outcome


def final_phase_lag(analysis: Analysis) -> float:
    """Return the median lag of the last pulses [s]; NaN if none has one."""
    lags = [p.phase_lag for p in analysis.pulses if p.toe_off is not None][-FINAL_PULSES:]
    return statistics.median(lags) if lags else math.nan


def _parameters(protocol: Protocol) -> dict[str, Any]:
    """Return a protocol with its side as a word and its torque in N m, however it was given."""
    parameters = asdict(protocol)
    parameters["side"] = protocol.side.name.lower()
    parameters["pulses"]["torque"] = protocol.pulse_torque
    if not protocol.variation.coefficient:
        del parameters["variation"]  # the paper's walker
    return parameters


def holes_of(run: Run) -> list[Hole]:
    """Return what the record of a run lacks; its last strides too, whether walked or not."""
    holes, strides = list(run.analysis.holes), run.analysis.strides
    if strides and run.protocol is not None:
        end = strides[-1].end
        if (missing := run.protocol.strides - strides[-1].number) > 0:
            holes.append(Hole(end, end, f"the last {missing} strides"))
    return holes


def summary(outcome: dict[str, Any]) -> str:
    """Return the outcome in a few lines."""
    plan = outcome["parameters"] and outcome["parameters"]["pulses"]
    strides, pulses = outcome["stride_period"], outcome["pulses"]
    unperturbed, period = outcome["unperturbed_stride_period"], outcome["perturbation_period"]
    lines = [f"strides          {len(strides)}, pulses placed in them: {len(pulses)}"]
    if plan and len(pulses) != plan["count"]:
        lines[0] += f" of {plan['count']}"
        if not outcome["holes"]:
            lines[0] += "; the train is longer than the run: add washout strides"
    if strides:
        measured = "not measured" if unperturbed is None else f"{unperturbed:.4f} s"
        lines.append(f"stride period    {measured} unperturbed, {strides[-1]:.4f} s last")
    if period is not None:
        shape = f"{plan['torque']:.2f} N m for {plan['width']:g} s " if plan else ""
        offset = "" if unperturbed is None else f" ({(period - unperturbed) * 1e3:+.1f} ms)"
        lines.append(f"pulses           {shape}every {period:.4f} s{offset}")
    verdict = outcome["verdict"]
    if outcome["entrained"]:
        verdict += f" since stride {outcome['entrained_since_stride']}"
    else:
        verdict += f": {_MEANINGS[outcome['reason'] or verdict]}"
    lines.append(f"verdict          {verdict}")
    for stretch in outcome["stretches"][:-1]:
        lines.append(f"  until stride {stretch['last_stride']:<3} {stretch['verdict']}")
    if holes := [f"{hole['missing']} at {hole['start']:.1f} s" for hole in outcome["holes"]]:
        more = f", {len(holes) - 3} more" if len(holes) > 3 else ""
        lines.append(f"holes            {', '.join(holes[:3])}{more}: not in the record")
    doubts = [f"{n} {fate}" for fate, n in [*outcome["gait_events"].items()][1:] if n]
    if doubts:
        lines.append(f"gait events      {', '.join(doubts).replace('_', ' ')}")
    lag, double_stance = outcome["final_phase_lag"], outcome["double_stance"]
    if lag is not None and outcome["entrained"]:
        lines.append(f"final phase lag  {lag * 1e3:+.1f} ms: {_place(lag, double_stance)}")
    return "\n".join(lines)


def _place(lag: float, double_stance: float | None) -> str:
    """Say where in the gait cycle a phase lag [s] lies."""
    if lag >= 0:
        return "after toe-off"
    if double_stance is None or -lag > double_stance:
        return "before double stance"
    percent = 100 * (1 + lag / double_stance)
    return f"the pulse begins {percent:.0f} % into double stance ({double_stance:.3f} s)"


def _double_stance(events: Sequence[GaitEvent], toe_off: int | None) -> float:
    """Return the duration [s] of the double stance that a toe-off ends; NaN if unknown."""
    if toe_off is None:
        return math.nan
    strikes = [e.stamp for e in events if e.kind is EventKind.HEEL_STRIKE and e.stamp < toe_off]
    return (toe_off - max(strikes)) / NANOSECONDS_PER_SECOND if strikes else math.nan


def _without_nan(value: Any) -> Any:
    """Replace NaN, which JSON does not have, by None."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def timing_outcome(timings: Sequence[PulseTiming], stride: float) -> dict[str, Any]:
    """Return what ``--json`` prints about the timing of the pulses; ``stride`` is a period [s]."""
    return {
        "sent": distribution(timings, "sent", stride),
        "measured": distribution(timings, "measured", stride),
        "each_ms": [
            {kind: timing.late_ms(kind) for kind in ("sent", "measured")} for timing in timings
        ],
    }


def timing_summary(outcome: dict[str, Any]) -> list[str]:
    """Return lines for people; none if every pulse came at its instant."""
    lines = []
    for kind in ("sent", "measured"):
        figures = outcome[kind]
        if figures is None or not (figures["worst_ms"] or figures["missing"]):
            continue
        missing = f", {figures['missing']} never seen" if figures["missing"] else ""
        percent = figures["worst_percent"]
        share = "" if percent is None else f": {percent:.2f} % of a stride"
        lines.append(
            f"pulses {kind:<10}{figures['median_ms']:.1f} ms after their command (median), "
            f"{figures['p99_ms']:.1f} (99 %), {figures['worst_ms']:.1f} (worst{share}){missing}"
        )
    return lines
