# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import find_packages, setup

NAME = "gait_entrainment_sensors"

setup(
    name=NAME,
    version="0.1.0",
    description="Gait events from the signals of sensors, and emulated sensors, without ROS",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    entry_points={
        "gait_entrainment.detectors": [
            f"vertical_force = {NAME}.vertical_force:VerticalForceDetector",
            f"foot_switch = {NAME}.foot_switch:FootSwitchDetector",
            f"foot_gyroscope = {NAME}.foot_gyroscope:FootGyroscopeDetector",
            f"shank_gyroscope = {NAME}.shank_gyroscope:ShankGyroscopeDetector",
            f"ankle_encoder = {NAME}.ankle_encoder:AnkleEncoderDetector",
        ],
    },
)
