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

"""
pytest plugin: the conformance kit for the tests of an outside driver package.

In pytest's configuration, or by the option ``--ankle-robot``, one names the drivers::

    [tool.pytest.ini_options]
    ankle_robots = ["my_robot:channel=can0"]

and a test that takes the fixture ``ankle_robot_check`` runs once for each driver and check::

    def test_my_robot_keeps_its_promises(ankle_robot_check):
        ankle_robot_check()

A driver that applies real torque is skipped unless ``--arm-ankle-robot`` is given.
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
    """Make one test of each driver and check."""
    if _FIXTURE not in metafunc.fixturenames:
        return
    # Loaded here, so that a pytest that checks no driver does not wait for the kit.
    from gait_entrainment.device.conformance import CHECKS

    config = metafunc.config
    drivers = [*config.getini("ankle_robots"), *config.getoption("--ankle-robot")]
    cases = [(driver, check) for driver in drivers for check in CHECKS]
    names = [f"{driver}-{check.__name__}" for driver, check in cases]
    metafunc.parametrize(_FIXTURE, cases, ids=names, indirect=True)


@pytest.fixture
def ankle_robot_check(request: pytest.FixtureRequest) -> Callable[[], None]:
    """Return a function that runs one check of one driver and fails where a promise is broken."""
    from gait_entrainment.device.conformance import run_check
    from gait_entrainment.device.drivers import find_driver

    text, check = request.param
    driver = find_driver(text)
    if not (driver.simulated or request.config.getoption("--arm-ankle-robot")):
        pytest.skip(f"{driver.name} applies real torque: say --arm-ankle-robot")

    def run() -> None:
        result = run_check(check, driver)
        if result.broken:
            pytest.fail(f"{result.promise} Broken: {result.broken}", pytrace=False)

    return run
