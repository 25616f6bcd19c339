# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One row of the tongue: all pulse periods at one torque, solved and walked."""

from typing import Any

import numpy as np

from gait_entrainment_studies.locking.branches import pieces_of, stable_intervals
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.walked import Outcome, walk_under_pulses
from gait_entrainment_studies.sweep.plan import SweepPlan

# A lag that creeps by less than this per stride [s] counts as locked by the last stride. At a
# pulse period closer than this to a border, walking cannot tell and the exact map decides.
_CREEP = 1e-5

SHARES = {
    "share_locked": Outcome.LOCKED,
    "share_alternating": Outcome.ALTERNATING,
    "share_slipping": Outcome.SLIPPING,
    "share_censored": Outcome.CENSORED,
    "share_fell": Outcome.FELL,
    "share_flew_off": Outcome.FLEW_OFF,
}

Row = dict[str, Any]


def sweep_row(plan: SweepPlan, index: int) -> Row:
    """
    Return the columns of one torque, a cell per pulse period.

    `stable_locks` is the number of stable 1:1 locks, solved; the shares are of the initial phases,
    walked. `problem` says why a cell could not be asked: its shares are NaN then.
    """
    fraction = float(plan.torque_fractions.values[index])
    torque = fraction * plan.walker.peak_torque
    offsets = plan.period_offsets.values
    gait = PulsedGait(plan.walker, torque, plan.width)
    stable = stable_intervals(pieces_of(gait)) if torque != 0 else []
    periods = gait.unperturbed_period + offsets
    locks = np.zeros(offsets.size, np.int64)
    for piece in stable:
        locks += (piece.least_period.period < periods) & (periods < piece.greatest_period.period)
    row: Row = {
        "torque": np.full(offsets.size, torque),
        "torque_fraction": np.full(offsets.size, fraction),
        "period_offset": offsets,
        "stable_locks": locks,
        **{name: np.full(offsets.size, np.nan) for name in SHARES},
        "median_lag": np.full(offsets.size, np.nan),
        "problem": [""] * offsets.size,
    }
    for i, period in enumerate(periods):
        if period <= plan.width:
            row["problem"][i] = "pulses overlap"
            continue
        if abs(period - gait.unperturbed_period) < _CREEP:
            row["problem"][i] = "the stride period itself: a pulse in swing stays where it is"
            continue
        outcomes, lags = [], []
        for phase in np.arange(plan.phases) / plan.phases:
            walk = walk_under_pulses(
                plan.walker, torque, plan.width, float(period), float(phase), plan.strides
            )
            outcomes.append(walk.outcome(_CREEP))
            if outcomes[-1] is Outcome.LOCKED:
                lags.append(walk.last_lag)
        for name, outcome in SHARES.items():
            row[name][i] = outcomes.count(outcome) / plan.phases
        if lags:
            row["median_lag"][i] = np.median(lags)
    return row
