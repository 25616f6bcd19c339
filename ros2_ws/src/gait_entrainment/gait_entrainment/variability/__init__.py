# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Extensions of the paper: stride-to-stride variability, asymmetry of the legs, slope of the ground.

    population   many walkers stepping at once
    noise        white or long-range correlated, seeded, truncated
    walk         walks with pulses planned on the way; intermittent locking
"""

from gait_entrainment.variability.noise import step_noise
from gait_entrainment.variability.population import Population, Steps
from gait_entrainment.variability.walk import (
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
