# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from setuptools import find_packages, setup

NAME = "gait_entrainment_page"

setup(
    name=NAME,
    version="0.1.0",
    description="The operator's page of gait entrainment experiments",
    packages=find_packages(include=[NAME, NAME + ".*"]),
    package_data={NAME: ["py.typed", "static/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + NAME]),
        ("share/" + NAME, ["package.xml"]),
    ],
    entry_points={"console_scripts": [f"operator_page = {NAME}.executable:main"]},
)
