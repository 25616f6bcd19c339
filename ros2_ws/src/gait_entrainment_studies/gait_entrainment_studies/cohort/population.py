# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Many walkers with features that the paper's model does not have. An extension: off elsewhere.

They are the exact walker, step by step, with

- noise: the stiffness of each push-off is drawn separately;
- asymmetry: the perturbed leg pushes off with (1 + a) k, the other with (1 - a) k;
- slope: the ground rises by an angle, so gravity is tilted by it.

Arrays have one column for each of the n walkers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.geometry import torque_work
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import EndingKind
from gait_entrainment.walker.model import Floats, make_model
from gait_entrainment.walker.variation import LEAST, Seed, made_for_any_stiffness, step_noise
from gait_entrainment_studies.walks import NO_PULSES, Pulses, walk

# Strides of the pilot walk that finds the noise for a coefficient of variation, and how often.
_PILOT_STRIDES = 400
_PILOT_ROUNDS = 2
_PILOT_NOISE = 0.02


@dataclass(frozen=True)
class PulseTrains:
    """One train of pulses per walker, on the leg of heel strike 0; arrays (n,)."""

    first_onset: Floats
    period: Floats
    count: int
    torque: Floats
    width: float

    def of(self, walker: int) -> Pulses:
        """Return the pulses of one walker; none if it fell before they were planned."""
        onsets = self.first_onset[walker] + np.arange(self.count) * self.period[walker]
        if not np.isfinite(onsets).all():
            return NO_PULSES
        stamps = np.rint(onsets * NANOSECONDS_PER_SECOND).astype(np.int64)
        return Pulses(stamps, nanoseconds(self.width), float(self.torque[walker]))


@dataclass(frozen=True)
class PopulationWalk:
    """Events [s] of n walkers since heel strike 0 of the perturbed leg; NaN once one has ended."""

    heel_strikes: Floats
    """(steps + 1, n), both legs; even ones are the perturbed leg's."""
    toe_offs: Floats
    """(steps, n), in step s the toe-off after heel strike s."""
    endings: list[EndingKind | None]
    """How each ended before its last step, if it did."""

    @property
    def stride_periods(self) -> Floats:
        """(strides, n) durations of the perturbed leg's strides."""
        return np.diff(self.heel_strikes[::2], axis=0)


class Population:
    """
    Walkers (n,), on ground that rises by `slope` [rad], with legs that differ by `asymmetry`.

    Raises UsageError if a walker could not stand on the slope, or push off with both legs.
    """

    def __init__(
        self, walkers: Sequence[WalkerParameters], slope: float = 0.0, asymmetry: float = 0.0
    ) -> None:
        steepest = min(walker.leg_angle for walker in walkers)
        if not abs(slope) < steepest:
            raise UsageError(
                f"slope: {slope:g} rad; allowed: within the leg angle, {steepest:.4g} rad"
            )
        if not -1 < asymmetry < 1:
            raise UsageError(f"asymmetry: {asymmetry:g}; allowed: above -1 and below 1")
        self.size = len(walkers)
        self._models = [
            made_for_any_stiffness(make_model(walker, slope), walker.ankle_stiffness)
            for walker in walkers
        ]
        # In even steps the leg that is not perturbed trails and pushes off.
        self._sides = 1 - asymmetry, 1 + asymmetry

    def periodic_apex(self) -> Floats:
        """`apex` (n,) right after heel strike 0 that repeats itself every stride without noise."""
        return np.array([self._periodic_apex(model) for model in self._models])

    def _periodic_apex(self, model: Any) -> float:
        apex, kept = 0.0, model["restitution"]
        turn = model["max_plantarflexion"] - model["double_stance_start"]
        # A step maps the apex linearly; from zero, two of them give the map's constant.
        for side in self._sides:
            k = side * model["ankle_stiffness"]
            apex += model["per_energy"] * torque_work(turn, k * turn, k)
            apex = kept * (apex + model["strike_gain"]) - model["start_gain"]
        return float(apex / (1 - kept**2))

    def walk(
        self, noise: Floats, trains: PulseTrains | None = None, apex: Floats | None = None
    ) -> PopulationWalk:
        """
        Walk with `noise` (steps, n), the deviation of each push-off's stiffness over its mean.

        The walk begins with `apex` (n,); by default with that of the gait on this slope and with
        these legs, so that no transient affects period or variation.
        """
        steps = len(noise)
        strikes = np.full((steps + 1, self.size), np.nan)
        offs = np.full((steps, self.size), np.nan)
        factors = np.resize(self._sides, steps)[:, None] * np.clip(1 + noise, LEAST, None)
        apex = self.periodic_apex() if apex is None else apex
        endings: list[EndingKind | None] = []
        for index, model in enumerate(self._models):
            own = model.copy()
            pulses = NO_PULSES if trains is None else trains.of(index)
            walked = walk(
                own, steps, pulses, apex[index], own["ankle_stiffness"] * factors[:, index]
            )
            strikes[: walked.heel_strikes.size, index] = walked.heel_strikes
            offs[: walked.toe_offs.size, index] = walked.toe_offs
            endings.append(walked.ending)
        return PopulationWalk(strikes, offs, endings)


def noise_for(
    population: Population, coefficient_of_variation: Floats, seed: Seed, hurst: float = 0.5
) -> Floats:
    """
    Return the noise (n,) with which each walker's stride period varies by this coefficient.

    The noise is the standard deviation of the push-off stiffness over its mean. It is found by
    pilot walks, in which the coefficient is nearly proportional to it. If a walker falls in them,
    the strides before the fall count; it may also fall in the experiment.
    """
    draws = step_noise(seed, 2 * _PILOT_STRIDES, population.size, hurst)
    noise = np.full(population.size, _PILOT_NOISE)
    for _ in range(_PILOT_ROUNDS):
        periods = np.ma.masked_invalid(population.walk(noise * draws).stride_periods)
        found = np.ma.filled(periods.std(axis=0, ddof=1) / periods.mean(axis=0), np.nan)
        # A walker that fell before its third stride adds no information.
        noise = np.where(found > 0, noise * coefficient_of_variation / found, noise)
    return noise
