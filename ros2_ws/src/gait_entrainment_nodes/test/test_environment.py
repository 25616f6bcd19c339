# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""An environment in which ROS cannot start is reported in one line, before ROS is loaded."""

import os
import tempfile
from pathlib import Path

import pytest

from gait_entrainment_nodes.messaging import environment
from gait_entrainment_nodes.messaging.environment import (
    UnusableEnvironmentError,
    dds_variables,
    require_usable_environment,
)

VARIABLES = (
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "ROS_LOG_DIR",
    "ROS_HOME",
    "ROS_STATIC_PEERS",
)


@pytest.fixture(autouse=True)
def variables(monkeypatch, tmp_path):
    """Provide a usable environment; changes to it are undone."""
    for name in VARIABLES:
        monkeypatch.setenv(name, "")  # ROS treats it as unset
    monkeypatch.setenv("HOME", str(tmp_path))
    return monkeypatch


def test_logs_stay_in_the_home_folder(tmp_path):
    require_usable_environment()
    assert not os.environ["ROS_LOG_DIR"]
    assert (tmp_path / ".ros" / "log").is_dir()


@pytest.mark.parametrize("home", [None, "/proc"], ids=["none", "unwritable"])
def test_logs_go_to_a_temporary_folder_without_a_home(home, variables):
    if home is None:
        variables.delenv("HOME")
    else:
        variables.setenv("HOME", home)
    require_usable_environment()
    assert Path(os.environ["ROS_LOG_DIR"]).parent == Path(tempfile.gettempdir())


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("RMW_IMPLEMENTATION", "rmw_nonsense", "'rmw_nonsense' is not installed; allowed: rmw_"),
        ("RMW_IMPLEMENTATION", "rmw_implementation", "is not installed"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", "allowed: LOCALHOST, SUBNET, SYSTEM_DEFAULT"),
        ("ROS_LOG_DIR", "/proc/nowhere", "allowed: a writable folder, or unset"),
        ("ROS_STATIC_PEERS", "127.0.0.1;no host", "'no host' is not a known host"),
    ],
)
def test_a_variable_with_which_ros_cannot_start_is_named(variable, value, words, variables):
    variables.setenv(variable, value)
    with pytest.raises(UnusableEnvironmentError) as caught:
        require_usable_environment()
    assert str(caught.value).startswith(f"{variable}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_full_shared_memory_is_named(variables):
    used = environment.shutil.disk_usage("/")
    variables.setattr(environment.shutil, "disk_usage", lambda _: used._replace(free=4096))
    with pytest.raises(UnusableEnvironmentError, match="/dev/shm is full"):
        require_usable_environment()


@pytest.mark.parametrize("left_over", ["SYSTEM_DEFAULT", "LOCALHOST"])
@pytest.mark.parametrize("workspace", ["this", "another"])
def test_what_a_run_has_set_is_not_the_users_choice_for_the_next(left_over, workspace, variables):
    first = dds_variables(real_time=False)
    paced = dds_variables(real_time=True)
    assert first != paced
    if workspace == "another":  # whose env.bash was sourced earlier
        folder = "/another/share/gait_entrainment_nodes/config"
        variables.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", f"{folder}/fastdds.xml")
        assert dds_variables(real_time=False) == first
        assert dds_variables(real_time=True) == paced
        paced_there = f"{folder}/fastdds_real_time.xml"
        variables.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", paced_there)
        variables.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", left_over)
        assert dds_variables(real_time=False) == first
        assert dds_variables(real_time=True) == paced
    for name, value in {**paced, "ROS_AUTOMATIC_DISCOVERY_RANGE": left_over}.items():
        variables.setenv(name, value)
    assert dds_variables(real_time=False) == first
    assert dds_variables(real_time=True) == paced
    variables.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    variables.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "/mine.xml")
    variables.setenv("ROS_DOMAIN_ID", "17")
    for real_time in (False, True):
        assert set(dds_variables(real_time=real_time).values()) == {
            "SUBNET",
            "/mine.xml",
            "7100",
            "3",
        }
