# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import setup

NAME = "serial_ankle_robot"

setup(
    name=NAME,
    version="0.1.0",
    description="Example of a driver for an ankle robot on a serial line, and its emulator",
    author="The gait_entrainment authors",
    license="Apache-2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    install_requires=["setuptools", "pyserial"],
    extras_require={"test": ["pytest"]},  # makes colcon test run pytest
    zip_safe=False,
    entry_points={
        "console_scripts": [f"serial_ankle_emulator = {NAME}.emulator:main"],
        # gait_entrainment finds the driver by this line alone.
        "gait_entrainment.drivers": [f"serial = {NAME}.driver:SerialAnkleRobot"],
    },
)
