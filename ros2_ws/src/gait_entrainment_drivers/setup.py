# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import find_packages, setup

NAME = "gait_entrainment_drivers"

setup(
    name=NAME,
    version="0.1.0",
    description="Drivers of real ankle robots and the conformance kit, without ROS",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    entry_points={
        "console_scripts": [
            f"ak_motor_emulator = {NAME}.ak_motor_emulator:main",
            f"odrive_emulator = {NAME}.odrive_emulator:main",
        ],
        "gait_entrainment.drivers": [
            f"ak_mit_can = {NAME}.ak_mit_can:AkMitCanRobot",
            f"odrive_can = {NAME}.odrive_can:OdriveCanRobot",
        ],
        "gait_entrainment.commands": [f"drivers = {NAME}.commands"],
        "pytest11": [f"ankle_robots = {NAME}.pytest_plugin"],
    },
)
