# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Every number printed by Ahn and Hogan (2012), compared with ours.

The printed numbers are in `statements.yaml`, with the rules for agreement; ours are never tuned to
match them. For those that do not agree, `explain` tests what may be behind the difference.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.branches import (
    Border,
    Piece,
    basin_of,
    locked_gaits,
    pieces_of,
)
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait
from gait_entrainment_studies.locking.walked import Outcome
from gait_entrainment_studies.paper.experiments import (
    PULSE_WIDTH,
    TABLE_1,
    floquet_by_convergence,
    floquet_by_differences,
    least_force,
    outcomes_along,
    paper_pulses,
    paper_walk,
)

STATEMENTS = yaml.safe_load(Path(__file__).with_name("statements.yaml").read_text())
_ROUNDED = "k and mu are rounded in Table 1: see the table of explanations"

Found = float | str | tuple[str, bool]  # the tuple: a text, and whether it agrees


@dataclass(frozen=True)
class Comparison:
    """One published statement and our result."""

    name: str
    paper: float | str
    ours: float | str
    unit: str
    agrees: bool | None
    """None if the paper shows it but prints no number."""
    note: str = ""


def compare() -> list[Comparison]:
    """Return all comparisons, for the walker of Table 1."""
    rows = [*_gait(), *_entrainment()]
    for steps, every in ((2, "pulse in every stride"), (1, "pulse in every step")):
        rows += _speed_curve(steps, every)
    return rows


def _rows(group: str, found: Mapping[str, Found], **words: Any) -> list[Comparison]:
    """Compare the statements of a group with what we found, given by their keys."""
    rows = []
    for statement in STATEMENTS[group]:
        paper, ours, agrees = statement["paper"], found[statement["key"]], None
        if isinstance(ours, tuple):
            ours, agrees = ours
        elif isinstance(ours, str):
            agrees = ours == paper
        elif paper[0] in "<>":
            bound = float(paper[1:])
            agrees = ours < bound if paper[0] == "<" else ours > bound
        elif paper != "no number":
            decimals = len(paper.partition(".")[2])
            agrees = f"{ours:.{decimals}f}" == paper
            paper = float(paper)
        name, note = (statement.get(part, "").format(**words) for part in ("name", "note"))
        rows.append(Comparison(name, paper, ours, statement.get("unit", ""), agrees, note))
    return rows


def _gait() -> list[Comparison]:
    p, step = TABLE_1, paper_pulses().unperturbed_period / 2
    force, instant = least_force()
    later = f"{instant:.4f} s into the step"
    found: dict[str, Found] = {
        "step": step,
        "speed": p.step_length / step,
        "vault_over": p.just_vault_over_stiffness,
        "peak_torque": p.peak_torque,
        "force": force,
        "place": later if instant else "beginning of double stance",
        "closed_form": p.floquet_multiplier,
        "differences": floquet_by_differences(),
        "convergence": floquet_by_convergence(),
    }
    return _rows("gait", found, rounded=_ROUNDED)


def _entrainment() -> list[Comparison]:
    gait = paper_pulses()
    period = gait.unperturbed_period
    pieces = pieces_of(gait)
    shortest, longest = _basin(gait, pieces)
    # At exactly 2 tau_0 every onset at which the pulse does nothing repeats, which is not a lock.
    grid = np.concatenate([np.arange(-100, 0, 2), np.arange(2, 101, 2)])
    outcomes = outcomes_along(grid * 1e-3, np.array([0.0, 0.25, 0.5, 0.75]))
    locked = [int(grid[i]) for i, outcome in enumerate(outcomes) if outcome is Outcome.LOCKED]
    least, coarse = min(locked), min(ms for ms in locked if ms % 4 == 0)
    walks = [paper_walk(-0.05, phase, 120) for phase in np.arange(24) / 24]
    lags = np.array([walk.lags[-1] for walk in walks])
    lock = next(lock for lock in locked_gaits(gait, period - 0.05, pieces) if lock.stable)
    last = float(walks[0].stride_periods[-1])
    none_longer, none_shorter = longest == 0 and max(locked) < 0, shortest > -0.08 and least > -80
    # A pulse that outlasts toe-off begins at most its width before it.
    close = bool(np.ptp(lags) < 1e-8 and -PULSE_WIDTH < lags.mean() <= 0)
    found: dict[str, Found] = {
        "longer": "none" if none_longer else f"up to {longest * 1e3:+.3f} ms",
        "shorter": (f"none; from {shortest * 1e3:.4f} ms on", none_shorter),
        "basin": 100 * (longest - shortest) / period,
        "coarse_basin": -0.1 * coarse / period,
        "phase": (f"one, {lags.mean() * 1e3:.3f} ms from toe-off", close),
        "last": last,
    }
    return _rows(
        "entrainment",
        found,
        first_border=Border.END_AT_TOE_OFF.value,
        last_border=Border.START_AT_TOE_OFF.value,
        censored=outcomes.count(Outcome.CENSORED),
        least=least,
        coarse=coarse,
        fine=-0.1 * least / period,
        spread=np.ptp(lags) * 1e9,
        lag=lock.lag * 1e3,
        phase=lock.phase,
        multipliers=" and ".join(f"{m:.4f}" for m in lock.multipliers),
        missing=abs(last - period + 0.05),
        rounded=_ROUNDED,
    )


def _speed_curve(steps: int, every: str) -> list[Comparison]:
    """Fig. 8, with the pulse in every stride (as in the experiments) or in every step."""
    gait = paper_pulses(steps_per_pulse=steps)
    pieces = pieces_of(gait)
    shortest, longest = _basin(gait, pieces)
    slowest = steps * TABLE_1.step_length / max(piece.greatest_period.period for piece in pieces)
    fastest = steps * TABLE_1.step_length / min(piece.least_period.period for piece in pieces)
    early = next(piece for piece in pieces if piece.stable and piece.place is Place.INSIDE)
    low, high = early.least_period, early.greatest_period
    width = high.period - low.period
    found: dict[str, Found] = {
        "slowest": slowest,
        "fastest": fastest,
        "range": 100 * (fastest / slowest - 1),
        "width": 100 * width / paper_pulses().unperturbed_period,
        "ratio": (longest - shortest) / width,
        # Speed falls as the period grows.
        "signs": " ".join("-" if p.last.period > p.first.period else "+" for p in pieces),
    }
    return _rows(
        "speed_curve",
        found,
        every=every,
        low=low.border.value,
        high=high.border.value,
        first=early.first.lag * 1e3,
        last=early.last.lag * 1e3,
    )


def explain() -> list[Comparison]:
    """
    Test whether the differences come from the rounding of k and mu in Table 1.

    Of k alone, mu alone and both, the variant in which every digit agrees explains them.
    """
    p, degrees = TABLE_1, math.radians(147.6)
    turned = replace(p, max_plantarflexion=degrees)
    both = replace(turned, ankle_stiffness=_stiffness_of_torque(turned))
    stiffness = _stiffness_of_torque(p)
    rows = _rows("unrounded", {"stiffness": stiffness, "degrees": degrees})
    variants = {"k": replace(p, ankle_stiffness=stiffness), "mu": turned, "both": both}
    for name, walker in variants.items():
        found = {
            "period": paper_pulses(walker).unperturbed_period - 0.05,
            "force": walker.least_leading_force,
            "peak_torque": walker.peak_torque,
            "vault_over": walker.just_vault_over_stiffness,
        }
        rows += _rows("variant", found, name=name)
    gait = paper_pulses(both)
    shortest, longest = _basin(gait, pieces_of(gait))
    return [*rows, *_rows("both", {"basin": 100 * (longest - shortest) / gait.unperturbed_period})]


def _stiffness_of_torque(p: WalkerParameters) -> float:
    """Stiffness [N m/rad] whose peak torque is 0.17 of body weight times leg length."""
    torque = 0.17 * p.mass * p.gravity * p.leg_length
    return torque / (p.max_plantarflexion - p.double_stance_start)


def _basin(gait: PulsedGait, pieces: list[Piece]) -> tuple[float, float]:
    """Shortest and longest period with a stable lock, minus the unperturbed one [s]."""
    shortest, longest = (end - gait.unperturbed_period for end in basin_of(gait, pieces))
    # Equal up to rounding: the corner at toe-off is the unperturbed gait itself.
    return shortest, 0.0 if abs(longest) < 1e-12 else longest
