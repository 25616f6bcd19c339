# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
pytest plugin: the conformance kit for the tests of an external driver package.

Name the drivers in pytest's configuration, or with the option ``--ankle-robot``::

    [tool.pytest.ini_options]
    ankle_robots = ["my_robot:channel=can0"]

A test that takes the fixture ``ankle_robot_check`` runs once for each driver and check::

    def test_my_robot_keeps_its_promises(ankle_robot_check):
        ankle_robot_check()

A driver that applies real torque is skipped unless ``--arm-ankle-robot`` is given.

The kit is imported where it is used, so that it does not delay pytest if no driver is checked.
"""

from collections.abc import Callable

import pytest

_FIXTURE = "ankle_robot_check"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of the kit."""
    group = parser.getgroup("ankle robots")
    group.addoption(
        "--ankle-robot",
        action="append",
        default=[],
        metavar="NAME[:OPTION=VALUE,...]",
        help="driver to check; may be given more than once",
    )
    group.addoption(
        "--arm-ankle-robot",
        action="store_true",
        help="let real devices deliver torque; nobody may wear them",
    )
    parser.addini("ankle_robots", "drivers to check", type="linelist", default=[])


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make one test for each driver and check."""
    if _FIXTURE not in metafunc.fixturenames:
        return
    from gait_entrainment_drivers.conformance.checks import CHECKS

    config = metafunc.config
    drivers = [*config.getini("ankle_robots"), *config.getoption("--ankle-robot")]
    cases = [(driver, check) for driver in drivers for check in CHECKS]
    names = [f"{driver}-{check.__name__}" for driver, check in cases]
    metafunc.parametrize(_FIXTURE, cases, ids=names, indirect=True)


@pytest.fixture
def ankle_robot_check(request: pytest.FixtureRequest) -> Callable[[], None]:
    """Return a function that runs one check of one driver and fails if a promise is broken."""
    from gait_entrainment.robot.drivers import find_driver
    from gait_entrainment_drivers.conformance.bench import DriverBench, run_check

    text, check = request.param
    driver = find_driver(text)
    if not (driver.simulated or request.config.getoption("--arm-ankle-robot")):
        pytest.skip(f"{driver.name} applies real torque: add --arm-ankle-robot")

    def run() -> None:
        result = run_check(check, DriverBench(driver))
        if result.broken:
            pytest.fail(f"{result.promise} Broken: {result.broken}", pytrace=False)

    return run
