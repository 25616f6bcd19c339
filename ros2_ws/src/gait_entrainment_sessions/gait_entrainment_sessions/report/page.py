# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The page: what is told of each run, of a study, and the template that shows it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader

from gait_entrainment.outcome import outcome_of, summary
from gait_entrainment.protocol import write_protocol
from gait_entrainment_bags.figures import run_figures
from gait_entrainment_bags.recorded_run import RecordedRun, read_run
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.report import figures
from gait_entrainment_sessions.report.checks import Check, checks_of, origin_of, worst
from gait_entrainment_sessions.runs import Place, PlacedRun, places_in, sessions_in
from gait_entrainment_sessions.statistics import Border, Estimate

_TITLES = {
    "stride_period": "Stride period",
    "phase_lag": "Phase lag",
    "circle": "Phase of the pulses in the stride",
    "pulse_timing": "Timing of the pulses",
    "ankle_torque": "Torque per stride",
}
Rows = list[tuple[str, str]]


@dataclass(frozen=True)
class RunSection:
    """What the page tells of one run."""

    place: Place
    checks: list[Check]
    origin: dict[str, str]
    sealed: bool
    # Empty while the session is sealed.
    findings: Findings | None = None
    protocol: str = ""
    outcome: str = ""
    statistics: Rows = field(default_factory=list)
    figures: list[tuple[str, str]] = field(default_factory=list)  # title, SVG

    @property
    def state(self) -> str:
        """The worst state of its checks."""
        return worst(self.checks)

    @property
    def title(self) -> str:
        """Whose and which block it is."""
        whose = f"{self.place.person}, session {self.place.session}: " if self.place.person else ""
        return f"{whose}{self.place.name}"


def write_report(path: Path, out: Path) -> None:
    """
    Write the page about the runs in a folder.

    Raises BagError if there are none or one cannot be read.
    """
    sections = [_section(place) for place in places_in(path)]
    findings = [section.findings for section in sections if section.findings]
    study = StudyFindings.of(findings) if len(findings) > 1 else None
    told = {
        "title": sections[0].place.study or path.resolve().name,
        "sections": sections,
        "study": study and _study_rows(study),
        "persons": study.persons if study else (),
        "overview": _overview(findings, study),
        "ledgers": [(folder.path.name, folder.ledger) for folder in sessions_in(path)],
        "made": f"{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC",
        "version": version("gait_entrainment"),
        "border": _border,
    }
    environment = Environment(
        loader=PackageLoader(__package__, "."), autoescape=True, trim_blocks=True
    )
    page = environment.get_template("page.html").render(told)
    out.write_text(page, encoding="utf-8")


def _section(place: Place) -> RunSection:
    run = read_run(place.bag, torques=not place.sealed)
    checks, origin = checks_of(run, place.bag), origin_of(place.bag)
    if place.sealed:
        return RunSection(place, checks, origin, sealed=True)
    findings = Findings.of(PlacedRun(place, run))
    return RunSection(
        place=place,
        checks=checks,
        origin=origin,
        sealed=False,
        findings=findings,
        protocol="not told" if run.protocol is None else write_protocol(run.protocol),
        outcome=summary(outcome_of(run)),
        statistics=_statistics(findings),
        figures=_drawn(run, findings),
    )


def _drawn(run: RecordedRun, findings: Findings) -> list[tuple[str, str]]:
    drawn = run_figures(run)
    drawn["circle"] = figures.circle(findings)
    salt = f"{findings.placed.place.bag}"
    return [
        (title, figures.svg_of(drawn[name], salt + name))
        for name, title in _TITLES.items()
        if name in drawn
    ]


def _overview(findings: Sequence[Findings], study: StudyFindings | None) -> list[tuple[str, str]]:
    if study is None:
        return []
    drawn = [("Verdicts by pulse period", figures.svg_of(figures.verdicts(findings), "verdicts"))]
    if len(study.phases) > 1:
        svg = figures.svg_of(figures.directions(study), "directions")
        drawn.append(("Mean phase of each person that entrained", svg))
    return drawn


def _statistics(findings: Findings) -> Rows:
    where, locking = findings.direction, findings.locking
    runs = locking.runs
    lengths = "none"
    if runs:
        lengths = f"{len(runs)}, {sum(runs) / len(runs):.1f} pulses long on average"
    kappa = f"{where.kappa:.3g}" if where.kappa < 1e6 else "above a million"
    return [
        ("variation of the stride before the pulses", f"{findings.variation_percent:.2f} %"),
        ("slope of the lag, last 10 pulses", _shown(findings.slope, "ms per stride", 1e3)),
        (f"mean direction, last {where.count} pulses", f"{where.phase:.3f} of the stride"),
        ("resultant length", f"{where.resultant:.3f}"),
        ("concentration (von Mises kappa)", kappa),
        ("time constant of the approach", _shown(findings.time_constant, "pulses")),
        ("pulses within 5 % of the stride of most of them", f"{100 * locking.share:.0f} %"),
        ("spans of such pulses", lengths),
    ]


def _study_rows(study: StudyFindings) -> Rows:
    rayleigh = "-" if math.isnan(study.rayleigh) else f"{study.rayleigh:.2g}"
    return [
        ("persons that entrained in some block", _shown(study.entrained, "%", 100)),
        ("basin found, both sides, mean", _shown(study.basin_mean, "% of the stride")),
        ("its standard deviation over persons", _shown(study.basin_deviation, "% of the stride")),
        ("mean phase over persons", f"{study.direction.phase:.3f} of the stride"),
        ("resultant length over persons", f"{study.direction.resultant:.3f}"),
        ("Rayleigh's p over persons", rayleigh),
    ]


def _shown(estimate: Estimate, unit: str, factor: float = 1.0) -> str:
    value, low, high = (factor * number for number in estimate)
    if math.isnan(value):
        return "cannot be told"
    if math.isnan(low):
        return f"{value:.3g} {unit}"
    return f"{value:.3g} {unit} (95 %: {low:.3g} to {high:.3g})"


def _border(border: Border) -> str:
    """Return where entrainment ends on one side, in words."""
    beyond = "no larger one tried" if math.isinf(border.beyond) else f"not at {border.beyond:+.2f}"
    held = f"{border.entrained:+.2f}" if border.entrained else "none"
    odd = "" if border.consistent else "; a smaller one did not entrain"
    return f"{held} ({beyond}{odd})"
