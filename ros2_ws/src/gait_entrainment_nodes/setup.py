# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from glob import glob

from setuptools import find_packages, setup

NAME = "gait_entrainment_nodes"
NODES = [
    "walker_sim",
    "sensor_sim",
    "gait_detector",
    "perturbator",
    "gait_analyzer",
    "experiment",
    "bag_recorder",
    "bag_player",
    "walker_display",
]

setup(
    name=NAME,
    version="0.1.0",
    description="ROS 2 nodes of gait entrainment experiments",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
        ("share/" + NAME + "/config", glob("config/*")),
        ("share/" + NAME + "/urdf", glob("urdf/*")),
    ],
    entry_points={
        "console_scripts": [f"{node} = {NAME}.executable:main" for node in NODES],
        "gait_entrainment.commands": [f"nodes = {NAME}.commands"],
        "gait_entrainment.drivers": [f"ros2_control = {NAME}.ros2_control:Ros2ControlRobot"],
        "gait_entrainment.node_check": [f"node = {NAME}.node_check:check_node"],
    },
)
