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

from gait_entrainment.device.drivers import Driver, driver_names, find_driver
from gait_entrainment.device.faults import DeviceError, Fault, LimitError
from gait_entrainment.device.guard import GuardedRobot
from gait_entrainment.device.limits import DeviceLimits
from gait_entrainment.device.measured_onsets import MeasuredOnsets
from gait_entrainment.device.profile import TorqueProfile
from gait_entrainment.device.pulse_train import PulseTrain
from gait_entrainment.device.robot import AnkleRobot, Capabilities, RobotState
from gait_entrainment.device.timing import PulseTiming, TimingAudit, measured_onset

__all__ = [
    "AnkleRobot",
    "Capabilities",
    "DeviceError",
    "DeviceLimits",
    "Driver",
    "Fault",
    "GuardedRobot",
    "LimitError",
    "MeasuredOnsets",
    "PulseTiming",
    "PulseTrain",
    "RobotState",
    "TimingAudit",
    "TorqueProfile",
    "driver_names",
    "find_driver",
    "measured_onset",
]
