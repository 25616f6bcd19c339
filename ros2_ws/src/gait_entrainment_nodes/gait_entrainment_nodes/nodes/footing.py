# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Where the walker stands, from its joint angles alone.

The model's legs are straight and its ground is level, so the angles give the posture, and the
foot that stands gives the place. No event is needed, and so no order of messages: the foot that
stands is the one that lies flat.
"""

import math
from collections.abc import Sequence

from gait_entrainment.conventions import Side

# At heel strike both feet are flat to within rounding; a drawn swing foot is so only 10 us before.
_FLAT_DIGITS = 9


class Footing:
    """
    Follows a walker, whose lengths are in [m], over level ground by the foot that lies flat.

    At least one posture in every double stance is needed to take the step; without it the walk
    goes on, but a place may be off by a few centimetres from then on.
    """

    def __init__(self, leg_length: float, foot_length: float) -> None:
        self._leg_length = leg_length
        self._foot_length = foot_length
        self._stance: Side | None = None
        self._heel = 0.0  # x of the flat foot's heel [m]; 0 at first

    def place(self, hips: Sequence[float], ankles: Sequence[float]) -> tuple[float, float]:
        """Return where the mass is, (x, z) [m], by angles [rad], [left, right]; ground: z = 0."""
        length = self._leg_length
        # Where both lie flat, at heel strike, it is the leg ahead that leads from now on.
        stance = min(
            Side,
            key=lambda side: (round(abs(hips[side] - ankles[side]), _FLAT_DIGITS), -hips[side]),
        )
        if self._stance not in (None, stance):
            # The trailing toe has not moved; from there over the mass to the new heel.
            hip, ankle = hips[stance.other], ankles[stance.other]
            toe = length * math.sin(hip) + self._foot_length * math.cos(hip - ankle)
            self._heel += self._foot_length - toe + length * math.sin(hips[stance])
        self._stance = stance
        lean = hips[stance]
        return self._heel - length * math.sin(lean), length * math.cos(lean)
