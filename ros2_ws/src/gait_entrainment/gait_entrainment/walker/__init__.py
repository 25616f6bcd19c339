# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

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
"""

from gait_entrainment.walker.sampling import Samples
from gait_entrainment.walker.segment import Stance
from gait_entrainment.walker.walker import Ending, EndingKind, Transition, Walker
