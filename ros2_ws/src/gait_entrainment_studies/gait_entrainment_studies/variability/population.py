# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Many walkers stepping at once, past the paper's limits. An extension: off in everything else.

Each column of the arrays is a walker of its own, and each step may have its own stiffness. What
the paper's model does not have, each zero unless it is asked for:

- noise: the stiffness of each push-off is drawn anew;
- asymmetry: the perturbed leg pushes off with (1 + a) k, the other with (1 - a) k;
- slope: the ground rises by an angle gamma, so gravity leans by gamma and heights are
  1 - cos(theta + gamma).

The equations are those of `locking.PulsedGait`, but a step begins with any speed and the pulse at
any time, so the ankle angles where it begins and ends are found by Newton steps on the time.
Times are good to about 1e-9 s, and to 1e-5 s where a negative pulse unloads the trailing foot.
"""

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import elliprf

from gait_entrainment import geometry
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.pulsed_gait import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_PLACES = np.concatenate([[-1.0], _NODES, [1.0]])

# A place at a given time: steps, the last angle that they move it by [rad], and the time that may
# be missing there [s]: more is missing where the walker comes to rest before.
_MOST_STEPS = 60
_ANGLE_STEP = 1e-12
_TIME_STEP = 1e-6

_leg_sine: Any = geometry.leg_sine
_leg_per_ankle: Any = geometry.leg_per_ankle
_unloading_arm: Any = geometry.unloading_arm


class Steps(NamedTuple):
    """One step of every walker; NaN where it fell or flew off."""

    apex: Floats
    """State of the speed right after the next heel strike."""
    duration: Floats
    double_stance: Floats
    fell: NDArray[np.bool_]
    flew_off: NDArray[np.bool_]


class _Stretch(NamedTuple):
    time: Floats
    slowest: Floats
    force: Floats


class Population:
    """
    Walkers (n,), on ground that rises by `slope` [rad].

    Raises ValueError for a slope that no walker could stand on.
    """

    def __init__(self, walkers: Sequence[WalkerParameters], slope: float = 0.0) -> None:
        def column(name: str) -> Floats:
            return np.array([[getattr(walker, name)] for walker in walkers])

        self.size = len(walkers)
        lengths = ("leg_length", "foot_length", "toe_separation")
        self._body = SimpleNamespace(**{name: column(name) for name in lengths})
        self._length = self._body.leg_length
        self._mass = column("mass")
        self._gravity, self._angle = column("gravity"), column("leg_angle")
        self._start, self._off = column("double_stance_start"), column("max_plantarflexion")
        self._toe_off_angle = column("toe_off_angle")
        self._kept = column("floquet_multiplier")
        self._per_energy = 2 / (self._mass * self._length**2)
        self._per_drop = 2 * self._gravity / self._length
        self.stiffness = column("ankle_stiffness")[:, 0]
        self.slope = slope
        if not abs(slope) < float(self._angle.min()):
            raise ValueError(
                f"slope {slope:g} rad is out of range; allowed: within the leg angle,"
                f" {float(self._angle.min()):.4g} rad"
            )

    def periodic_apex(self, first: Floats, second: Floats) -> Floats:
        """
        State of the speed that repeats itself every two steps without noise.

        `first` and `second` are the stiffness [N m/rad] of the two push-offs; arrays (n,).
        """
        none = np.zeros_like(self._angle)
        apex, kept = none, self._kept
        # A step maps the state linearly; from zero, two of them give the map's constant.
        for k in (first, second):
            leaving = apex + self._per_energy * self._work(
                self._start, self._off, k[:, None], none
            )
            apex = kept * (leaving + self._height_gain(-self._angle))
            apex = apex - self._height_gain(self._angle)
        repeated: Floats = (apex / (1 - kept**2))[:, 0]
        return repeated

    def step(
        self, apex: Floats, stiffness: Floats, onset: Floats, width: float, torque: Floats
    ) -> Steps:
        """
        Walk one step from right after a heel strike.

        The trailing ankle has this stiffness [N m/rad] and gets a pulse of `torque` [N m] and
        `width` [s] at `onset` [s] after the heel strike; before it if negative. Arrays (n,).
        """
        k, pulse = stiffness[:, None], torque[:, None]
        none = np.zeros_like(pulse)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            energy, low, elapsed = apex[:, None], self._start, np.zeros((self.size, 1))
            slowest, force = np.full((self.size, 1), np.inf), np.full((self.size, 1), np.inf)
            pieces = [(onset[:, None], none), (onset[:, None] + width, pulse)]
            last = [(np.full((self.size, 1), np.inf), none)]
            for edge, acting in pieces + last if torque.any() else last:
                whole = self._stretch(low, self._off, energy, k, acting)
                left = np.clip(edge - elapsed, 0.0, None)
                # One that would fall under a lasting pulse may still outlive this one.
                inside = np.isfinite(left) & ~(left >= whole.time)
                high, done = self._off, whole
                if inside.any():
                    place = self._place(low, np.where(inside, left, 0.0), energy, k, acting)
                    high = np.where(inside, place, self._off)
                    done = self._stretch(low, high, energy, k, acting)
                # What lies beyond the edges of the pulse has not been walked under it.
                walked = high > low
                slowest = np.fmin(slowest, np.where(walked, done.slowest, np.inf))
                force = np.fmin(force, np.where(walked, done.force, np.inf))
                energy = energy + self._per_energy * self._work(low, high, k, acting)
                elapsed = elapsed + np.where(inside, left, whole.time)
                low = high
            swing = self._single_stance(energy)
            before = energy + self._height_gain(-self._angle)
            struck = np.cos(-self._angle + self.slope) * self._gravity - self._length * before
            fell = ~((slowest > 0) & (energy > 0))
            flew = ~fell & ~((force >= 0) & (struck >= 0))
            ended = fell | flew
            after = self._kept * before - self._height_gain(self._angle)
            duration = elapsed + swing
        return Steps(
            apex=np.where(ended, np.nan, after)[:, 0],
            duration=np.where(ended, np.nan, duration)[:, 0],
            double_stance=np.where(ended, np.nan, elapsed)[:, 0],
            fell=fell[:, 0],
            flew_off=flew[:, 0],
        )

    def _height_gain(self, angle: Floats) -> Floats:
        """Squared rate at an angle theta over that at the apex, by height alone."""
        gain: Floats = self._per_drop * (1 - np.cos(angle + self.slope))
        return gain

    def _work(self, low: Floats, angle: Floats, k: Floats, torque: Floats) -> Floats:
        """Work of spring and pulse from `low` on; none once the pulse has eaten up the spring."""
        first = np.maximum(k * (self._off - low) + torque, 0.0)
        turned = np.minimum(angle - low, first / k)
        work: Floats = turned * (first - 0.5 * k * turned)
        return work

    def _posture(self, psi: Floats) -> tuple[Floats, Floats, Floats]:
        sine = _leg_sine(self._body, np.cos(psi))
        cosine = np.sqrt(1 - sine**2)
        return sine, cosine, _leg_per_ankle(self._body, np.sin(psi), cosine)

    def _square(
        self, low: Floats, psi: Floats, energy: Floats, k: Floats, torque: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Squared rate at psi; sine and transmission there."""
        sine, cosine, slope = self._posture(psi)
        leaned = cosine * math.cos(self.slope) - sine * math.sin(self.slope)
        square = energy + self._per_energy * self._work(low, psi, k, torque)
        return square + self._per_drop * (1 - leaned), sine, slope

    def _stretch(
        self, low: Floats, high: Floats, energy: Floats, k: Floats, torque: Floats
    ) -> _Stretch:
        half = 0.5 * (high - low)
        psi = low + half * (1 + _PLACES)
        square, sine, slope = self._square(low, psi, energy, k, torque)
        time = half * ((slope / np.sqrt(square))[:, 1:-1] @ _WEIGHTS)[:, None]
        theta = np.arcsin(sine)
        push = np.maximum(k * (self._off - psi) + torque, 0.0)
        held = self._gravity * np.cos(theta + self.slope) - self._length * square
        force = self._mass * held - _unloading_arm(self._body, np.sin(psi), sine) * push
        return _Stretch(time, square.min(axis=1, keepdims=True), force.min(axis=1, keepdims=True))

    def _place(
        self, low: Floats, left: Floats, energy: Floats, k: Floats, torque: Floats
    ) -> Floats:
        """Ankle angle after this time; NaN where the walker comes to rest before."""
        psi, first, last = low, low, self._off
        for _ in range(_MOST_STEPS):
            square, _, slope = self._square(low, psi, energy, k, torque)
            missing = left - self._stretch(low, psi, energy, k, torque).time
            # NaN: past the place of rest.
            short = missing > 0
            first, last = np.where(short, psi, first), np.where(short, last, psi)
            following = psi + missing * np.sqrt(square) / slope
            within = (first <= following) & (following <= last)
            following = np.where(within, following, 0.5 * (first + last))
            step, psi = np.abs(following - psi), following
            if not ((step > _ANGLE_STEP) & np.isfinite(energy)).any():
                break
        found: Floats = np.where(np.abs(missing) < _TIME_STEP, psi, np.nan)
        return found

    def _single_stance(self, energy: Floats) -> Floats:
        """Time from toe-off to heel strike, from and to the apex by R_F."""
        total = np.zeros_like(energy)
        energy = np.where(energy > 0, energy, np.nan)
        for angle in (self._toe_off_angle + self.slope, self._angle - self.slope):
            z = np.sin(angle / 2) ** 2
            arguments = energy * (1 - z), energy + 2 * self._per_drop * z, energy
            total += np.sign(angle) * 2 * np.sqrt(z) * elliprf(*arguments)
        return total
