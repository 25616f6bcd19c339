# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The exact walker (docs/model.md).

    model           the parameters, prepared for the compiled functions
    single_stance   the inverted pendulum: elliptic integrals
    segment         state between switches, energy, time as a quadrature
    location        position at a given time: the inverse of the quadrature
    transitions     guards and resets
    trajectory      the loop from switch to switch
    sampling        posture, torques and forces at any time
    promise         the torque promised by the ankle robot
    walker          the walker itself, advanced in time
"""

from gait_entrainment.walker.sampling import Samples
from gait_entrainment.walker.segment import Stance
from gait_entrainment.walker.walker import Ending, EndingKind, Transition, Walker
