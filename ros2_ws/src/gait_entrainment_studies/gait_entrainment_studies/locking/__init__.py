# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Phase-locked gaits, solved.

    pulsed_gait    gaits with one pulse a stride, and the exact derivative of their Poincare map
    branches       smooth branches of them, corners and folds, the locked gaits at a pulse period
    walked         walks under pulses by the walker in time, to confirm them
    attractors     which initial phases each stable lock draws
    figures        the branches as a picture
"""

from gait_entrainment_studies.locking.attractors import Shares, shares_of
from gait_entrainment_studies.locking.branches import (
    Border,
    End,
    LockedGait,
    Piece,
    Place,
    locked_gaits,
    pieces_of,
    stable_intervals,
)
from gait_entrainment_studies.locking.pulsed_gait import Gaits, PulsedGait
from gait_entrainment_studies.locking.walked import Outcome, PulsedWalk, walk_under_pulses

__all__ = [
    "Border",
    "End",
    "Gaits",
    "LockedGait",
    "Outcome",
    "Piece",
    "Place",
    "PulsedGait",
    "PulsedWalk",
    "Shares",
    "locked_gaits",
    "pieces_of",
    "shares_of",
    "stable_intervals",
    "walk_under_pulses",
]
