# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Simulated subjects, drawn from stated distributions. An extension: the paper has none."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import ParameterError, WalkerParameters
from gait_entrainment_studies.locking.roots import Floats


def _normal(mean: float, deviation: float, meaning: str) -> Any:
    return field(default=(mean, deviation), metadata={"meaning": meaning})


@dataclass(frozen=True)
class SubjectDistributions:
    """
    Normal distributions (mean, standard deviation), cut off at two standard deviations.

    They are our assumptions for adults in general: those of the human study are not known here.

    Raises UsageError for a mean or deviation out of range.
    """

    leg_length: tuple[float, float] = _normal(0.92, 0.05, "leg length [m]")
    mass: tuple[float, float] = _normal(75.0, 12.0, "mass [kg]")
    peak_torque: tuple[float, float] = _normal(
        0.17, 0.01, "peak ankle torque over body weight x leg length"
    )
    variation: tuple[float, float] = _normal(
        0.02, 0.005, "coefficient of variation of the stride period"
    )

    def __post_init__(self) -> None:
        """Check each distribution."""
        for item in fields(self):
            mean, deviation = getattr(self, item.name)
            # Two deviations below the mean must still be positive.
            if not (mean > 2 * deviation >= 0 and mean < np.inf):
                raise UsageError(
                    f"{item.name}: {mean:g} +/- {deviation:g}; allowed: a mean above twice the"
                    " deviation, neither negative"
                )


@dataclass(frozen=True)
class Subjects:
    """The subjects drawn, and how many were drawn again because they had no gait."""

    walkers: tuple[WalkerParameters, ...]
    variation: Floats
    redrawn: int


def draw_subjects(distributions: SubjectDistributions, count: int, seed: int) -> Subjects:
    """Draw subjects; feet are 0.2 leg lengths and angles those of Table 1, as in the paper."""
    generator, names = np.random.default_rng(seed), [item.name for item in fields(distributions)]
    table_1 = WalkerParameters()
    turn = table_1.max_plantarflexion - table_1.double_stance_start
    walkers: list[WalkerParameters] = []
    variations: list[float] = []
    redrawn = 0
    while len(walkers) < count:
        length, mass, peak, variation = (
            _truncated(generator, *getattr(distributions, name)) for name in names
        )
        try:
            walker = WalkerParameters(
                mass=mass,
                leg_length=length,
                foot_length=0.2 * length,
                ankle_stiffness=peak * mass * table_1.gravity * length / turn,
            )
        except ParameterError:
            redrawn += 1
            if redrawn > 20 * count:
                raise UsageError(
                    "peak_torque: hardly any subject drawn has a gait; allowed: about 0.14 to 0.21"
                ) from None
            continue
        walkers.append(walker)
        variations.append(variation)
    return Subjects(tuple(walkers), np.array(variations), redrawn)


def _truncated(generator: np.random.Generator, mean: float, deviation: float) -> float:
    while True:
        value = generator.standard_normal()
        if abs(value) <= 2:
            return float(mean + deviation * value)
