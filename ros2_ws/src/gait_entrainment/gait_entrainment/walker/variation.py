# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A walker whose strides vary: each push-off has a random stiffness, with long-range correlation.

More push-off work makes the following steps faster, until the collisions have absorbed it.
"""

from typing import Any, Final

import numpy as np

from gait_entrainment.errors import UsageError
from gait_entrainment.geometry import torque_work
from gait_entrainment.parameters import Variation
from gait_entrainment.walker.model import NODES, Floats

Seed = int | tuple[int, ...]

# Noise is cut off at this many standard deviations: no step has an absurd push-off.
TRUNCATION: Final = 3.0
# Fraction of a push-off's stiffness that noise leaves at least.
LEAST: Final = 0.01
# Steps after which the noise repeats: 17 hours of walking.
REPETITION: Final = 2**16
# Steps over which a disturbance is followed: less than half of it is left after each.
MEMORY: Final = 60


def step_noise(seed: Seed, steps: int, size: int, hurst: float = 0.5) -> Floats:
    """
    Return fractional Gaussian noise (steps, size) of unit variance, truncated.

    With `hurst` 0.5 the noise is white; above that, up to 1, it is correlated over many steps
    (strides of adults: about 0.75). It is made by circulant embedding (Davies and Harte,
    Biometrika 74, 95, 1987), which is exact. Raises UsageError if `hurst` is out of range.
    """
    if not 0.5 <= hurst < 1:
        raise UsageError(f"hurst: {hurst:g}; allowed: at least 0.5 (white) and below 1")
    generator, covariance = np.random.default_rng(seed), _covariance(steps, hurst)
    circulant = np.concatenate([covariance, covariance[-2:0:-1]])
    spectrum = np.clip(np.fft.fft(circulant).real, 0.0, None)
    shape = size, circulant.size
    white = generator.standard_normal(shape) + 1j * generator.standard_normal(shape)
    noise = np.fft.fft(white * np.sqrt(spectrum / circulant.size)).real[:, :steps]
    truncated: Floats = np.clip(noise.T, -TRUNCATION, TRUNCATION)
    return truncated


def _covariance(lags: int, hurst: float) -> Floats:
    lag, power = np.arange(lags + 1.0), 2 * hurst
    return np.asarray(0.5 * ((lag + 1) ** power - 2 * lag**power + np.abs(lag - 1) ** power))


def made_for_any_stiffness(model: Any, stiffness: float) -> Any:
    """
    Return a copy of a walker's constants (`Model`) with this stiffness, which may then be changed.

    Every double stance is then computed by quadrature and searched for a fall or fly-off.
    """
    made = model.copy()
    made["whole_double_stance_apex"], made["least_gain"] = np.inf, -np.inf
    made["ankle_stiffness"] = stiffness
    return made


def push_off_stiffness(model: Any, variation: Variation, seed: Seed) -> Floats:
    """Return the push-off stiffness [N m/rad] of each of REPETITION steps."""
    noise = step_noise(seed, REPETITION, 1, variation.exponent)[:, 0]
    noise *= variation.coefficient / stride_response(model, variation.exponent)
    return np.asarray(model["ankle_stiffness"] * np.maximum(1 + noise, LEAST))


def stride_response(model: Any, hurst: float) -> float:
    """
    Stride period's coefficient of variation divided by the stiffness's, while both are small.

    With u(n) the relative deviation of the stiffness, x(n) the deviation of `apex` from that of
    the period-one gait, step n takes T + b u(n) + a x(n), and x(n + 1) = r (x(n) + e u(n)) after
    the collision. So the stride period is a filtered u; the autocovariance gives its variance.
    """
    turn = model["max_plantarflexion"] - model["double_stance_start"]
    stiffness, apex, kept = (model[n] for n in ("ankle_stiffness", "start_apex", "restitution"))
    turned: Any = np.append(0.5 * turn * (1 + model["rule"][NODES]), turn)
    work = model["per_energy"] * torque_work(turned, stiffness * turn, stiffness)
    gained, energy = work[:-1], work[-1]
    (gain, weights), (later_gain, later_weights) = (
        model[f"whole_{stance}_stance"] for stance in ("double", "single")
    )
    square, later = apex + gain, apex + energy + later_gain
    period = weights @ square**-0.5 + later_weights @ later**-0.5
    slower, slower_later = weights * square**-1.5, later_weights * later**-1.5
    by_apex = -0.5 * (slower.sum() + slower_later.sum())
    by_stiffness = -0.5 * (slower @ gained + energy * slower_later.sum())
    step = np.append(by_stiffness, by_apex * energy * kept ** np.arange(1.0, MEMORY))
    stride = (np.append(step, 0.0) + np.append(0.0, step)) / (2 * period)
    place = np.arange(stride.size)
    between = _covariance(MEMORY, hurst)[np.abs(np.subtract.outer(place, place))]
    return float(np.sqrt(stride @ between @ stride))
