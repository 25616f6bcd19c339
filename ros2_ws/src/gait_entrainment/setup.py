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

from setuptools import find_packages, setup

NAME = "gait_entrainment"

setup(
    name=NAME,
    version="0.1.0",
    description="Entrainment of walking to periodic ankle torque pulses, without ROS",
    author="The gait_entrainment authors",
    license="Apache-2.0",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},  # so that colcon test runs pytest
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "entrain = gait_entrainment.__main__:main",
            "ak_motor_emulator = gait_entrainment.device.ak_motor_emulator:main",
            "odrive_emulator = gait_entrainment.device.odrive_emulator:main",
        ],
        "pytest11": ["ankle_robots = gait_entrainment.device.pytest_plugin"],
    },
)
