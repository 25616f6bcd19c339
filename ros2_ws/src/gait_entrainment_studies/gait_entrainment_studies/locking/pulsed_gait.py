# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Exact gaits with one pulse per stride, in terms of where in double stance the pulse acts.

This solution is independent: it shares only the closed forms of the linkage with the simulated
walker, so each can be checked against the other.

A pulse of width w on the trailing leg acts from the ankle angle psi_s to psi_e. Energy then gives
the speed of the gait that repeats itself in closed form, because the stride is linear in `apex`
(below). Times are quadratures between known angles: nothing is integrated step by step and no
time is inverted. So a whole branch of gaits takes a few array operations.

`apex` is the squared angular velocity [1/s^2] that the mass would have at the apex without further
torque: theta_dot^2 = apex + (2 g / L)(1 - cos(theta)). Torque changes it by 2 T d psi / (m L^2); a
collision keeps cos(2 alpha)^2 of theta_dot^2.

The Poincare section is the heel strike of the *other* leg, where the perturbed leg's push-off
begins. The state there is (apex right after the collision, onset of the pulse after the heel
strike [s], negative before it), and a pulse period tau_p gives the map

    apex' = A(apex, onset),    onset' = onset + tau_p - R(apex, onset),

where R is the time to the next such heel strike. Its fixed points are the 1:1 phase-locked gaits,
those whose period R is tau_p. The Jacobian does not depend on tau_p and is exact.
"""

import math
from dataclasses import dataclass, fields
from enum import Enum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.special import elliprd, elliprf

from gait_entrainment import geometry
from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.roots import Floats, first_root, newton

# The closed forms of the linkage are typed for numbers, but as pure arithmetic also take arrays.
_FORMS: Any = geometry

# Gauss-Legendre rule of one stretch of double stance, and the weights that give the last two
# Legendre coefficients. With Table 1, over a whole double stance, each is a third of the one
# before, so 24 nodes leave an error of 3^-48 of the time. If the last two are not this small
# compared with the mean, the stretch has not converged and is halved, as many other walkers
# require: the error is then about their square.
_COUNT = 24
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_COUNT)
_LAST = np.arange(_COUNT - 2, _COUNT)
_TAILS = np.polynomial.legendre.legvander(_NODES, _COUNT - 1)[:, _LAST].T
_TAILS = (_LAST[:, None] + 0.5) * _TAILS * _WEIGHTS
_TAIL_TOLERANCE = 1e-8
# A stretch that has not converged after this many halvings ends in a stall.
_MOST_HALVINGS = 12
# The nodes and both ends, where the force is least.
_PLACES = np.concatenate([[-1.0], _NODES, [1.0]])


class Place(str, Enum):
    """Where the pulse of a gait lies, which names a branch of gaits."""

    EARLY = "pulse begins before double stance"
    INSIDE = "pulse inside double stance"
    LATE = "pulse outlasts double stance"


@dataclass(frozen=True)
class Gaits:
    """Gaits that repeat themselves, one per element; times in s, NaN if there is no gait."""

    start: Floats
    """Ankle angle where the pulse begins to act [rad]."""
    end: Floats
    """Ankle angle where it stops acting."""
    onset: Floats
    """Pulse onset after the other leg's heel strike."""
    period: Floats
    """Time from one pulse to the next."""
    apex: Floats
    """The speed at the section, as `apex`."""
    double_stance: Floats
    """Duration of the perturbed leg's push-off."""
    step: Floats
    """Duration of the step that begins at the section."""
    jacobian: Floats
    """Derivative of the map (..., 2, 2)."""
    feasible: Any
    """Whether the mass keeps moving, the leading leg presses on the ground at all nodes and ends
    of the quadratures, and these have converged."""

    @property
    def lag(self) -> Floats:
        """Pulse onset after the perturbed leg's toe-off."""
        return self.onset - self.double_stance

    @property
    def phase(self) -> Floats:
        """Pulse onset in the perturbed leg's gait cycle, in [0, 1)."""
        phase: Floats = np.mod(1 + (self.onset - self.step) / self.period, 1.0)
        return phase

    @property
    def slope(self) -> Floats:
        """
        Derivative of the period with respect to the onset, along the branch.

        det(I - J) = (1 - dA/dapex) slope: a multiplier is 1 exactly where the branch folds.
        """
        j = self.jacobian
        determinant = (1 - j[..., 0, 0]) * (1 - j[..., 1, 1]) - j[..., 0, 1] * j[..., 1, 0]
        slope: Floats = determinant / (1 - j[..., 0, 0])
        return slope

    @property
    def multipliers(self) -> Any:
        """Both Floquet multipliers (..., 2), complex, the larger in magnitude first."""
        j = np.where(np.isfinite(self.jacobian), self.jacobian, 0.0)
        values = np.linalg.eigvals(j).astype(complex)
        order = np.argsort(-np.abs(values), axis=-1, kind="stable")
        return np.take_along_axis(values, order, axis=-1)

    @property
    def stable(self) -> Any:
        """
        Whether both multipliers lie inside the unit circle.

        For a real 2x2 matrix that is |trace| < 1 + determinant and determinant < 1 (Jury).
        """
        j = self.jacobian
        trace = j[..., 0, 0] + j[..., 1, 1]
        determinant = j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0]
        return self.feasible & (np.abs(trace) < 1 + determinant) & (determinant < 1)

    def at(self, index: int) -> "Gaits":
        """Return one of the gaits."""
        return Gaits(**{field.name: getattr(self, field.name)[index] for field in fields(self)})


class _Stretch(NamedTuple):
    """Times of stretches of double stance."""

    time: Floats
    by_apex: Floats
    """Derivative of the time with respect to `apex`."""
    sound: Any
    """Whether the quadrature has converged, with the walker moving and on the ground."""


class PulsedGait:
    """
    Gaits of one walker under one kind of pulse.

    `torque` [N m] and `width` [s] are those of the pulse; a negative torque (dorsiflexion) is an
    extension of the paper. `steps_per_pulse` is 2 for a pulse on one leg in each stride, as in the
    experiments; 1 for a pulse in each step, on the leg that trails; many for a single pulse, whose
    effect has died out when the gait repeats itself.

    Raises UsageError if a pulse could reach from one push-off of its leg into the next.
    """

    def __init__(
        self, parameters: WalkerParameters, torque: float, width: float, steps_per_pulse: int = 2
    ) -> None:
        self.parameters, self.torque, self.width = parameters, torque, width
        self.steps_per_pulse = steps_per_pulse
        p = parameters
        self.heel_strike, self.toe_off = p.double_stance_start, p.max_plantarflexion
        self._per_energy = 2 / (p.mass * p.leg_length**2)
        self._per_drop = 2 * p.gravity / p.leg_length
        self._kept = p.floquet_multiplier
        self._strike_gain = self._per_drop * geometry.drop(
            math.sin(p.leg_angle), math.cos(p.leg_angle)
        )
        self._start_apex = (p.speed_after_collision / p.leg_length) ** 2 - self._strike_gain
        self._step_gain = self._per_energy * p.push_off_work
        # From here on a negative pulse cancels the spring: the trailing foot is unloaded.
        self._unloaded = max(self.toe_off + min(torque, 0.0) / p.ankle_stiffness, self.heel_strike)
        here = np.array([self.heel_strike])
        plain = self._gaits(here, here, None)
        self.unperturbed_period = float(plain.period[0])
        """Period of the same number of steps without a pulse [s]."""
        step = self.unperturbed_period / steps_per_pulse
        if not 0 < width < step:
            raise UsageError(
                f"width: {width:g} s; allowed: above 0 and below a step, {step:.4g} s"
            )

    def speed(self, apex: float) -> float:
        """Speed of the mass [m/s] at the section, right after the collision."""
        return float(self.parameters.leg_length * np.sqrt(apex + self._strike_gain))

    # Branches: where the pulse begins and ends.

    def gaits(self, place: Place, angle: Floats) -> Gaits:
        """Return a branch's gaits for ankle angles where the pulse ends (EARLY) or begins."""
        if place is Place.EARLY:
            return self._gaits(np.full_like(angle, self.heel_strike), angle, place)
        if place is Place.INSIDE:
            return self._gaits(angle, self._end_of_pulse(angle), place)
        return self._gaits(angle, np.full_like(angle, self.toe_off), place)

    @cached_property
    def first_end(self) -> float:
        """Ankle angle where a pulse from heel strike on ends; toe-off if it lasts longer."""
        struck = self.heel_strike
        return first_root(
            lambda end: self._excess(np.full_like(end, struck), end), struck, self.toe_off
        )

    @cached_property
    def last_start(self) -> float:
        """Ankle angle where a pulse up to toe-off begins; heel strike if it lasts longer."""
        off = self.toe_off
        return first_root(
            lambda start: self._excess(start, np.full_like(start, off)), off, self.heel_strike
        )

    def _excess(self, start: Floats, end: Floats) -> Floats:
        """How much longer than the pulse the gait with a pulse between two angles takes [s]."""
        return self._pulse_time(start, end).time - self.width

    def _end_of_pulse(self, start: Floats) -> Floats:
        """Ankle angle where a pulse that begins at `start` ends, in the gait that it sustains."""

        def excess(end: Floats) -> tuple[Floats, Floats]:
            stretch = self._pulse_time(start, end)
            gain = self._apex_per_gain * self._per_energy * self._pulse_torque(end)
            slope = 1 / self._velocity(end, self._apex(start, end), start)
            return stretch.time - self.width, slope + stretch.by_apex * gain

        return newton(excess, start, start, self.toe_off)

    # Energy.

    @property
    def _apex_per_gain(self) -> float:
        """How much a repeated gain of squared rate raises `apex` at the section."""
        kept = self._kept**self.steps_per_pulse
        return float(kept / (1 - kept))

    def _apex(self, start: Floats, end: Floats) -> Floats:
        """`apex` of the gait that repeats itself (Eq. 8 with the pulse's work)."""
        return self._start_apex + self._apex_per_gain * self._pulse_gain(start, end)

    def _pulse_torque(self, angle: Floats) -> Floats:
        """Torque that the pulse adds at an ankle angle: all of it, or what the spring leaves."""
        spring = self.parameters.ankle_stiffness * (self.toe_off - angle)
        torque: Floats = np.maximum(self.torque, -spring)
        return torque

    def _pulse_gain(self, start: Floats, angle: Floats) -> Floats:
        """Gain in squared rate from the pulse between `start` and `angle`."""
        loaded = np.minimum(np.maximum(start, self._unloaded), angle)
        left, last = self.toe_off - loaded, self.toe_off - angle
        spring = 0.5 * self.parameters.ankle_stiffness * (left**2 - last**2)
        gain: Floats = self._per_energy * (self.torque * (loaded - start) - spring)
        return gain

    def _gain(self, angle: Floats, sine: Floats, cosine: Floats) -> Floats:
        """Gain in squared rate since heel strike from spring and height, without a pulse."""
        p = self.parameters
        work = _FORMS.torque_work(angle - self.heel_strike, p.peak_torque, p.ankle_stiffness)
        gain: Floats = self._per_energy * work + self._per_drop * _FORMS.drop(sine, cosine)
        return gain

    def _posture(self, angle: Floats) -> tuple[Floats, Floats, Floats]:
        """Sine and cosine of the leading leg's angle, and its change per ankle angle."""
        sine = _FORMS.leg_sine(self.parameters, np.cos(angle))
        cosine = np.sqrt(1 - sine**2)
        return sine, cosine, _FORMS.leg_per_ankle(self.parameters, np.sin(angle), cosine)

    def _velocity(self, angle: Floats, apex: Floats, start: Floats) -> Floats:
        """Rate of the ankle angle [rad/s] with the pulse on since `start`."""
        sine, cosine, slope = self._posture(angle)
        square = apex + self._gain(angle, sine, cosine) + self._pulse_gain(start, angle)
        velocity: Floats = np.sqrt(square) / slope
        return velocity

    # Times.

    def _stretch(
        self,
        low: Floats,
        high: Floats,
        apex: Floats,
        start: Floats | None = None,
        halvings: int = _MOST_HALVINGS,
    ) -> _Stretch:
        """Time from `low` to `high` in double stance, with the pulse on since `start`."""
        half = 0.5 * (high - low)
        angle = (low + half)[..., None] + half[..., None] * _PLACES
        sine, cosine, slope = self._posture(angle)
        square = apex[..., None] + self._gain(angle, sine, cosine)
        torque = self.parameters.ankle_stiffness * (self.toe_off - angle)
        if start is not None:
            square = square + self._pulse_gain(start[..., None], angle)
            torque = torque + self._pulse_torque(angle)
        with np.errstate(invalid="ignore", divide="ignore"):
            integrand = (slope / np.sqrt(square))[..., 1:-1]
            total = integrand @ _WEIGHTS
            tail = np.abs(integrand @ _TAILS.T).sum(axis=-1)
            by_apex = -0.5 * half * ((integrand / square[..., 1:-1]) @ _WEIGHTS)
        force = self._pendulum_force(cosine, square)
        force = force - _FORMS.unloading_arm(self.parameters, np.sin(angle), sine) * torque
        time, converged = half * total, tail <= 0.5 * _TAIL_TOLERANCE * total
        sound = (converged & (force >= 0).all(axis=-1)) | (half <= 0)
        rough = ~converged & (square > 0).all(axis=-1) & (half > 0)
        if halvings > 0 and rough.any():
            middle, fewer = (low + half)[rough], halvings - 1
            since = None if start is None else start[rough]
            first = self._stretch(low[rough], middle, apex[rough], since, fewer)
            last = self._stretch(middle, high[rough], apex[rough], since, fewer)
            time[rough] = first.time + last.time
            by_apex[rough] = first.by_apex + last.by_apex
            sound[rough] = first.sound & last.sound
        return _Stretch(time, by_apex, sound)

    def _pulse_time(self, start: Floats, end: Floats, apex: Floats | None = None) -> _Stretch:
        """Time under the pulse, in two stretches if it unloads the trailing foot."""
        if apex is None:
            apex = self._apex(start, end)
        if self._unloaded == self.toe_off:
            return self._stretch(start, end, apex, start)
        loaded = np.minimum(np.maximum(start, self._unloaded), end)
        first = self._stretch(start, loaded, apex, start)
        last = self._stretch(loaded, end, apex, start)
        return _Stretch(
            first.time + last.time, first.by_apex + last.by_apex, first.sound & last.sound
        )

    def _single_stance(self, apex: Floats) -> _Stretch:
        """
        Time of single stance: R_F, and R_D for its derivative (DLMF 19.18.1).

        A walker too slow for the apex counts as fallen even if toe-off comes after the apex.
        """
        time, by_apex = np.zeros_like(apex), np.zeros_like(apex)
        moving = np.nan_to_num(apex, nan=-1.0) > 0
        apex = np.where(moving, apex, np.nan)
        p = self.parameters
        # The way to an apex after toe-off adds to the time; that from an apex before it subtracts.
        for angle in (p.toe_off_angle, p.leg_angle):
            sign, z = math.copysign(1, angle), math.sin(angle / 2) ** 2
            x, y, w = apex * (1 - z), apex + 2 * self._per_drop * z, apex
            time += sign * 2 * math.sqrt(z) * elliprf(x, y, w)
            derivative = (1 - z) * elliprd(y, w, x) + elliprd(x, w, y) + elliprd(x, y, w)
            by_apex -= sign * math.sqrt(z) / 3 * derivative
        struck = self._pendulum_force(np.cos(p.leg_angle), apex + self._strike_gain)
        with np.errstate(invalid="ignore"):
            return _Stretch(time, by_apex, moving & (struck >= 0))

    def _pendulum_force(self, cosine: Any, square: Floats) -> Any:
        return _FORMS.pendulum_force(self.parameters, cosine, square)

    def _collide(self, apex: Floats) -> Floats:
        return self._kept * apex - (1 - self._kept) * self._strike_gain

    # The whole gait, and the derivative of the map.

    def _gaits(self, start: Floats, end: Floats, place: Place | None) -> Gaits:
        apex = self._apex(start, end)
        pulse_gain = self._pulse_gain(start, end)
        here, there = np.full_like(apex, self.heel_strike), np.full_like(apex, self.toe_off)
        before = self._stretch(here, start, apex)
        pulse = self._pulse_time(start, end, apex)
        after = self._stretch(end, there, apex + pulse_gain)
        leaving = apex + self._step_gain + pulse_gain
        swing = self._single_stance(leaving)
        double_stance = before.time + pulse.time + after.time
        step = double_stance + swing.time
        onset = pulse.time - self.width if place is Place.EARLY else before.time

        # Forward differentiation with respect to (apex, onset), in the order of the motion.
        ones, zeros, column = np.ones_like(apex), np.zeros_like(apex), np.newaxis
        d_apex, d_onset = np.stack([ones, zeros], axis=-1), np.stack([zeros, ones], axis=-1)
        begins, ends = place in (Place.INSIDE, Place.LATE), place in (Place.INSIDE, Place.EARLY)
        d_start = d_end = np.zeros_like(d_apex)
        with np.errstate(invalid="ignore"):
            at_start = self._velocity(start, apex, start)[..., column]
            at_end = self._velocity(end, apex, start)[..., column]
        if begins:
            d_start = at_start * (d_onset - before.by_apex[..., column] * d_apex)
        torque_gain = self._per_energy * self._pulse_torque(start)[..., column]
        d_pulse = pulse.by_apex[..., column] * (d_apex - torque_gain * d_start)
        if ends:
            d_acting = 0.0 if begins else d_onset
            d_end = at_end * (d_acting + d_start / at_start - d_pulse)
        d_gain = self._per_energy * self._pulse_torque(end)[..., column] * d_end
        d_leaving = d_apex + d_gain - torque_gain * d_start
        d_period = (
            before.by_apex[..., column] * d_apex
            + d_pulse
            + (after.by_apex + swing.by_apex)[..., column] * d_leaving
        )
        d_next = self._kept * d_leaving

        period, sound = step, before.sound & pulse.sound & after.sound & swing.sound
        arriving = self._collide(leaving)
        for _ in range(self.steps_per_pulse - 1):
            double = self._stretch(here, there, arriving)
            swing = self._single_stance(arriving + self._step_gain)
            period = period + double.time + swing.time
            d_period = d_period + (double.by_apex + swing.by_apex)[..., column] * d_next
            d_next = self._kept * d_next
            sound = sound & double.sound & swing.sound
            arriving = self._collide(arriving + self._step_gain)
        jacobian = np.stack([d_next, d_onset - d_period], axis=-2)
        return Gaits(start, end, onset, period, apex, double_stance, step, jacobian, sound)
