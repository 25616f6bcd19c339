# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Drivers of other packages, built separately by colcon, replace ours without other changes."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
EXAMPLES = ROOT / "examples"
pytestmark = pytest.mark.skipif(not EXAMPLES.exists(), reason="needs the repository")


@pytest.fixture(scope="module")
def outside(tmp_path_factory):
    """Build the examples in their own workspace; return a function that runs a command in it."""
    workspace = tmp_path_factory.mktemp("outside")
    shutil.copytree(EXAMPLES, workspace / "src")

    def run(command, *, sourced=True):
        setup = "source install/local_setup.bash && " if sourced else ""
        return subprocess.run(
            ["bash", "-c", f"source {ROOT}/env.bash && {setup}{command}"],
            cwd=workspace, capture_output=True, text=True, check=False,
        )  # fmt: skip

    built = run("colcon --log-base log build --base-paths src", sourced=False)
    assert built.returncode == 0, built.stdout + built.stderr
    return run


def test_the_driver_is_found_and_keeps_every_promise(outside):
    assert "pneumatic: " in outside("entrain driver list").stdout
    checked = outside("entrain driver check pneumatic:filling=0.02")
    assert checked.returncode == 0, checked.stdout
    assert ", 0 broken" in checked.stdout


def test_the_experiment_runs_with_it_and_entrains(outside):
    done = outside("entrain simulate --driver pneumatic --json")
    outcome = json.loads(done.stdout)
    assert outcome["entrained"] is True
    assert outcome["parameters"]["driver"] == "pneumatic"
    ideal = json.loads(outside("entrain simulate --json").stdout)
    # Torque that takes 10 ms to rise and fall is 5 ms late on average; the lag drops by that.
    shift = outcome["final_phase_lag"] - ideal["final_phase_lag"]
    assert -0.010 < shift < -0.002


def test_the_packages_own_test_is_the_kit(outside):
    done = outside(
        "cd src/pneumatic_ankle_robot && python -m pytest -q --disable-plugin-autoload"
        " -p gait_entrainment_drivers.pytest_plugin -p no:cacheprovider"
    )
    assert done.returncode == 0, done.stdout
    assert "42 passed" in done.stdout


def test_the_worked_example_passes_its_own_tests(outside):
    done = outside(
        "cd src/serial_ankle_robot && python -m pytest -q --disable-plugin-autoload"
        " -p no:cacheprovider"
    )
    assert done.returncode == 0, done.stdout
