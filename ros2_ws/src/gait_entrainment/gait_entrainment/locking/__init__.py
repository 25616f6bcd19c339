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

"""
Phase-locked gaits, solved.

    pulsed_gait    gaits with one pulse a stride, and the exact derivative of their Poincare map
    branches       smooth branches of them, corners and folds, the locked gaits at a pulse period
    walked         walks under pulses by the walker in time, to confirm them
    attractors     which initial phases each stable lock draws
    figures        the branches as a picture
"""

from gait_entrainment.locking.attractors import Shares, shares_of
from gait_entrainment.locking.branches import (
    Border,
    End,
    LockedGait,
    Piece,
    Place,
    locked_gaits,
    pieces_of,
    stable_intervals,
)
from gait_entrainment.locking.pulsed_gait import Gaits, PulsedGait
from gait_entrainment.locking.walked import Outcome, PulsedWalk, walk_under_pulses

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
