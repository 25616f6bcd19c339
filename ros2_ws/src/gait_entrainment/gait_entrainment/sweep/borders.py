# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Exact borders of the tongue: at each torque, the ends of the intervals with a stable lock."""

from dataclasses import dataclass

import numpy as np

from gait_entrainment.locking import PulsedGait, pieces_of, stable_intervals
from gait_entrainment.locking.pulsed_gait import Floats
from gait_entrainment.parameters import WalkerParameters


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
