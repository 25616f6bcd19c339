# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
For which ankle stiffness a period-one gait exists, at one leg angle and over all of them.

Below the just-vault-over stiffness the walker falls; above the just-fly-off stiffness the leading
leg would have to pull. Both are closed forms except for a search over double stance (parameters).
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import pairwise

import numpy as np

from gait_entrainment.parameters import ParameterError, WalkerParameters

# Leg angles [rad] this close are taken as one: no range differs visibly between them.
_SAME_ANGLE = 1e-9


class Limit(str, Enum):
    """Where in the gait an end of the range takes effect."""

    APEX = "apex of single stance"
    DOUBLE_STANCE = "within double stance"
    HEEL_STRIKE = "beginning of double stance"
    BEFORE_HEEL_STRIKE = "end of single stance"


@dataclass(frozen=True)
class StiffnessRange:
    """Stiffness [N m/rad] between which a gait exists; if the range is empty, no gait does."""

    leg_angle: float
    just_vault_over: float
    just_fly_off: float
    falls_at: Limit
    flies_off_at: Limit

    @property
    def limits(self) -> tuple[Limit, Limit]:
        """Where in the gait its two ends take effect."""
        return self.falls_at, self.flies_off_at

    @property
    def exists(self) -> bool:
        """Whether any stiffness gives a gait at this leg angle."""
        return self.just_vault_over < self.just_fly_off


class _AnyStiffness(WalkerParameters):
    """A walker whose linkage closes, with or without a gait, to find which limits end its gait."""

    def _check_gait(self) -> None:
        """Accept any stiffness."""

    def range(self) -> StiffnessRange:
        # Eq. 9 takes the barrier at the apex; a higher one can only be in double stance.
        apex = self.mass * self.gravity * self._apex_height
        needed = apex / self._energy_per_stiffness(self.max_plantarflexion)
        at_apex = self.toe_off_angle > 0 and self.just_vault_over_stiffness == needed
        start = self.double_stance_start
        fly_off = {
            Limit.HEEL_STRIKE: self._hold(start) / self._lift_per_stiffness(start),
            Limit.BEFORE_HEEL_STRIKE: self._hold_before_collision / self._lift_before_collision,
        }
        least, place = self.just_fly_off_stiffness, Limit.DOUBLE_STANCE
        for limit, stiffness in fly_off.items():
            # The search over double stance includes its ends, so it has found this one.
            if math.isclose(stiffness, least, rel_tol=1e-12):
                place = limit
        falls_at = Limit.APEX if at_apex else Limit.DOUBLE_STANCE
        return StiffnessRange(
            self.leg_angle, self.just_vault_over_stiffness, least, falls_at, place
        )


def stiffness_range(
    parameters: WalkerParameters, leg_angle: float | None = None
) -> StiffnessRange:
    """
    Return the range of stiffness with a gait, all else as in `parameters`.

    Raises ParameterError if the linkage does not close at the leg angle [rad].
    """
    angle = parameters.leg_angle if leg_angle is None else leg_angle
    return _AnyStiffness(**asdict(parameters) | {"leg_angle": angle}).range()


def switches(
    parameters: WalkerParameters, ranges: Sequence[StiffnessRange]
) -> list[StiffnessRange]:
    """Return the ranges at the leg angles between these at which a limit moves elsewhere."""
    found = []
    for before, after in pairwise(ranges):
        low, high = before, after
        while low.limits != high.limits and high.leg_angle - low.leg_angle > _SAME_ANGLE:
            middle = stiffness_range(parameters, (low.leg_angle + high.leg_angle) / 2)
            low, high = (middle, high) if middle.limits == low.limits else (low, middle)
        if low.limits != high.limits:
            found.append(high)
    return found


def existence_map(parameters: WalkerParameters, points: int = 200) -> list[StiffnessRange]:
    """Return the ranges along the leg angle, over all angles at which the linkage closes."""
    least = math.asin(parameters.foot_length / (2 * parameters.leg_length))
    ranges = []
    for leg_angle in np.linspace(least, math.pi / 4, points + 2)[1:-1]:
        with suppress(ParameterError):
            ranges.append(stiffness_range(parameters, float(leg_angle)))
    return ranges
