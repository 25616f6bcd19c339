# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What is solved and what is walked at one torque: the cells of a row, and the exact borders."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.branches import pieces_of, stable_intervals
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait
from gait_entrainment_studies.locking.roots import Floats
from gait_entrainment_studies.locking.walked import Outcome, walk_under_pulses
from gait_entrainment_studies.sweep.plan import SweepPlan

# A lag that creeps by less than this per stride [s] counts as locked by the last stride. For a
# pulse period closer than this to a border, walking cannot decide, but the exact map does.
_CREEP = 1e-5


@dataclass(frozen=True)
class Cell:
    """One pulse period at one torque: the columns of the table."""

    torque: float
    """[N m]"""
    torque_fraction: float
    period_offset: float
    """Pulse period minus the unperturbed stride period [s]."""
    stable_locks: int
    """Number of stable 1:1 locks, solved."""
    share_locked: float = np.nan
    """Share of the initial phases with this outcome, walked; NaN if there is a problem."""
    share_alternating: float = np.nan
    share_slipping: float = np.nan
    share_censored: float = np.nan
    share_fell: float = np.nan
    share_flew_off: float = np.nan
    median_lag: float = np.nan
    """Median lag of the last pulses of the walks that locked [s]."""
    problem: str = ""
    """Why the cell was not walked."""


Row = dict[str, NDArray[np.generic]]
"""The cells of one torque, by column."""


def sweep_row(plan: SweepPlan, index: int) -> Row:
    """Return the row of one torque, a cell for each pulse period."""
    fraction = float(plan.torque_fractions.values[index])
    torque = fraction * plan.walker.peak_torque
    gait = PulsedGait(plan.walker, torque, plan.width)
    stable = stable_intervals(pieces_of(gait)) if torque != 0 else []
    cells = []
    for offset in plan.period_offsets.values:
        period = float(gait.unperturbed_period + offset)
        locks = sum(
            piece.least_period.period < period < piece.greatest_period.period for piece in stable
        )
        if period <= plan.width:
            walked: dict[str, Any] = {"problem": "pulses overlap"}
        elif abs(period - gait.unperturbed_period) < _CREEP:
            walked = {"problem": "the stride period itself: a pulse in swing stays where it is"}
        else:
            walked = _walked(plan, gait, period)
        cells.append(Cell(torque, fraction, float(offset), locks, **walked))
    names = [field.name for field in fields(Cell)]
    return {name: np.array([getattr(cell, name) for cell in cells]) for name in names}


def _walked(plan: SweepPlan, gait: PulsedGait, period: float) -> dict[str, float]:
    """Return the fields of a cell that come from walks from every initial phase."""
    walks = [
        walk_under_pulses(gait, period, float(phase), plan.strides)
        for phase in np.arange(plan.phases) / plan.phases
    ]
    outcomes = [walk.outcome(_CREEP) for walk in walks]
    shares = {
        f"share_{outcome.name.lower()}": outcomes.count(outcome) / plan.phases
        for outcome in Outcome
    }
    pairs = zip(walks, outcomes, strict=True)
    lags = [float(walk.lags[-1]) for walk, outcome in pairs if outcome is Outcome.LOCKED]
    return {**shares, "median_lag": float(np.median(lags)) if lags else np.nan}


@dataclass(frozen=True)
class StableInterval:
    """Pulse periods with a stable lock at one torque, minus the unperturbed stride period [s]."""

    torque_fraction: float
    place: Place
    shortest: float
    shortest_border: str
    lag_at_shortest: float
    longest: float
    longest_border: str
    lag_at_longest: float


def exact_borders(
    walker: WalkerParameters, torque_fractions: Floats, width: float
) -> list[StableInterval]:
    """Solve for the borders at each torque, given as a fraction of the peak ankle torque."""
    found = []
    for fraction in torque_fractions[np.abs(torque_fractions) > 0].tolist():
        gait = PulsedGait(walker, fraction * walker.peak_torque, width)
        for piece in stable_intervals(pieces_of(gait)):
            shortest, longest = (
                (end.period - gait.unperturbed_period, end.border.value, end.lag)
                for end in (piece.least_period, piece.greatest_period)
            )
            found.append(StableInterval(fraction, piece.place, *shortest, *longest))
    return found
