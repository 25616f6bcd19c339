# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The closed forms of the linkage, compiled."""

from collections.abc import Callable

from gait_entrainment import geometry
from gait_entrainment.walker.compiled import compiled

Form = Callable[..., float]

ankle_cosine: Form = compiled(geometry.ankle_cosine)
drop: Form = compiled(geometry.drop)
leg_per_ankle: Form = compiled(geometry.leg_per_ankle)
leg_sine: Form = compiled(geometry.leg_sine)
pendulum_force: Form = compiled(geometry.pendulum_force)
spring_torque: Form = compiled(geometry.spring_torque)
torque_work: Form = compiled(geometry.torque_work)
trailing_force: Form = compiled(geometry.trailing_force)
trailing_leg_angle: Form = compiled(geometry.trailing_leg_angle)
trailing_leg_per_ankle: Form = compiled(geometry.trailing_leg_per_ankle)
trailing_reach: Form = compiled(geometry.trailing_reach)
unloading_arm: Form = compiled(geometry.unloading_arm)
