# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Extensions of the paper: stride-to-stride variability, asymmetry of the legs, slope of the ground.

    population   many walkers stepping at once
    noise        white or long-range correlated, seeded, truncated
    walk         walks with pulses planned on the way; intermittent locking
"""

from gait_entrainment_studies.variability.noise import step_noise
from gait_entrainment_studies.variability.population import Population, Steps
from gait_entrainment_studies.variability.walk import (
    PopulationWalk,
    PopulationWalker,
    PulseTrains,
    locked_runs,
    noise_for,
)

__all__ = [
    "Population",
    "PopulationWalk",
    "PopulationWalker",
    "PulseTrains",
    "Steps",
    "locked_runs",
    "noise_for",
    "step_noise",
]
