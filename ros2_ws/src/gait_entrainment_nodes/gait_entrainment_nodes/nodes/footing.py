# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The walker's position, from its joint angles alone.

The model's legs are straight and its ground is level, so the angles give the posture, and the
standing foot gives the position. The standing foot is the one that lies flat, so no events are
needed, and messages may arrive in any order.
"""

import math
from collections.abc import Sequence

from gait_entrainment.conventions import Side

# At heel strike both feet are flat to within rounding; a drawn swing foot only 10 us before it.
_FLAT_DIGITS = 9


class Footing:
    """
    Tracks a walker over level ground by the foot that lies flat; lengths are in [m].

    At least one posture in every double stance is needed to follow the step. Without it tracking
    continues, but the position may be off by a few centimetres from then on.
    """

    def __init__(self, leg_length: float, foot_length: float) -> None:
        self._leg_length = leg_length
        self._foot_length = foot_length
        self._stance: Side | None = None
        self._heel = 0.0  # x of the flat foot's heel [m]; 0 at first

    def place(self, hips: Sequence[float], ankles: Sequence[float]) -> tuple[float, float]:
        """Return the mass's (x, z) [m], z = 0 on the ground, from angles [left, right] [rad]."""
        length = self._leg_length
        # If both lie flat, at heel strike, the leg ahead leads from now on.
        stance = min(
            Side,
            key=lambda side: (round(abs(hips[side] - ankles[side]), _FLAT_DIGITS), -hips[side]),
        )
        if self._stance not in (None, stance):
            # The trailing toe has not moved; go from there over the mass to the new heel.
            hip, ankle = hips[stance.other], ankles[stance.other]
            toe = length * math.sin(hip) + self._foot_length * math.cos(hip - ankle)
            self._heel += self._foot_length - toe + length * math.sin(hips[stance])
        self._stance = stance
        lean = hips[stance]
        return self._heel - length * math.sin(lean), length * math.cos(lean)
