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
The exact walker (docs/model.md).

    model           the parameters, prepared
    single_stance   the inverted pendulum: elliptic integrals
    segment         state between switches, energy, time as a quadrature
    location        the quadrature, inverted: where at a given time
    transitions     guards and resets
    trajectory      the loop from switch to switch
    sampling        posture, torques, forces at any instant
    promise         the torque promised by the ankle robot
    walker          all of it in time
    batch           whole walks in one call, and the step-to-step function
    run             one run of it, with the account that a node must report
"""

from gait_entrainment.walker.batch import Pulses, Step, Walk, step_to_step, walk
from gait_entrainment.walker.run import Stretch, WalkerRun
from gait_entrainment.walker.sampling import Samples
from gait_entrainment.walker.segment import Phase
from gait_entrainment.walker.walker import Ending, EndingKind, Transition, Walker

__all__ = [
    "Ending",
    "EndingKind",
    "Phase",
    "Pulses",
    "Samples",
    "Step",
    "Stretch",
    "Transition",
    "Walk",
    "Walker",
    "WalkerRun",
    "step_to_step",
    "walk",
]
