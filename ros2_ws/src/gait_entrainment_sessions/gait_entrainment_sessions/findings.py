# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The statistics of one run, and of all runs of a study."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gait_entrainment.gait import Verdict
from gait_entrainment.run import JudgedBlock
from gait_entrainment_commands.outcome import holes_of
from gait_entrainment_sessions import statistics
from gait_entrainment_sessions.runs import PlacedRun
from gait_entrainment_sessions.statistics import Border, Direction, Estimate, Locking

Rows = list[tuple[str, str]]  # name and value, as text


@dataclass(frozen=True)
class Findings:
    """The statistics of one run, or of one block of its protocol if it has several."""

    placed: PlacedRun
    part: JudgedBlock
    variation_percent: float  # of the strides before the pulses
    slope: Estimate  # [s per stride]
    direction: Direction
    time_constant: Estimate  # [pulses]
    locking: Locking
    holes: int

    @classmethod
    def of(cls, placed: PlacedRun) -> list["Findings"]:
        """Compute the findings for each block of the protocol."""
        return [cls._of_part(placed, part) for part in placed.parts]

    @classmethod
    def _of_part(cls, placed: PlacedRun, part: JudgedBlock) -> "Findings":
        run, begin = placed.run, part.first_stride
        pulses = statistics.last_pulses(part.analysis)
        final = pulses[-statistics.SLOPE_PULSES :]
        first = min((p.stride for p in part.analysis.pulses), default=math.inf)
        strides = [s for s in part.analysis.strides if s.end <= part.end]
        baseline = [s.period for s in strides if begin <= s.number < first]
        variation = math.nan
        if len(baseline) > 1:
            variation = 100 * float(np.std(baseline, ddof=1) / np.mean(baseline))
        return cls(
            placed=placed,
            part=part,
            variation_percent=variation,
            slope=statistics.slope([p.stride for p in final], [p.unwrapped_lag for p in final]),
            direction=statistics.direction(
                [p.phase for p in pulses[-statistics.DIRECTION_PULSES :]]
            ),
            time_constant=statistics.convergence(
                [p.number for p in pulses], [p.unwrapped_lag for p in pulses]
            ),
            locking=statistics.locking(pulses, part.measured_period),
            holes=len(holes_of(run)),
        )

    @property
    def name(self) -> str:
        """Name of the session's block, and of the protocol's block if there are several."""
        name = self.placed.place.name
        return f"{name}: {self.part.name}" if self.part.name else name

    @property
    def torque(self) -> float:
        """Largest magnitude of the pulses' torque [N m]; NaN if they were not announced."""
        heights = (self.placed.timings[p.onset].torque for p in self.part.analysis.pulses)
        return max(map(abs, heights), default=0.0)

    @property
    def verdict(self) -> str:
        """The verdict at the end."""
        found = self.part.analysis.entrainments[-1:]
        return (found[0].verdict if found else Verdict.UNDECIDED).name.lower()

    @property
    def offset_percent(self) -> float:
        """Pulse period minus stride period, in percent of the latter; NaN if unknown."""
        return 100 * (self.part.pulse_period / self.part.measured_period - 1)

    @property
    def row(self) -> tuple[Any, ...]:
        """The cells of its row in the table of blocks."""
        part, runs = self.part, self.locking.runs
        return (
            part.name or None,
            self.verdict,
            part.measured_period,
            part.pulse_period,
            self.offset_percent,
            self.variation_percent,
            *self.slope,
            self.direction.phase,
            self.direction.resultant,
            self.direction.kappa,
            *self.time_constant,
            self.locking.share,
            float(np.mean(runs)) if runs else math.nan,
            self.holes,
        )


@dataclass(frozen=True)
class PersonFindings:
    """Where entrainment ends for one person."""

    person: str
    faster: Border
    slower: Border
    entrained: int  # blocks
    testable: int  # blocks in which a verdict was reached

    @property
    def basin_percent(self) -> float:
        """Width found, both sides together; the basin may be wider."""
        return self.slower.entrained - self.faster.entrained


@dataclass(frozen=True)
class StudyFindings:
    """The findings over the blocks of all persons."""

    persons: tuple[PersonFindings, ...]
    entrained: Estimate  # share of the persons who entrained in at least one block
    basin_mean: Estimate  # [% of the stride]
    basin_deviation: Estimate
    phases: tuple[float, ...]  # mean phase of each person's entrained blocks
    direction: Direction  # of these
    rayleigh: float  # p-value of there being no common direction

    @classmethod
    def of(cls, findings: Sequence[Findings]) -> "StudyFindings":
        """Combine the findings of all runs."""
        by_person = defaultdict[str, list[Findings]](list)
        for finding in findings:
            by_person[finding.placed.place.person].append(finding)
        persons, phases = [], []
        for code, own in by_person.items():
            # A basin belongs to one pulse height: lower pulses, such as a sham's, are left out.
            least = 0.99 * max(f.torque for f in own)
            offsets = [(f.offset_percent, f.verdict) for f in own if not f.torque < least]
            held = [f for f in own if f.verdict == "entrained"]
            judged = [f for f in own if f.verdict in ("entrained", "drifting", "lost")]
            faster, slower = (statistics.border(offsets, sign) for sign in (-1, 1))
            persons.append(PersonFindings(code, faster, slower, len(held), len(judged)))
            if held:
                phases.append(statistics.direction([f.direction.phase for f in held]).phase)
        tested = [person for person in persons if person.testable]
        widths = [person.basin_percent for person in tested]
        return cls(
            persons=tuple(persons),
            entrained=statistics.share(len(phases), len(tested)),
            basin_mean=statistics.mean(widths),
            basin_deviation=statistics.deviation(widths),
            phases=tuple(phases),
            direction=statistics.direction(phases),
            rayleigh=statistics.rayleigh(phases),
        )

    @property
    def rows(self) -> Rows:
        """Names and values, as text."""
        phase = text(self.direction.phase, "{:.3f} of the stride")
        return [
            ("persons that entrained in some block", shown(self.entrained, "%", 100)),
            ("basin found, both sides, mean", shown(self.basin_mean, "% of the stride")),
            ("basin, standard deviation", shown(self.basin_deviation, "% of the stride")),
            ("mean phase of those that entrained", phase),
            ("its resultant length over persons", text(self.direction.resultant, "{:.3f}")),
            ("Rayleigh's p over persons", text(self.rayleigh, "{:.2g}")),
        ]


def text(value: float, form: str) -> str:
    """Return a value formatted as text, or a remark if it is unknown."""
    return "unknown" if math.isnan(value) else form.format(value)


def shown(estimate: Estimate, unit: str, factor: float = 1.0) -> str:
    """Return an estimate with its interval, as text."""
    value, low, high = (factor * number for number in estimate)
    interval = "" if math.isnan(low) else f" (95 %: {low:.3g} to {high:.3g})"
    return text(value, f"{{:.3g}} {unit}{interval}")
