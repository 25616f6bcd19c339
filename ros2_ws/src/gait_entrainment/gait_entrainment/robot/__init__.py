# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The ankle robot: pulse trains in, promised torque profiles out."""

from gait_entrainment.robot.contract import AnkleRobot, Capabilities, RobotState
from gait_entrainment.robot.drivers import (
    Driver,
    driver_names,
    driver_on,
    find_driver,
    make_robots,
)
from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.robot.guard import GuardedRobot
from gait_entrainment.robot.limits import DeviceLimits, Dose, PlannedPulses
from gait_entrainment.robot.profile import ProfileError, TorqueProfile
from gait_entrainment.robot.pulse_train import Pulse, PulseTiming, PulseTrain, Shape
