# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The checklist before a session, with an emulated motor: what passes, fails and is stored."""

import json
import subprocess
from pathlib import Path

import pytest
from harness import entrain_run
from test_drivers import SHORT, emulated_motor, entrain

from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.checklist import _record
from gait_entrainment_drivers.proof import keep_proof, preflight_of


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.mark.usefixtures("state")
def test_a_robot_fit_for_a_session_can_be_armed_and_its_bag_records_the_check(tmp_path):
    with emulated_motor(tmp_path, "--timeout=0.1") as (driver, _):
        keep_proof(driver, 0.1)
        words = ["entrain", "preflight", f"--driver={driver}", "--arm", "--json"]
        checklist = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert "press the stop" in checklist.stderr.readline()
        code, out, _ = entrain(None, "stop")
        assert code == 0, out
        out, err = checklist.communicate(timeout=30)
        assert (checklist.returncode, err) == (0, "")
        found = json.loads(out)
        assert found["passed"]
        names = [point["name"] for point in found["points"]]
        assert names == ["limits", "watchdog", "record", "device", "loop", "stop"]
        assert preflight_of(driver).failed == ""
        bag = tmp_path / "bag"
        with entrain_run(bag, f"--driver={driver}", "--real-time", "--arm", *SHORT) as run:
            assert run.wait() == 0, run.text
    with BagReader(bag) as reader:
        ((_, setup),) = reader.decoded(["/perturbator/setup"])
    assert setup.preflight.endswith(": passed")
    assert setup.watchdog.startswith("zero within 0.1 s, ")


@pytest.mark.usefixtures("state")
def test_an_unproved_watchdog_and_a_missing_stop_fail_by_name(tmp_path):
    with emulated_motor(tmp_path) as (driver, _):
        options = (f"--driver={driver}", "--arm", "--timeout=0.5")
        code, out, _ = entrain(None, "preflight", *options)
    assert code == 1
    assert out.splitlines()[-1] == "not fit for a session: watchdog, stop"
    assert "entrain driver prove" in out
    assert preflight_of(driver).failed == "watchdog, stop"


def test_a_folder_that_cannot_be_written_fails():
    assert not _record(Path("/proc/study")).passed


@pytest.mark.usefixtures("state")
def test_a_robot_that_does_not_answer_fails():
    options = ("--driver=ak_mit_can:interface=virtual,channel=nobody", "--arm")
    code, out, _ = entrain(None, "preflight", *options)
    assert code == 1
    assert "FAIL  device" in out
    assert "check its power" in out
