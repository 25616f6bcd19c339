# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain cohort: the human study's experiment on simulated subjects."""

import argparse
import csv
import json
import sys
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_entrainment_studies.commands.pulse_options import check_at_least

if TYPE_CHECKING:
    from gait_entrainment_studies.cohort.study import Study, StudyPlan
    from gait_entrainment_studies.cohort.subjects import Subjects

DESCRIPTION = (
    "Draw subjects, give each its own stride-to-stride variability, conduct the experiment on "
    "each at several pulse periods relative to its measured stride period, and judge each "
    "trial as a real one. Off the paper: an extension."
)
EXAMPLES = """examples:
  entrain cohort --out cohort               19 subjects, nine pulse periods
  entrain cohort --subjects 200 --variation 0.01 0
  entrain cohort --slope -0.02 --period-offset -0.05
"""

_OFFSETS = (-0.12, -0.10, -0.08, -0.06, -0.05, -0.04, -0.02, 0.02, 0.05)
_HEADLINE = -0.05


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    numbers = parser.add_argument_group("experiment")
    for option, kind, default, text in (
        ("--subjects", int, 19, "number of subjects"),
        ("--seed", int, 0, "seed of subjects and noise"),
        ("--torque", float, 10.0, "height of the pulses [N m]"),
        ("--width", float, 0.1, "duration of a pulse [s]"),
        ("--pulses", int, 50, "pulses in a trial"),
        ("--initial-phase", float, 0.0, "first pulse, as a fraction of a stride"),
        ("--hurst", float, 0.75, "correlation of the noise: 0.5 white, to below 1"),
        ("--slope", float, 0.0, "rise of the ground [rad], uphill positive"),
        ("--asymmetry", float, 0.0, "excess of the perturbed leg's stiffness, -1 to 1"),
    ):
        numbers.add_argument(
            option,
            type=kind,
            default=default,
            metavar=kind.__name__.upper(),
            help=f"{text}; default {default}",
        )
    numbers.add_argument(
        "--period-offset",
        type=float,
        action="append",
        metavar="FLOAT",
        help="pulse period minus measured stride period [s], may be given again; default "
        + " ".join(map(str, _OFFSETS)),
    )
    drawn = parser.add_argument_group("distributions of the subjects")
    for name, text in (
        ("leg-length", "leg length [m]; default 0.92 0.05"),
        ("mass", "mass [kg]; default 75 12"),
        ("peak-torque", "peak ankle torque over body weight x leg length; default 0.17 0.01"),
        ("variation", "coefficient of variation of the stride period; default 0.02 0.005"),
    ):
        drawn.add_argument("--" + name, nargs=2, type=float, metavar=("MEAN", "SD"), help=text)
    parser.add_argument("--out", type=Path, metavar="DIR", help="write figure and trials.csv")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Draw, conduct, judge, print."""
    from gait_entrainment_studies.cohort.study import StudyPlan, run_study
    from gait_entrainment_studies.cohort.subjects import SubjectDistributions, draw_subjects

    names = [item.name for item in fields(SubjectDistributions)]
    given = {name: tuple(value) for name in names if (value := getattr(options, name))}
    try:
        for name, least in (("subjects", 2), ("pulses", 1), ("seed", 0)):
            check_at_least(name, getattr(options, name), least)
        distributions = SubjectDistributions(**given)
        subjects = draw_subjects(distributions, options.subjects, options.seed)
        plan = StudyPlan(
            torque=options.torque,
            width=options.width,
            period_offsets=tuple(dict.fromkeys(options.period_offset or _OFFSETS)),
            pulses=options.pulses,
            initial_phase=options.initial_phase,
            seed=options.seed,
            hurst=options.hurst,
            slope=options.slope,
            asymmetry=options.asymmetry,
        )
        study = run_study(subjects, plan)
    except ValueError as error:
        print(f"entrain cohort: {error}", file=sys.stderr)
        return 2
    outcome = _outcome(study, subjects, plan, asdict(distributions))
    print(json.dumps(outcome) if options.json else _summary(outcome))
    if options.out is not None:
        from gait_entrainment_studies.cohort.figures import draw_cohort

        paths = draw_cohort(study, options.out)
        paths.append(options.out / "trials.csv")
        with open(paths[-1], "w", newline="") as file:
            writer = csv.DictWriter(file, list(asdict(study.trials[0])))
            writer.writeheader()
            writer.writerows(asdict(trial) for trial in study.trials)
        for path in paths if not options.json else ():
            print(f"written          {path}")
    return 0


def _outcome(
    study: "Study", subjects: "Subjects", plan: "StudyPlan", distributions: dict[str, Any]
) -> dict[str, Any]:
    import numpy as np

    from gait_entrainment_studies.cohort.study import measured_basin_percent, verdicts

    def mean(values: list[float]) -> float | None:
        finite = [value for value in values if np.isfinite(value)]
        return float(np.mean(finite)) if finite else None

    periods = []
    for offset in plan.period_offsets:
        trials = [trial for trial in study.trials if trial.period_offset == offset]
        periods.append(
            {
                "period_offset": offset,
                "verdicts": verdicts(study, offset),
                "fraction_locked": mean([trial.fraction_locked for trial in trials]),
                "mean_run": mean([trial.mean_run for trial in trials]),
                "lag_of_entrained": mean(
                    [trial.median_lag for trial in trials if trial.verdict == "entrained"]
                ),
            }
        )
    anywhere = {trial.subject for trial in study.trials if trial.verdict == "entrained"}
    solved, measured = study.basin_widths, measured_basin_percent(study)
    return {
        "subjects": len(subjects.walkers),
        "redrawn_for_want_of_a_gait": subjects.redrawn,
        "distributions": distributions,
        "plan": asdict(plan),
        "mean_stride_period": mean([trial.measured_period for trial in study.trials]),
        "periods": periods,
        "entrained_at_some_period": len(anywhere),
        "basin_solved_percent": (
            [float(solved.mean()), float(solved.std(ddof=1))] if solved.size else None
        ),
        "basin_ends_percent": study.basins.mean(axis=0).tolist() if solved.size else None,
        "basin_measured_percent": [float(measured.mean()), float(measured.std(ddof=1))],
    }


def _of(found: int, count: int) -> str:
    """Say how many, with the 95 % interval of the share by Wilson's score."""
    from scipy.stats import binomtest

    interval = binomtest(found, count).proportion_ci(method="wilson")
    low, high = 100 * interval.low, 100 * interval.high
    return f"{found} of {count}, 95 % interval {low:.0f} to {high:.0f} %"


def _summary(outcome: dict[str, Any]) -> str:
    count = outcome["subjects"]

    def shown(value: float | None, form: str, factor: float = 1.0) -> str:
        return "-" if value is None else form.format(value * factor)

    lines = [
        f"subjects         {count}, {outcome['redrawn_for_want_of_a_gait']} drawn again for want"
        f" of a gait; measured stride period {shown(outcome['mean_stride_period'], '{:.4f}')} s on"
        " average",
        "",
        "| offset [ms] | verdicts | strides locked* | mean run* | lag of the entrained [ms] |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row in outcome["periods"]:
        found = ", ".join(f"{number} {name}" for name, number in sorted(row["verdicts"].items()))
        lines.append(
            f"| {row['period_offset'] * 1e3:+.0f} | {found} |"
            f" {shown(row['fraction_locked'], '{:.1f} %', 100)} |"
            f" {shown(row['mean_run'], '{:.1f}')} |"
            f" {shown(row['lag_of_entrained'], '{:.1f}', 1e3)} |"
        )
    lines += [
        "",
        "* within 5 % of the stride of the lock without noise; over the subjects that have one",
    ]
    solved, measured = outcome["basin_solved_percent"], outcome["basin_measured_percent"]
    for row in outcome["periods"]:
        if row["period_offset"] == _HEADLINE:
            entrained = row["verdicts"].get("entrained", 0)
            lines += ["", f"entrained at {_HEADLINE * 1e3:+.0f} ms: {_of(entrained, count)}"]
    lines.append(
        f"entrained at some period: {_of(outcome['entrained_at_some_period'], count)}"
        f" (human: {_of(18, 19)})"
    )
    if solved is not None:
        shortest, longest = outcome["basin_ends_percent"]
        lines.append(
            f"basin without noise, solved: {solved[0]:.2f} +/- {solved[1]:.2f} % of the stride,"
            f" from {shortest:+.2f} to {longest:+.2f} % on average (human: 6.7 +/- 3.6 %, to both"
            " sides)"
        )
    lines += [
        f"furthest period found entrained: {measured[0]:.2f} +/- {measured[1]:.2f} %",
        "Fed in: body sizes, peak torque, variability and its correlation, the pulse. Predicted:"
        " who entrains, the locked phase, the mean basin. The spread of the basin is mostly fed"
        " in.",
    ]
    return "\n".join(lines)
