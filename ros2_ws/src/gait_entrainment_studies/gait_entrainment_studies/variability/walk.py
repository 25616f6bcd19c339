# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Walks of a population with noise, with or without pulses, and how the pulses lock in them."""

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from gait_entrainment_studies.locking.pulsed_gait import Floats
from gait_entrainment_studies.variability.noise import step_noise
from gait_entrainment_studies.variability.population import Population

# Strides of the pilot walk that finds the noise for a coefficient of variation, and its rounds.
_PILOT_STRIDES = 400
_PILOT_ROUNDS = 2
_PILOT_NOISE = 0.02


# What numpy's generators are seeded with.
Seed = int | tuple[int, ...]


@dataclass(frozen=True)
class PulseTrains:
    """One train of pulses per walker, on the leg of heel strike 0: arrays (n,)."""

    first_onset: Floats
    period: Floats
    count: int
    torque: Floats
    width: float


@dataclass(frozen=True)
class PopulationWalk:
    """Events [s] of n walkers since heel strike 0 of the perturbed leg; NaN after an end."""

    heel_strikes: Floats
    """(steps + 1, n), both legs; even ones are the perturbed leg's."""
    toe_offs: Floats
    """(steps, n), in step s the toe-off after heel strike s."""
    fell: NDArray[np.bool_]
    flew_off: NDArray[np.bool_]

    @property
    def stride_periods(self) -> Floats:
        """(strides, n) durations of the perturbed leg's strides."""
        return np.diff(self.heel_strikes[::2], axis=0)


class PopulationWalker:
    """
    Walks a population step by step.

    `noise` (n,) is the standard deviation of the push-off stiffness over its mean, `hurst` its
    correlation (see `noise`), `asymmetry` the excess of the perturbed leg's stiffness.
    """

    def __init__(
        self,
        population: Population,
        steps: int,
        seed: Seed,
        noise: Floats,
        hurst: float = 0.5,
        asymmetry: float = 0.0,
    ) -> None:
        if not -1 < asymmetry < 1:
            raise ValueError(f"asymmetry {asymmetry:g} is out of range; allowed: -1 to 1")
        self._population = population
        size = population.size
        draws = step_noise(np.random.default_rng(seed), steps, size, hurst)
        # In odd steps the perturbed leg trails and pushes off.
        sides = np.where(np.arange(steps)[:, None] % 2 == 1, 1 + asymmetry, 1 - asymmetry)
        self._stiffness = population.stiffness * sides * np.clip(1 + noise * draws, 0.01, None)
        # In the gait of this slope and these legs: no transient enters period or variation.
        mean = population.stiffness
        self._apex = population.periodic_apex(mean * (1 - asymmetry), mean * (1 + asymmetry))
        self._strikes = np.full((steps + 1, size), np.nan)
        self._strikes[0] = 0.0
        self._toe_offs = np.full((steps, size), np.nan)
        self._fell = self._flew = np.zeros(size, bool)
        self.steps = 0

    def walk(self, until_step: int, pulses: PulseTrains | None = None) -> PopulationWalk:
        """Go on to a step; the pulses may be given later, as they are planned from the walk."""
        nothing = np.zeros(self._population.size)
        for step in range(self.steps, until_step):
            now = self._strikes[step]
            onset, torque, width = nothing, nothing, 1.0
            if pulses is not None and step % 2 == 1:
                width = pulses.width
                # The first pulse that has not ended yet; no two reach into one double stance.
                with np.errstate(invalid="ignore"):
                    number = np.ceil((now - width - pulses.first_onset) / pulses.period)
                    given = (number >= 0) & (number < pulses.count)
                onset = np.where(given, pulses.first_onset + number * pulses.period - now, 0.0)
                torque = np.where(given, pulses.torque, 0.0)
            made = self._population.step(self._apex, self._stiffness[step], onset, width, torque)
            walking = ~np.isnan(now)
            self._fell = self._fell | (walking & made.fell)
            self._flew = self._flew | (walking & made.flew_off)
            self._apex = made.apex
            self._strikes[step + 1] = now + made.duration
            self._toe_offs[step] = now + made.double_stance
        self.steps = until_step
        return PopulationWalk(
            self._strikes[: until_step + 1], self._toe_offs[:until_step], self._fell, self._flew
        )


def noise_for(
    population: Population, coefficient_of_variation: Floats, seed: Seed, hurst: float = 0.5
) -> Floats:
    """
    Return the noise (n,) with which each walker's stride period varies by this coefficient.

    Found by pilot walks, in which the coefficient is nearly proportional to the noise. Of a walker
    that falls in them the strides before the fall count; it may fall in the experiment too.
    """
    noise = np.full(population.size, _PILOT_NOISE)
    for _ in range(_PILOT_ROUNDS):
        walker = PopulationWalker(population, 2 * _PILOT_STRIDES, seed, noise, hurst)
        found = coefficients_of_variation(walker.walk(2 * _PILOT_STRIDES).stride_periods)
        # One that fell before its third stride tells nothing new.
        noise = np.where(found > 0, noise * coefficient_of_variation / found, noise)
    return noise


def coefficients_of_variation(stride_periods: Floats) -> Floats:
    """Of each walker (n,), from stride periods (strides, n) up to an end; NaN for fewer than 2."""
    walked = np.ma.masked_invalid(stride_periods)
    found = walked.std(axis=0, ddof=1) / walked.mean(axis=0)
    coefficients: Floats = np.ma.filled(found, np.nan)
    return coefficients


def locked_runs(lags: Floats, locked_lag: float, tolerance: float) -> tuple[float, list[int]]:
    """
    Return the fraction of strides locked, and the lengths of the runs of them.

    A stride is locked while its pulse lies within `tolerance` [s] of the lock of the walker
    without noise.
    """
    near = np.abs(lags - locked_lag) <= tolerance
    runs = [len(list(run)) for locked, run in groupby(near.tolist()) if locked]
    return float(near.mean()) if near.size else float("nan"), runs
