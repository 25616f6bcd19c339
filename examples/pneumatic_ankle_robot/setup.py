# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import setup

NAME = "pneumatic_ankle_robot"

setup(
    name=NAME,
    version="0.1.0",
    description="Example of an ankle robot driver in its own package",
    author="The gait_entrainment authors",
    license="Apache-2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},  # makes colcon test run pytest
    zip_safe=False,
    # gait_entrainment finds the driver by this line alone.
    entry_points={
        "gait_entrainment.drivers": [f"pneumatic = {NAME}.pneumatic:PneumaticAnkleRobot"]
    },
)
