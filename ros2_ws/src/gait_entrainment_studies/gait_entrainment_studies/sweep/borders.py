# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Exact borders of the tongue: at each torque, the ends of the intervals with a stable lock."""

from dataclasses import dataclass

import numpy as np

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.branches import pieces_of, stable_intervals
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats


@dataclass(frozen=True)
class StableInterval:
    """Pulse periods with a stable lock at one torque, off the unperturbed stride period [s]."""

    torque_fraction: float
    place: str
    shortest: float
    longest: float
    shortest_border: str
    longest_border: str
    lag_at_shortest: float
    lag_at_longest: float


def exact_borders(
    walker: WalkerParameters, torque_fractions: Floats, width: float
) -> list[StableInterval]:
    """Solve for the borders at each torque, given as a fraction of the peak ankle torque."""
    found = []
    for fraction in torque_fractions[np.abs(torque_fractions) > 0]:
        gait = PulsedGait(walker, float(fraction) * walker.peak_torque, width)
        for piece in stable_intervals(pieces_of(gait)):
            low, high = piece.least_period, piece.greatest_period
            found.append(
                StableInterval(
                    float(fraction),
                    piece.place.value,
                    low.period - gait.unperturbed_period,
                    high.period - gait.unperturbed_period,
                    low.border.value,
                    high.border.value,
                    low.lag,
                    high.lag,
                )
            )
    return found
