# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Each package.xml is valid by REP 149 and names each dependency of its package, and no other.

Whether rosdep knows a key cannot be checked without a network; docs/installation.md says when and
against what the keys were looked up.
"""

import ast
import re
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

ROOT = Path(__file__).parents[1]
PACKAGES = [
    *sorted((ROOT / "ros2_ws/src").glob("*/package.xml")),
    *sorted((ROOT / "examples").glob("*/package.xml")),
]
# Modules whose key is not their own name; for most others it is python3-NAME or NAME.
KEYS = {
    "lz4": "mcap-ros2-support",
    "mcap": "mcap-ros2-support",
    "mcap_ros2": "mcap-ros2-support",
    "mpmath": "python3-sympy",
    "rosbags": "python3-rosbags-pip",
    "zstandard": "mcap-ros2-support",
}
# Modules without a rosdep key; what needs them says so, or its tests are skipped.
# controller_manager_msgs is used by the driver for ros2_control if it is installed.
# The page's server comes with nicegui; foxglove is optional.
WITHOUT_KEY = {
    *("astropy", "controller_manager_msgs", "distributed", "ezc3d", "pyarrow"),
    *("fastapi", "foxglove", "nicegui", "starlette", "uvicorn"),
}
# Dependencies that are needed but not imported, and why.
NOT_IMPORTED = {
    "python3-msgpack": "python-can, for the bus of processes on one host",
    "diagnostic_msgs": "message definitions for the tests of bags",
    "geometry_msgs": "message definitions for the tests of bags",
    "rosgraph_msgs": "message definitions for the tests of bags",
    "sensor_msgs": "message definitions for the tests of bags",
    "std_msgs": "message definitions for the tests of bags",
    "ros2launch": "it starts the launch files",
    "rviz2": "rviz:=true starts it",
    "python3-pytest": "it runs the tests",
    "gait_entrainment_drivers": "the plugin of pytest that checks an example's driver",
    "ament_flake8": "test_linters.py",
    "ament_pep257": "test_linters.py",
    "ament_xmllint": "test_linters.py",
}


def imported(folders):
    """Return the top-level names of the external modules that Python files import."""
    files = [file for folder in folders for file in folder.rglob("*.py")]
    names = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add((node.module or "").partition(".")[0])
    # Tests of one package may use a helper from the tests of another.
    helpers = {file.stem for file in ROOT.glob("ros2_ws/src/*/test/**/*.py")}
    own = {file.stem for file in files} | helpers
    return names - own - set(sys.stdlib_module_names) - WITHOUT_KEY


@pytest.fixture(params=PACKAGES, ids=lambda path: path.parent.name)
def package(request):
    warnings = []
    package = parse_package(str(request.param), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    return package


def test_package_is_valid_and_named_by_rep_144(package):
    assert package.package_format == 3
    assert re.fullmatch(r"[a-z](_?[a-z0-9]+)+", package.name)
    assert Path(package.filename).parent.name == package.name
    assert package.licenses == ["Apache-2.0"]


def test_package_has_what_ros_conventions_require(package):
    folder = Path(package.filename).parent
    if folder.parent.name == "examples":
        return
    assert all(person.email for person in [*package.maintainers, *package.authors])
    assert package.urls
    title = f"Changelog for package {package.name}"
    assert (folder / "CHANGELOG.rst").read_text().splitlines()[1] == title
    assert "](../QUALITY_DECLARATION.md)" in (folder / "README.md").read_text()


def test_dependencies_are_what_is_imported(package):
    folder = Path(package.filename).parent
    if package.get_build_type() == "ament_cmake":
        found = re.findall(
            r"find_package\((\w+) REQUIRED\)", (folder / "CMakeLists.txt").read_text()
        )
        declared = {d.name for d in package.build_depends + package.buildtool_depends}
        assert set(found) == declared
        return
    at_run_time = {d.name for d in package.exec_depends}
    in_tests = at_run_time | {d.name for d in package.test_depends}

    def keys(modules):
        return {KEYS.get(m, f"python3-{m}" if f"python3-{m}" in in_tests else m) for m in modules}

    # pytest is what loads the plugin that imports it.
    installed = keys(
        imported([folder / package.name, folder / "launch"]) - {"pytest", package.name}
    )
    assert installed - at_run_time == set()
    tested = keys(imported([folder / "test"]) - {package.name})
    assert tested - in_tests == set()
    assert in_tests - installed - tested - set(NOT_IMPORTED) == set()
