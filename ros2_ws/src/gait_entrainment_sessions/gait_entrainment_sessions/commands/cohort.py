# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain cohort: the human study's experiment, or a session file, on simulated subjects."""

import argparse
import csv
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from gait_entrainment.errors import UsageError
from gait_entrainment.settings import Setting, settings_of
from gait_entrainment_commands import cli
from gait_entrainment_commands.drawing import save_figure
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.rehearsal import rehearse
from gait_entrainment_sessions.report.figures import draw_verdicts
from gait_entrainment_sessions.session_file import read_session
from gait_entrainment_sessions.statistics import share
from gait_entrainment_sessions.tables import write_tables
from gait_entrainment_studies.cohort.figures import draw_cohort
from gait_entrainment_studies.cohort.study import (
    Study,
    StudyPlan,
    measured_basin_percent,
    run_study,
    verdicts,
)
from gait_entrainment_studies.cohort.subjects import SubjectDistributions, Subjects, draw_subjects
from gait_entrainment_studies.locking.roots import Floats
from gait_entrainment_studies.sweep.engine import JOBS, chosen_jobs

DESCRIPTION = (
    "Draw subjects, give each its own stride-to-stride variability, conduct the experiment on "
    "each at several pulse periods relative to its measured stride period, and judge each "
    "trial as a real one. An extension: not in the paper. With a session file, the subjects walk "
    "its blocks instead: a rehearsal of the study, with the results that it would have found."
)
EXAMPLES = """examples:
  entrain cohort --out cohort               19 subjects, nine pulse periods
  entrain cohort --subjects 200 --variation 0.01 0
  entrain cohort --slope -0.02 --period-offset -0.05
  entrain cohort session.yaml --subjects 12 --out rehearsal
"""

_SUBJECTS = Setting("number of subjects", int, least=2, most=10_000)
_PERIOD_OFFSET = Setting("pulse period minus measured stride period", unit="s")
_OFFSETS = ("-0.12", "-0.1", "-0.08", "-0.06", "-0.05", "-0.04", "-0.02", "0.02", "0.05")
_HEADLINE = -0.05


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "session", nargs="?", type=Path, metavar="SESSION.yaml", help="rehearse these blocks"
    )
    cli.add_setting(parser, "jobs", JOBS)
    experiment = parser.add_argument_group("experiment")
    cli.add_setting(experiment, "subjects", _SUBJECTS, "19")
    cli.add_settings(experiment, StudyPlan)
    shown = f"{' '.join(_OFFSETS)}; may be repeated"
    cli.add_setting(experiment, "period_offset", _PERIOD_OFFSET, shown=shown, action="append")
    drawn = parser.add_argument_group("distributions of the subjects")
    for item in fields(SubjectDistributions):
        mean, deviation = getattr(SubjectDistributions, item.name)
        drawn.add_argument(
            "--" + item.name.replace("_", "-"),
            nargs=2,
            type=float,
            default=(mean, deviation),
            metavar=("MEAN", "SD"),
            help=f"{item.metadata['meaning']}; default {mean:g} {deviation:g}",
        )
    cli.add_output_options(parser, "write figure and trials.csv")


def run(options: argparse.Namespace) -> int:
    """Draw, conduct, judge, print."""
    drawn = (tuple(getattr(options, item.name)) for item in fields(SubjectDistributions))
    distributions = SubjectDistributions(*drawn)
    if options.session is not None:
        return _rehearse(options, distributions)
    texts = options.period_offset or _OFFSETS
    offsets = [_PERIOD_OFFSET.parse("period_offset", text) for text in texts]
    plan = cli.chosen(options, StudyPlan, period_offsets=tuple(dict.fromkeys(offsets)))
    count = _SUBJECTS.parse("subjects", options.subjects)
    subjects = draw_subjects(distributions, count, plan.seed)
    study = run_study(subjects, plan)

    def write(folder: Path) -> list[Path]:
        paths = [*draw_cohort(study, folder), folder / "trials.csv"]
        with open(paths[-1], "w", newline="") as file:
            writer = csv.DictWriter(file, list(asdict(study.trials[0])))
            writer.writeheader()
            writer.writerows(asdict(trial) for trial in study.trials)
        return paths

    outcome = _outcome(study, subjects, plan, asdict(distributions))
    return cli.answer(options, outcome, _summary(outcome), write, "written          ")


def _rehearse(options: argparse.Namespace, distributions: SubjectDistributions) -> int:
    given = [name for name in settings_of(StudyPlan) if getattr(options, name) is not None]
    if options.period_offset:
        given.append("period_offset")
    if other := [name for name in given if name not in ("seed", "hurst")]:
        raise UsageError(f"{other[0]}: given by the session file; leave the option out")
    plan = cli.chosen(options, StudyPlan)
    session = read_session(options.session)
    count = _SUBJECTS.parse("subjects", options.subjects)
    subjects = draw_subjects(distributions, count, plan.seed)
    jobs = chosen_jobs(options.jobs)
    rehearsed = rehearse(session, subjects, seed=plan.seed, hurst=plan.hurst, jobs=jobs)
    tqdm.monitor_interval = 0  # no thread: see by_processes
    total = count * len(session.blocks)
    runs = sorted(
        tqdm(rehearsed, total=total, unit="block", disable=None, leave=False),
        key=lambda placed: (placed.place.block, placed.place.person),
    )
    findings = [finding for placed in runs for finding in Findings.of(placed)]
    study = StudyFindings.of(findings)
    blocks: dict[str, Any] = {}
    lines = ["| block | verdicts | pulses locked* |", "| --- | --- | --- |"]
    for name in dict.fromkeys(finding.name for finding in findings):
        own = [finding for finding in findings if finding.name == name]
        verdicts = Counter(finding.verdict for finding in own)
        runs_of = [finding.placed for finding in own]
        fell = len({run.place.person for run in runs_of if getattr(run.run, "ending", None)})
        shares = [f.locking.share for f in own if not np.isnan(f.locking.share)]
        locked = float(np.mean(shares)) if shares else None
        blocks[name] = {"verdicts": dict(verdicts), "locked": locked, "ended_early": fell}
        cell = ", ".join(f"{number} {verdict}" for verdict, number in sorted(verdicts.items()))
        cell += f"; {fell} fell or flew off" if fell else ""
        lines.append(f"| {name} | {cell} | {'-' if locked is None else f'{100 * locked:.0f} %'} |")
    outcome = {"subjects": count, "blocks": blocks, "study": dict(study.rows)}
    lines += [
        "",
        "* within 5 % of the stride of where most of them are; mean over the subjects",
        *(f"{name}: {value}" for name, value in study.rows),
    ]

    def write(folder: Path) -> list[Path]:
        tables = write_tables(runs, folder)
        return [*tables, *save_figure(draw_verdicts(findings), folder, "verdicts")]

    return cli.answer(options, outcome, "\n".join(lines), write, "written          ")


def _outcome(
    study: Study, subjects: Subjects, plan: StudyPlan, distributions: dict[str, Any]
) -> dict[str, Any]:
    def mean(values: Iterable[float]) -> float | None:
        finite = [value for value in values if np.isfinite(value)]
        return float(np.mean(finite)) if finite else None

    periods = []
    for offset in plan.period_offsets:
        trials = [trial for trial in study.trials if trial.period_offset == offset]
        entrained = (trial for trial in trials if trial.verdict == "entrained")
        periods.append(
            {
                "period_offset": offset,
                "verdicts": verdicts(study, offset),
                "fraction_locked": mean(trial.fraction_locked for trial in trials),
                "mean_run": mean(trial.mean_run for trial in trials),
                "lag_of_entrained": mean(trial.median_lag for trial in entrained),
            }
        )
    anywhere = {trial.subject for trial in study.trials if trial.verdict == "entrained"}
    solved, measured = study.basin_widths, measured_basin_percent(study)
    return {
        "subjects": len(subjects.walkers),
        "redrawn_for_want_of_a_gait": subjects.redrawn,
        "distributions": distributions,
        "plan": asdict(plan),
        "mean_stride_period": mean(trial.measured_period for trial in study.trials),
        "periods": periods,
        "entrained_at_some_period": len(anywhere),
        "basin_solved_percent": _spread(solved) if solved.size else None,
        "basin_ends_percent": study.basins.mean(axis=0).tolist() if solved.size else None,
        "basin_measured_percent": _spread(measured),
    }


def _spread(values: Floats) -> list[float]:
    return [float(values.mean()), float(values.std(ddof=1))]


def _of(found: int, count: int) -> str:
    """Return the count with Wilson's 95 % interval of the share."""
    _, low, high = share(found, count)
    return f"{found} of {count}, 95 % interval {100 * low:.0f} to {100 * high:.0f} %"


def _summary(outcome: dict[str, Any]) -> str:
    count = outcome["subjects"]

    def shown(value: float | None, form: str, factor: float = 1.0) -> str:
        return "-" if value is None else form.format(value * factor)

    lines = [
        f"subjects         {count}, {outcome['redrawn_for_want_of_a_gait']} drawn again because"
        " they had no gait; measured stride period"
        f" {shown(outcome['mean_stride_period'], '{:.4f}')} s on average",
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
    lines.append(
        "\n* within 5 % of the stride of the noise-free lock; over the subjects that have one"
    )
    for row in outcome["periods"]:
        if row["period_offset"] == _HEADLINE:
            entrained = row["verdicts"].get("entrained", 0)
            lines.append(f"\nentrained at {_HEADLINE * 1e3:+.0f} ms: {_of(entrained, count)}")
    lines.append(
        f"entrained at some period: {_of(outcome['entrained_at_some_period'], count)}"
        f" (human: {_of(18, 19)})"
    )
    if outcome["basin_solved_percent"] is not None:
        mean, deviation = outcome["basin_solved_percent"]
        shortest, longest = outcome["basin_ends_percent"]
        lines.append(
            f"basin without noise, solved: {mean:.2f} +/- {deviation:.2f} % of the stride,"
            f" from {shortest:+.2f} to {longest:+.2f} % on average (human: 6.7 +/- 3.6 %, on both"
            " sides)"
        )
    mean, deviation = outcome["basin_measured_percent"]
    lines.append(
        f"furthest period found entrained: {mean:.2f} +/- {deviation:.2f} %\n"
        "Inputs: body sizes, peak torque, variability and its correlation, the pulse. Predicted:"
        " who entrains, the locked phase, the mean basin. The spread of the basin comes mostly"
        " from the inputs."
    )
    return "\n".join(lines)
