# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Seeded noise from step to step: white, or with long-range correlation."""

import numpy as np

from gait_entrainment.errors import UsageError
from gait_entrainment_studies.locking.roots import Floats

# What numpy's generators are seeded with.
Seed = int | tuple[int, ...]

# Draws beyond this many standard deviations are cut off: no step has an absurd push-off.
TRUNCATION = 3.0


def step_noise(seed: Seed, steps: int, size: int, hurst: float = 0.5) -> Floats:
    """
    Return fractional Gaussian noise (steps, size) of unit variance, truncated.

    With `hurst` 0.5 it is white; above, up to 1, neighbours resemble each other over long
    stretches (strides of adults: about 0.75). By circulant embedding (Davies and Harte 1987),
    which is exact.

    Raises UsageError for a Hurst exponent out of range.
    """
    if not 0.5 <= hurst < 1:
        raise UsageError(f"hurst: {hurst:g}; allowed: at least 0.5, which is white, and below 1")
    generator, lags = np.random.default_rng(seed), np.arange(steps + 1.0)
    power = 2 * hurst
    covariance = 0.5 * (np.abs(lags + 1) ** power - 2 * lags**power + np.abs(lags - 1) ** power)
    circulant = np.concatenate([covariance, covariance[-2:0:-1]])
    spectrum = np.clip(np.fft.fft(circulant).real, 0.0, None)
    shape = size, circulant.size
    white = generator.standard_normal(shape) + 1j * generator.standard_normal(shape)
    noise = np.fft.fft(white * np.sqrt(spectrum / circulant.size)).real[:, :steps]
    truncated: Floats = np.clip(noise.T, -TRUNCATION, TRUNCATION)
    return truncated
