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

from glob import glob

from setuptools import find_packages, setup

NAME = "gait_entrainment_nodes"
NODES = [
    "walker_sim",
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
    author="The gait_entrainment authors",
    license="Apache-2.0",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
        ("share/" + NAME + "/config", glob("config/*")),
        ("share/" + NAME + "/launch", glob("launch/*.py")),
        ("share/" + NAME + "/rviz", glob("rviz/*")),
        ("share/" + NAME + "/urdf", glob("urdf/*")),
        ("share/" + NAME + "/layouts", glob("layouts/*")),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},  # so that colcon test runs pytest
    zip_safe=False,
    entry_points={
        "console_scripts": [f"{node} = {NAME}.{node}:main" for node in NODES],
        "gait_entrainment.commands": [
            f"run = {NAME}.run_command:add_command",
            f"node = {NAME}.node_command:add_command",
            f"ready = {NAME}.ready_command:add_command",
            f"replay = {NAME}.replay_command:add_command",
            f"stop = {NAME}.stop_command:add_command",
        ],
        "gait_entrainment.node_check": [f"node = {NAME}.node_check:check_node"],
    },
)
