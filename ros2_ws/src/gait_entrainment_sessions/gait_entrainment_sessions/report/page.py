# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The page: what it shows of each run and of a study, rendered by the template."""

import math
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import partial
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader

from gait_entrainment.protocol import write_protocol
from gait_entrainment_bags import BagReader
from gait_entrainment_bags.figures import run_figures
from gait_entrainment_bags.recorded_run import RecordedRun, read_run
from gait_entrainment_commands.outcome import outcome_of, summary
from gait_entrainment_sessions.findings import Findings, Rows, StudyFindings, shown, text
from gait_entrainment_sessions.report import figures
from gait_entrainment_sessions.report.checks import Check, checks_of, origin_of, worst
from gait_entrainment_sessions.runs import Place, PlacedRun, places_in, sessions_in
from gait_entrainment_sessions.statistics import Border

_TITLES = {
    "stride_period": "Stride period",
    "phase_lag": "Phase lag",
    "circle": "Phase of the pulses in the stride",
    "pulse_timing": "Timing of the pulses",
    "ankle_torque": "Torque per stride",
}
# With more runs than this, the figures of each would make the page too heavy for a phone.
DRAWN_AT_MOST = 12


@dataclass(frozen=True)
class RunSection:
    """What the page shows of one run."""

    place: Place
    checks: list[Check]
    origin: dict[str, str]
    sealed: bool
    # Empty while the session is sealed.
    findings: list[Findings] = field(default_factory=list)
    protocol: str = ""
    outcome: str = ""
    statistics: list[tuple[str, Rows]] = field(default_factory=list)  # by block of the protocol
    figures: list[tuple[str, str]] = field(default_factory=list)  # title, SVG

    @property
    def state(self) -> str:
        """The worst state of its checks."""
        return worst(self.checks)

    @property
    def title(self) -> str:
        """Person, session and block."""
        place = self.place
        whose = f"{place.person}, session {place.session}, " if place.person else ""
        return f"{whose}{place.block}: {place.name}" if whose else place.name


def write_report(path: Path, out: Path) -> None:
    """
    Write the page about the runs in a folder.

    Raises BagError if there are none or one cannot be read.
    """
    places = places_in(path)
    section = partial(_section, drawn=len(places) <= DRAWN_AT_MOST)
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("fork")) as pool:
        sections = list((pool.map if len(places) > 1 else map)(section, places))
    findings = [finding for section in sections for finding in section.findings]
    study = StudyFindings.of(findings) if len(findings) > 1 else None
    content = {
        "title": sections[0].place.study or path.resolve().name,
        "sections": sections,
        "study": study and study.rows,
        "persons": study.persons if study else (),
        "overview": _overview(findings, study),
        "ledgers": [(folder.path.name, folder.ledger) for folder in sessions_in(path)],
        "made": f"{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC",
        "version": version("gait_entrainment"),
        "border": _border,
        "text": text,
        "drawn_at_most": DRAWN_AT_MOST,
    }
    environment = Environment(
        loader=PackageLoader(__package__, "."), autoescape=True, trim_blocks=True
    )
    page = environment.get_template("page.html").render(content)
    out.write_text(page, encoding="utf-8")


def _section(place: Place, *, drawn: bool) -> RunSection:
    run = read_run(place.bag, torques=drawn and not place.sealed)
    with BagReader(place.bag) as reader:
        checks = checks_of(run, reader, sealed=place.sealed)
        origin = origin_of(reader)
    if place.sealed:
        return RunSection(place, checks, origin, sealed=True)
    findings = Findings.of(PlacedRun(place, run))
    return RunSection(
        place=place,
        checks=checks,
        origin=origin,
        sealed=False,
        findings=findings,
        protocol="not recorded" if run.protocol is None else write_protocol(run.protocol),
        outcome=summary(outcome_of(run)),
        statistics=[(finding.part.name, statistics_of(finding)) for finding in findings],
        figures=_drawn(run, findings) if drawn else [],
    )


def _drawn(run: RecordedRun, findings: list[Findings]) -> list[tuple[str, str]]:
    drawn = [*run_figures(run).items()]
    for finding in findings:
        if finding.part.analysis.pulses:
            name = f": {finding.part.name}" if finding.part.name else ""
            drawn.append((f"circle{name}", figures.draw_circle(finding)))
    salt = f"{findings[0].placed.place.bag}"
    return [
        (title + name.removeprefix(key), figures.svg_of(figure, f"{salt}{number}{name}"))
        for key, title in _TITLES.items()
        for number, (name, figure) in enumerate(drawn)
        if name.startswith(key)
    ]


def _overview(findings: Sequence[Findings], study: StudyFindings | None) -> list[tuple[str, str]]:
    if study is None:
        return []
    drawn = [
        ("Verdicts by pulse period", figures.svg_of(figures.draw_verdicts(findings), "verdicts"))
    ]
    if len(study.phases) > 1:
        svg = figures.svg_of(figures.draw_directions(study), "directions")
        drawn.append(("Mean phase of each person that entrained", svg))
    return drawn


def statistics_of(findings: Findings) -> Rows:
    """Return the statistics of a run, or of a block of its protocol, as text."""
    where, locking = findings.direction, findings.locking
    runs = locking.runs
    lengths = "none"
    if runs:
        lengths = f"{len(runs)}, {sum(runs) / len(runs):.1f} pulses long on average"
    kappa = "above a million" if where.kappa > 1e6 else text(where.kappa, "{:.3g}")
    return [
        (
            "variation of the stride period before the pulses",
            text(findings.variation_percent, "{:.2f} %"),
        ),
        ("slope of the lag, last 10 pulses", shown(findings.slope, "ms per stride", 1e3)),
        (f"mean direction, last {where.count} pulses", text(where.phase, "{:.3f} of the stride")),
        ("resultant length", text(where.resultant, "{:.3f}")),
        ("concentration (von Mises kappa)", kappa),
        ("time constant of the lag's approach", shown(findings.time_constant, "pulses")),
        ("pulses within 5 % of the stride of most of them", text(100 * locking.share, "{:.0f} %")),
        ("spans of such pulses", lengths),
    ]


def _border(border: Border) -> str:
    """Return where entrainment ends on one side, as text."""
    beyond = "no larger one tried" if math.isinf(border.beyond) else f"not at {border.beyond:+.2f}"
    held = f"{border.entrained:+.2f}" if border.entrained else "none"
    odd = "" if border.consistent else "; a smaller one did not entrain"
    return f"{held} ({beyond}{odd})"
