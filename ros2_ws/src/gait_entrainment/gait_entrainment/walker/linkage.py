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
