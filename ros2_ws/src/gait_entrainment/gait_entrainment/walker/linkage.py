# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The closed forms of the linkage, compiled."""

from gait_entrainment import geometry
from gait_entrainment.walker.compiled import compiled

ankle_cosine = compiled(geometry.ankle_cosine)
drop = compiled(geometry.drop)
leg_per_ankle = compiled(geometry.leg_per_ankle)
leg_sine = compiled(geometry.leg_sine)
pendulum_force = compiled(geometry.pendulum_force)
torque_work = compiled(geometry.torque_work)
trailing_force = compiled(geometry.trailing_force)
trailing_leg_angle = compiled(geometry.trailing_leg_angle)
trailing_leg_per_ankle = compiled(geometry.trailing_leg_per_ankle)
trailing_reach = compiled(geometry.trailing_reach)
unloading_arm = compiled(geometry.unloading_arm)
