# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from glob import glob

from setuptools import find_packages, setup

NAME = "gait_entrainment_bringup"

setup(
    name=NAME,
    version="0.1.0",
    description="What runs together in gait entrainment experiments",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
        ("share/" + NAME + "/config", glob("config/*")),
        ("share/" + NAME + "/launch", glob("launch/*.py")),
        ("share/" + NAME + "/rviz", glob("rviz/*")),
        ("share/" + NAME + "/layouts", glob("layouts/*")),
    ],
    entry_points={
        "gait_entrainment.commands": [f"bringup = {NAME}.commands"],
    },
)
