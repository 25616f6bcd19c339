# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The outcome of an experiment, as one mapping for machines and a few lines for people."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind
from gait_entrainment.gait import Analysis, GaitEvent, Hole, PulsePhase, Reason, Verdict
from gait_entrainment.gait.strides import PLACES
from gait_entrainment.protocol import Protocol, content_of
from gait_entrainment.robot import PulseTiming
from gait_entrainment.run import Run
from gait_entrainment_commands.timing import late_ms, lateness_ms, quantile

# Number of last pulses whose lags give the final one: the paper's locked gait repeats exactly.
FINAL_PULSES = 5
# What a verdict other than entrained, or the reason for claiming nothing, means to a person.
MEANINGS = {
    "drifting": "the pulses drift through the stride",
    "lost": "the gait followed the pulses, then drifted",
    "few_pulses": "neither locked nor drifting for certain: too few pulses yet",
    "hole": "the record has a hole, and too few pulses follow it",
    "unclear": "neither locked nor drifting for certain; more pulses may decide it",
    "creeping": "the lag creeps: a slow passage or an unfinished approach; more pulses will tell",
    "too_close": "pulse period and stride period are too close to tell them apart",
    "baseline_unknown": "fewer than two complete strides to compare with before the first pulse",
    "not_one_to_one": "only pulses at about one per stride are analyzed",
    "by_phase": "pulses by phase follow the gait, whatever it does",
}


def outcome_of(run: Run) -> dict[str, Any]:
    """Return what ``--json`` prints; times in seconds, None for what is unknown."""
    analysis, strides = run.analysis, run.strides
    start = (strides or analysis.strides)[0].start if analysis.strides else 0

    def seconds(stamp: int) -> float:
        return max(stamp - start, 0) / NANOSECONDS_PER_SECOND

    outcome: dict[str, Any] = {
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
            if strides and pulse.onset < strides[-1].end
        ],
        **_judgement(analysis, run.events),
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
    if run.blocks:
        legs = {block.side for block in run.blocks}
        outcome["blocks"] = [
            {
                "name": block.name,
                **({"side": block.side.name.lower()} if len(legs) > 1 else {}),
                "first_stride": block.first_stride,
                "last_stride": block.last_stride,
                "unperturbed_stride_period": block.measured_period,
                "perturbation_period": block.pulse_period,
                "pulses": len(block.analysis.pulses),
                **_judgement(block.analysis, run.events),
            }
            for block in run.blocks
        ]
    cleaned: dict[str, Any] = without_nan(outcome)
    return cleaned


def _judgement(analysis: Analysis, events: Sequence[GaitEvent]) -> dict[str, Any]:
    """Return the last verdict, since when it has held, and where the pulses finally lie."""
    last = analysis.entrainments[-1] if analysis.entrainments else None
    verdict = last.verdict if last else Verdict.UNDECIDED
    reason = last.reason if last else Reason.FEW_PULSES
    entrained = verdict is Verdict.ENTRAINED
    placed = _placed(analysis)
    uncertainty = max((p.phase_lag_uncertainty for p in placed[-FINAL_PULSES:]), default=0.0)
    return {
        "verdict": verdict.name.lower(),
        "reason": reason.name.lower() if reason else None,
        "entrained": entrained,
        "entrained_since_stride": last.entrained_since_stride if last and entrained else None,
        "final_phase_lag": final_phase_lag(analysis),
        **({"final_phase_lag_uncertainty": uncertainty} if uncertainty else {}),
        **({"phase_lag_from": "heel_strike"} if from_strikes(analysis) else {}),
        "double_stance": _double_stance(events, placed[-1].toe_off if placed else None),
    }


def final_phase_lag(analysis: Analysis) -> float:
    """Return the median lag of the last pulses [s]; NaN if none has one."""
    lags = [p.phase_lag for p in _placed(analysis)][-FINAL_PULSES:]
    return statistics.median(lags) if lags else math.nan


def _placed(analysis: Analysis) -> list[PulsePhase]:
    """Return the pulses that have a lag."""
    return [p for p in analysis.pulses if not math.isnan(p.phase_lag)]


def from_strikes(analysis: Analysis) -> bool:
    """Whether lags are measured from heel strikes, since no toe-offs were detected."""
    return any(p.toe_off is None for p in _placed(analysis))


def _parameters(protocol: Protocol) -> dict[str, Any]:
    """Return a protocol with its torque in N m, in whatever unit it was given."""
    parameters = content_of(protocol)
    for plan, block in zip(parameters.get("blocks", [parameters]), protocol.sequence, strict=True):
        plan["pulses"]["torque"] = block.torque(protocol.walker)
    return parameters


def holes_of(run: Run) -> list[Hole]:
    """
    Return what the record of a run lacks, including its last strides, walked or not.

    Between blocks, where nothing is analyzed, a hole is at least one stride of missing events.
    """
    holes, strides = list(run.analysis.holes), run.analysis.strides
    if run.protocol is not None:
        end, number = (strides[-1].end, strides[-1].number) if strides else (0, 0)
        missing = run.protocol.strides - number
        if run.blocks:  # the number of strides is not known in advance
            ended = [block.last_stride for block in run.blocks]
            complete = len(ended) == len(run.protocol.sequence) and ended[-1] is not None
            missing = 0 if complete else max(missing, 1)
        for a, b in pairwise(sorted(run.events, key=lambda event: event.place)):
            known = any(hole.start < b.stamp and a.stamp < hole.end for hole in holes)
            lost = b.place - a.place - 1
            if lost >= PLACES and a.stamp < b.stamp and not known:
                holes.append(Hole(a.stamp, b.stamp, f"{lost} gait events"))
        if missing > 0:
            holes.append(Hole(end, end, f"the last {missing} strides"))
    return holes


def summary(outcome: dict[str, Any]) -> str:
    """Return the outcome in a few lines."""
    parameters = outcome["parameters"] or {}
    plans = parameters.get("blocks", [parameters])
    plan = plans[0].get("pulses") if len(plans) == 1 else None
    strides, pulses = outcome["stride_period"], outcome["pulses"]
    unperturbed = outcome["unperturbed_stride_period"]
    lines = [f"strides          {len(strides)}, pulses placed in them: {len(pulses)}"]
    if plan and len(pulses) != plan["count"]:
        lines[0] += f" of {plan['count']}"
        if strides and not outcome["holes"]:
            lines[0] += "; the train is longer than the run: add washout strides"
    if "blocks" in outcome:
        for number, (block, planned) in enumerate(zip(outcome["blocks"], plans, strict=False), 1):
            lines += _block_lines(number, block, planned)
        return "\n".join([*lines, *_doubt_lines(outcome)])
    if strides:
        measured = "not measured" if unperturbed is None else f"{unperturbed:.4f} s"
        lines.append(f"stride period    {measured} unperturbed, {strides[-1]:.4f} s last")
    if plan and not plan["count"]:
        return "\n".join([*lines, "pulses           none", *_doubt_lines(outcome)])
    if timing := _timing(outcome, plan or {}):
        shape = f"{plan['torque']:.2f} N m for {plan['width']:g} s" if plan else ""
        timing = (timing if plan else timing.lstrip()) + _remarks(plans[0])
        lines.append(f"pulses           {shape}{timing}")
    lines.append(f"verdict          {_verdict(outcome, plan or {})}")
    for stretch in outcome["stretches"][:-1]:
        lines.append(f"  until stride {stretch['last_stride']:<3} {stretch['verdict']}")
    lines += _doubt_lines(outcome)
    lag, double_stance = outcome["final_phase_lag"], outcome["double_stance"]
    if lag is not None and outcome["entrained"]:
        place = _place(lag, double_stance)
        if "phase_lag_from" in outcome:
            place = "from the nearest heel strike, since no toe-off was detected"
        lines.append(f"final phase lag  {lag * 1e3:+.1f} ms: {place}")
    return "\n".join(lines)


def _verdict(judged: dict[str, Any], plan: dict[str, Any]) -> str:
    """Return the verdict and since when it has held, or why nothing is claimed."""
    if judged["entrained"]:
        return f"{judged['verdict']} since stride {judged['entrained_since_stride']}"
    why = judged["reason"] or judged["verdict"]
    if plan.get("phase") is not None and why == "too_close":
        why = "by_phase"
    return f"{judged['verdict']}: {MEANINGS[why]}"


def _block_lines(number: int, block: dict[str, Any], planned: dict[str, Any]) -> list[str]:
    """Return what was done in a block, as ``planned`` in the protocol, and the outcome."""
    plan = planned["pulses"]
    last = block["last_stride"] or "the end"
    line = f"block {number:<11}{block['name']}: strides {block['first_stride']} to {last}"
    if "side" in block:
        line += f" of the {block['side']} leg"
    if not plan["count"]:
        return [f"{line}, no pulses"]
    pulses = f"{block['pulses']} pulses of {plan['torque']:.2f} N m{_timing(block, plan)}"
    return [f"{line}, {pulses}{_remarks(planned)}", f"{'':17}{_verdict(block, plan)}"]


def _remarks(planned: dict[str, Any]) -> str:
    """Return whether the other leg got pulses too, and how many pulses were left out."""
    plan = planned.get("pulses", {})
    left_out = len(set(plan.get("catch_pulses", "").replace(",", " ").split()))
    left_out += round(plan.get("catch_share", 0.0) * plan.get("count", 0))
    other = ", the other leg in between" if planned.get("both_legs") else ""
    return other + (f", {left_out} of them left out" if left_out else "")


def _timing(judged: dict[str, Any], plan: dict[str, Any]) -> str:
    """Return when the pulses of a run or a block came, after a space; empty if unknown."""
    unperturbed, period = judged["unperturbed_stride_period"], judged["perturbation_period"]
    if plan.get("phase") is not None:
        return f" at phase {plan['phase']:g}"
    if period is None:
        return ""
    offset = "" if unperturbed is None else f" ({(period - unperturbed) * 1e3:+.1f} ms)"
    sweep = f", changing by {plan['sweep'] * 1e3:+g} ms" if plan.get("sweep") else ""
    jitter = f", each off by up to {plan['jitter'] * 1e3:g} ms" if plan.get("jitter") else ""
    return f" every {period:.4f} s{offset}{sweep}{jitter}"


def _doubt_lines(outcome: dict[str, Any]) -> list[str]:
    """Return what the record lacks, and which of its gait events are doubtful."""
    lines = []
    if holes := [f"{hole['missing']} at {hole['start']:.1f} s" for hole in outcome["holes"]]:
        more = f", {len(holes) - 3} more" if len(holes) > 3 else ""
        lines.append(f"holes            {', '.join(holes[:3])}{more}: not in the record")
    doubts = [f"{n} {fate}" for fate, n in [*outcome["gait_events"].items()][1:] if n]
    if doubts:
        lines.append(f"gait events      {', '.join(doubts).replace('_', ' ')}")
    return lines


def _place(lag: float, double_stance: float | None) -> str:
    """Return where in the gait cycle a phase lag [s] lies."""
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


def without_nan(value: Any) -> Any:
    """Replace NaN and infinities, which JSON lacks, by None."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def timing_outcome(timings: Sequence[PulseTiming], stride: float) -> dict[str, Any]:
    """Return what ``--json`` prints about the timing of the pulses; ``stride`` is a period [s]."""
    return {
        "sent": distribution(timings, "sent", stride),
        "measured": distribution(timings, "measured", stride),
        "each_ms": [
            {kind: late_ms(timing, kind) for kind in ("sent", "measured")} for timing in timings
        ],
    }


def distribution(
    timings: Sequence[PulseTiming], kind: str, stride: float
) -> dict[str, Any] | None:
    """
    Return how late the "sent" or "measured" onsets came; None if no pulse has one.

    Percentages are of a stride [s]; None if the stride is NaN, that is, unknown.
    """
    late = lateness_ms(timings, kind)
    if not late:
        return None
    figures = {"median": quantile(late, 0.5), "p99": quantile(late, 0.99), "worst": late[-1]}
    unknown = math.isnan(stride)
    return {
        "pulses": len(late),
        "missing": sum(timing.torque != 0 for timing in timings) - len(late),
        **{f"{name}_ms": ms for name, ms in figures.items()},
        **{f"{n}_percent": None if unknown else ms / stride / 10 for n, ms in figures.items()},
    }


def timing_summary(outcome: dict[str, Any]) -> list[str]:
    """Return lines for people; no lines if every pulse came on time."""
    return [f"pulses {kind:<10}{text}" for kind, text in timing_findings(outcome).items()]


def timing_findings(outcome: dict[str, Any]) -> dict[str, str]:
    """Return how late "sent" and "measured" pulses came, without those that came on time."""
    findings = {}
    for kind in ("sent", "measured"):
        figures = outcome[kind]
        if figures is None or not (figures["worst_ms"] or figures["missing"]):
            continue
        missing = f", {figures['missing']} never seen" if figures["missing"] else ""
        percent = figures["worst_percent"]
        share = "" if percent is None else f": {percent:.2f} % of a stride"
        findings[kind] = (
            f"{figures['median_ms']:.1f} ms after their command (median), "
            f"{figures['p99_ms']:.1f} (99 %), {figures['worst_ms']:.1f} (worst{share}){missing}"
        )
    return findings
