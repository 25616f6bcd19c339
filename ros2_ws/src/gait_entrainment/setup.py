# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import find_packages, setup

NAME = "gait_entrainment"

setup(
    name=NAME,
    version="0.1.0",
    description="Entrainment of walking to periodic ankle torque pulses, without ROS",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
)
