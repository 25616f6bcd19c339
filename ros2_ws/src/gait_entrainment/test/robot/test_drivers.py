# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Drivers by name: found without being loaded, options checked, mistakes reported in one line."""

import subprocess
import sys
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    LimitError,
    driver_names,
    driver_on,
    find_driver,
    make_robots,
)
from gait_entrainment.robot.drivers import join_options, split_options
from gait_entrainment.robot.ideal import IdealAnkleRobot


def test_the_drivers_of_this_package_are_found():
    assert {"ideal", "emulated"} <= set(driver_names())


def test_listing_drivers_does_not_load_them():
    code = (
        "import sys; from gait_entrainment.robot import driver_names, find_driver;"
        "driver_names(); find_driver('ideal');"
        "print(sorted({'can', 'gait_entrainment_drivers.emulated', 'rclpy'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_options_reach_the_driver():
    driver = find_driver("emulated:peak_torque=7.5,delay=0.1")
    assert (driver.options.peak_torque, driver.options.delay) == (7.5, 0.1)
    assert driver.simulated
    assert driver.make(Side.LEFT).capabilities.peak_torque == 7.5


def test_each_ankle_has_a_robot_with_its_own_options():
    text = "emulated:left.delay=0.1,peak_torque=7.5,right.delay=0.2"
    robots = make_robots(text, (Side.RIGHT, Side.LEFT), DeviceLimits())
    assert [(s, robot.side) for s, robot in robots.items()] == [(s, s) for s in (1, 0)]
    assert robots[Side.LEFT].partner is robots[Side.RIGHT]
    delays = {side: find_driver(text, side).options.delay for side in Side}
    assert delays == {Side.LEFT: 0.1, Side.RIGHT: 0.2}
    assert driver_on(text, Side.LEFT) == "emulated:delay=0.1,peak_torque=7.5"
    with pytest.raises(LimitError, match=r"driver: ak_mit_can is one robot, .*both legs; allowed"):
        make_robots("ak_mit_can", tuple(Side), DeviceLimits())
    assert make_robots("ak_mit_can", (Side.LEFT,), DeviceLimits())[Side.LEFT].partner is None


@settings(derandomize=True, deadline=None)
@given(st.lists(st.text(min_size=1)), st.text(r"\,=a"))
def test_options_of_any_text_read_back_the_same(parts, value):
    parts = [*parts, f"channel={value}"]
    assert split_options(join_options(parts)) == parts


def test_only_commas_and_backslashes_before_commas_need_a_backslash():
    text = r"channel=/dev/ttyACM0,path=C:\x,list=1\,2,ends=\\,more=1"
    assert split_options(text) == [
        "channel=/dev/ttyACM0", r"path=C:\x", "list=1,2", "ends=\\", "more=1"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "driver: '' is unknown; allowed: .*emulated.*ideal"),
        ("emulatd", "'emulatd' is unknown"),
        ("ideal:delay=1", "ideal: option 'delay=1'; allowed: rate"),
        ("emulated:delay", "option 'delay'; allowed: bandwidth, .*NAME=VALUE"),
        ("emulated:delay=0.1,delay=0.2", "delay: appears twice"),
        ("emulated:delay=soon", "delay: 'soon'; allowed: 0 to 0.5 s"),
        ("emulated:delay=nan", "delay: 'nan'; allowed"),
        ("emulated:delay=0.6", "delay: '0.6'; allowed"),
        ("emulated:left.delya=0.1", "option 'delya=0.1'; allowed: bandwidth"),
        ("emulated:right.delay=0.1,left.delay=0.6", "delay: '0.6'; allowed"),
        ("emulated:state_rate=300", "state_rate: 300 Hz; allowed: a divisor of 1000"),
    ],
)
def test_a_mistake_is_reported_in_one_line(text, words):
    with pytest.raises(LimitError, match=words) as error:
        find_driver(text)
    assert "\n" not in str(error.value)


def test_the_error_of_a_failed_import_names_the_missing_module(monkeypatch):
    from gait_entrainment.robot import drivers

    monkeypatch.setitem(drivers.OWN_DRIVERS, "absent", "no_such_package:Robot")
    with pytest.raises(DeviceError, match=r"absent .*cannot be loaded: .*no_such_package"):
        find_driver("absent")


class Odd(IdealAnkleRobot):
    capabilities = None


class Optionless(IdealAnkleRobot):
    Options = None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 / 0", "ZeroDivisionError"),
        ("raise SystemExit(3)", r"SystemExit\(3\)"),
        ("Robot = (", "SyntaxError"),
        (Odd, "AttributeError.*'simulated'"),
        (Optionless, "TypeError.*dataclass"),
    ],
)
def test_any_failure_to_load_a_third_party_driver_is_reported(monkeypatch, tmp_path, text, words):
    from gait_entrainment.robot import drivers

    if isinstance(text, str):
        (tmp_path / "third_party.py").write_text(text)
        monkeypatch.syspath_prepend(tmp_path)
    else:
        monkeypatch.setitem(sys.modules, "third_party", SimpleNamespace(Robot=text))
    monkeypatch.setitem(drivers.OWN_DRIVERS, "odd", "third_party:Robot")
    with pytest.raises(DeviceError, match=rf"odd .*cannot be loaded: .*{words}"):
        find_driver("odd")


def test_a_class_that_is_not_a_driver_is_refused(monkeypatch):
    from gait_entrainment.robot import drivers

    monkeypatch.setitem(drivers.OWN_DRIVERS, "wrong", "pathlib:Path")
    with pytest.raises(LimitError, match="not an AnkleRobot"):
        find_driver("wrong")
