# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Parameters of the ankle-actuated walker (Table 1 of Ahn and Hogan 2012) and what they imply.

A walker exists only if the linkage closes and a period-one gait vaults over each step without
flying off the ground. The constructor checks this, and an error states by how much it fails. The
gait's speed follows from energy alone (Eq. 7, 8), so everything here is in closed form except for
two one-dimensional searches over double stance, which the paper left to simulation.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from gait_entrainment import geometry
from gait_entrainment.settings import Checked, SettingError, setting


class ParameterError(SettingError):
    """Parameters of no possible walker; the message is one line: field, value, allowed range."""


# Number of points in the search over double stance. The functions are smooth on this scale, and
# the best point is then refined, so the result does not depend on the number.
_SEARCH_POINTS = 257


def greatest(function: Callable[[float], float], lower: float, upper: float) -> float:
    """Maximum of a smooth function on [lower, upper]: scan, then golden-section search."""
    step = (upper - lower) / (_SEARCH_POINTS - 1)
    values = [function(lower + i * step) for i in range(_SEARCH_POINTS)]
    best = max(range(_SEARCH_POINTS), key=values.__getitem__)
    a = lower + max(best - 1, 0) * step
    b = lower + min(best + 1, _SEARCH_POINTS - 1) * step
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    # At a smooth maximum, an interval below sqrt(epsilon) no longer changes the value.
    while b - a > 1e-9:
        inner, outer = b - ratio * (b - a), a + ratio * (b - a)
        if function(inner) < function(outer):
            a = inner
        else:
            b = outer
    return max(values[best], function(0.5 * (a + b)))


def _positive(default: float, meaning: str, unit: str, most: float) -> Any:
    return setting(default, meaning, unit, (0.0, most), least_excluded=True)


@dataclass(frozen=True)
class WalkerParameters(Checked):
    """
    The walker of Table 1: point mass, two massless legs with feet, a spring at the trailing ankle.

    The paper's names are, in this order, m, L, l, g, alpha, mu and k. The constructor raises
    ParameterError if a value is out of range or the walker has no period-one gait.
    """

    mass: float = _positive(80.0, "mass", "kg", 1e4)
    leg_length: float = _positive(1.0, "leg length", "m", 100.0)
    foot_length: float = _positive(0.2, "foot length", "m", 100.0)
    gravity: float = _positive(9.81, "gravitational acceleration", "m/s^2", 1e4)
    leg_angle: float = _positive(
        math.pi / 6, "angle of the leg at heel strike", "rad", math.pi / 4
    )
    max_plantarflexion: float = _positive(
        2.576, "largest plantarflexion of the ankle, at toe-off", "rad", math.pi
    )
    ankle_stiffness: float = _positive(87.3, "ankle stiffness", "N m/rad", 1e7)

    def __post_init__(self) -> None:
        """Check every field, the linkage, and that the period-one gait exists."""
        try:
            super().__post_init__()
            self._check_linkage()
            self._check_gait()
        except SettingError as error:
            raise ParameterError(str(error)) from None
        except (ArithmeticError, ValueError):  # an overflow, the root of a negative number
            raise ParameterError(
                "the values are too large, too small or too far apart to compute with"
            ) from None

    def _check_linkage(self) -> None:
        """Reject angles at which the feet do not separate or the toe cannot leave the ground."""
        # cos(2 alpha) > 0: above pi/4 the collision would throw the mass back.
        least, most = math.asin(min(1.0, self.foot_length / (2 * self.leg_length))), math.pi / 4
        if least >= most:
            longest = 2 * self.leg_length * math.sin(most)
            raise SettingError(
                f"foot_length: {self.foot_length:g} m is too long for legs of"
                f" {self.leg_length:g} m; allowed: below {longest:g} m"
            )
        why = "2 L sin(alpha) > l, and the collision must not reverse the motion"
        self._check_angle("leg_angle", least, most, why)
        cosine = geometry.ankle_cosine(self, -math.sin(self.leg_angle))
        least, most = self.double_stance_start, math.acos(max(-1.0, cosine))
        why = "above pi/2 - alpha, and toe-off before the next heel strike"
        self._check_angle("max_plantarflexion", least, most, why)

    def _check_angle(self, name: str, least: float, most: float, why: str) -> None:
        angle = getattr(self, name)
        if not least < angle < most:
            off = max(least - angle, angle - most)
            raise SettingError(
                f"{name}: {angle:.6g} rad is out of range by {off:.3g} rad;"
                f" allowed: {least:.6g} to {most:.6g} rad ({why})"
            )

    def _check_gait(self) -> None:
        """Reject a stiffness with which the period-one gait falls or flies off."""
        least, most = self.just_vault_over_stiffness, self.just_fly_off_stiffness
        if not least < most:  # also if either is NaN
            raise SettingError(
                f"leg_angle: {self.leg_angle:.6g} rad with max_plantarflexion"
                f" {self.max_plantarflexion:.6g} rad allows no gait: the walker falls below an"
                f" ankle_stiffness of {least:.4g} N m/rad and flies off above {most:.4g} N m/rad"
            )
        reason = ""
        if self.ankle_stiffness <= least:
            reason = "above the just-vault-over stiffness: the walker falls because it lacks"
            reason += f" {-self.least_kinetic_energy:.3g} J"
        elif self.ankle_stiffness >= most:
            reason = "below the just-fly-off stiffness: the walker flies off because its leading"
            reason += f" leg would have to pull with {-self.least_leading_force:.3g} N"
        if reason:
            raise SettingError(
                f"ankle_stiffness: {self.ankle_stiffness:g} N m/rad is not {reason};"
                f" allowed: {least:.6g} to {most:.6g} N m/rad"
            )

    @property
    def time_scale(self) -> float:
        """sqrt(L / g), relative to that of a person with legs of 1 m on earth."""
        return math.sqrt(self.leg_length / self.gravity * 9.81)

    # Linkage

    @property
    def toe_separation(self) -> float:
        """Distance d [m] from the trailing toe to the leading heel in double stance."""
        return 2 * self.leg_length * math.sin(self.leg_angle) - self.foot_length

    @property
    def step_length(self) -> float:
        """Distance [m] from heel to heel, 2 L sin(alpha)."""
        return 2 * self.leg_length * math.sin(self.leg_angle)

    @property
    def double_stance_start(self) -> float:
        """Angle psi [rad] of the trailing ankle at heel strike: foot flat, leg at -alpha."""
        return math.pi / 2 - self.leg_angle

    @property
    def toe_off_angle(self) -> float:
        """Angle theta [rad] of the leading leg at toe-off, where psi = mu."""
        return math.asin(self._leg_sine(self.max_plantarflexion))

    def _leg_sine(self, ankle: float) -> float:
        return float(geometry.leg_sine(self, math.cos(ankle)))

    # Energy of the period-one gait

    @property
    def restitution(self) -> float:
        """Speed after a collision over the speed before it, cos(2 alpha)."""
        return math.cos(2 * self.leg_angle)

    @property
    def floquet_multiplier(self) -> float:
        """Slope of the step-to-step function at the period-one gait, cos(2 alpha)^2 (Eq. 10)."""
        return self.restitution**2

    @property
    def push_off_work(self) -> float:
        """Work [J] of the ankle spring over one double stance (Eq. 7)."""
        return self.ankle_stiffness * self._work_per_stiffness(self.max_plantarflexion)

    @property
    def peak_torque(self) -> float:
        """Torque [N m] of the ankle spring at heel strike, its maximum."""
        return float(geometry.spring_torque(self, self.double_stance_start))

    @property
    def collision_speed(self) -> float:
        """Speed [m/s] of the mass just before a collision in the period-one gait (Eq. 8)."""
        return math.sqrt(2 * self.push_off_work / (self.mass * (1 - self.floquet_multiplier)))

    @property
    def speed_after_collision(self) -> float:
        """Speed [m/s] of the mass just after a collision in the period-one gait."""
        return self.restitution * self.collision_speed

    # Barrier and ground reaction of the period-one gait. Both are linear in the stiffness, so each
    # is split into two parts: one without the stiffness, and one per unit of it.

    def _work_per_stiffness(self, ankle: float) -> float:
        """Work of the spring from heel strike to psi, per unit of stiffness [rad^2]."""
        start = self.double_stance_start
        return geometry.torque_work(ankle - start, self.max_plantarflexion - start, 1.0)

    def _energy_per_stiffness(self, ankle: float) -> float:
        """
        Part of the kinetic energy at psi that grows with k, per unit of stiffness [rad^2].

        The gait's kinetic energy after a collision is what remains if the collision takes as much
        energy as the push-off adds.
        """
        push_off = self._work_per_stiffness(self.max_plantarflexion)
        kept = self.floquet_multiplier / (1 - self.floquet_multiplier)
        return kept * push_off + self._work_per_stiffness(ankle)

    def _height(self, ankle: float) -> float:
        """Height [m] of the mass at psi above its height at heel strike."""
        sine, struck = self._leg_sine(ankle), math.sin(self.leg_angle)
        below = geometry.drop(sine, math.sqrt(1 - sine * sine))
        return self.leg_length * (geometry.drop(struck, math.cos(self.leg_angle)) - below)

    @property
    def _apex_height(self) -> float:
        return self.leg_length * geometry.drop(math.sin(self.leg_angle), math.cos(self.leg_angle))

    def _hold(self, ankle: float) -> float:
        """Force [N] on the leading leg at psi if the walker rises and falls without a push."""
        sine = self._leg_sine(ankle)
        lost = 2 * self.gravity * self._height(ankle) / self.leg_length**2
        return float(geometry.pendulum_force(self, math.sqrt(1 - sine * sine), -lost))

    def _lift_per_stiffness(self, ankle: float) -> float:
        """Force that push and speed take off the leading leg at psi, per unit of stiffness."""
        arm = float(geometry.unloading_arm(self, math.sin(ankle), self._leg_sine(ankle)))
        push = arm * (self.max_plantarflexion - ankle)
        return push + 2 * self._energy_per_stiffness(ankle) / self.leg_length

    @property
    def _hold_before_collision(self) -> float:
        return self.mass * self.gravity * math.cos(self.leg_angle)

    @property
    def _lift_before_collision(self) -> float:
        return 2 * self._energy_per_stiffness(self.max_plantarflexion) / self.leg_length

    def _most_on_the_way_up(self, function: Callable[[float, float], float]) -> float:
        """Maximum, up to the apex, of a function of potential energy and kinetic energy per k."""
        weight = self.mass * self.gravity

        def at(ankle: float) -> float:
            return function(weight * self._height(ankle), self._energy_per_stiffness(ankle))

        most = greatest(at, self.double_stance_start, self.max_plantarflexion)
        if self.toe_off_angle > 0:  # the apex is in single stance
            gained = self._energy_per_stiffness(self.max_plantarflexion)
            most = max(most, function(weight * self._apex_height, gained))
        return most

    def _most_while_leading(self, function: Callable[[float, float], float]) -> float:
        """Maximum, while a leg is leading or stance leg, of a function of hold and lift per k."""

        def at(ankle: float) -> float:
            return function(self._hold(ankle), self._lift_per_stiffness(ankle))

        # In single stance the force is smallest at the end.
        return max(
            greatest(at, self.double_stance_start, self.max_plantarflexion),
            function(self._hold_before_collision, self._lift_before_collision),
        )

    @cached_property
    def just_vault_over_stiffness(self) -> float:
        """
        Stiffness k_C [N m/rad] below which the period-one gait does not vault over.

        Eq. 9 puts the barrier at the apex of single stance. Here double stance counts as well, and
        it is decisive if toe-off comes after the apex.
        """
        return self._most_on_the_way_up(lambda potential, gained: potential / gained)

    @property
    def least_kinetic_energy(self) -> float:
        """Kinetic energy [J] at the barrier of the period-one gait; negative if it would fall."""
        stiffness = self.ankle_stiffness
        return -self._most_on_the_way_up(lambda potential, gained: potential - stiffness * gained)

    @cached_property
    def just_fly_off_stiffness(self) -> float:
        """Stiffness [N m/rad] above which the leading leg of the period-one gait lifts off."""
        return -self._most_while_leading(lambda hold, lift: -hold / lift)

    @property
    def least_leading_force(self) -> float:
        """Smallest ground reaction [N] of the leading leg in the period-one gait."""
        return -self._most_while_leading(lambda hold, lift: self.ankle_stiffness * lift - hold)


@dataclass(frozen=True)
class Variation(Checked):
    """
    Natural variation of the stride period, which the paper's walker does not have.

    Adults: 1 to 3 %, exponent about 0.75 (Hausdorff et al., J. Appl. Physiol. 78, 349, 1995).
    """

    coefficient: float = setting(0.0, "coefficient of variation of the period", "1", (0.0, 0.2))
    exponent: float = setting(
        0.75, "long-range (Hurst) exponent; 0.5 is white", "1", (0.5, 1.0), most_excluded=True
    )
