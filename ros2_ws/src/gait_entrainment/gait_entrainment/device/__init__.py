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

"""The ankle robot: pulse trains in, promised torque profiles out."""

from gait_entrainment.device.drivers import find_driver
from gait_entrainment.device.ideal import IdealAnkleRobot
from gait_entrainment.device.limits import DeviceLimits, LimitError
from gait_entrainment.device.profile import TorqueProfile
from gait_entrainment.device.pulse_train import PulseTrain

__all__ = [
    "DeviceLimits",
    "IdealAnkleRobot",
    "LimitError",
    "PulseTrain",
    "TorqueProfile",
    "find_driver",
]
