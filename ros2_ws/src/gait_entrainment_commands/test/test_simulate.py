# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain simulate: one JSON object with the documented keys, one line for every mistake."""

import itertools
import json
import subprocess
import sys

import pytest

from gait_entrainment_commands import main

KEYS = {
    "unperturbed_stride_period",
    "perturbation_period",
    "stride_period",
    "pulses",
    "verdict",
    "entrained",
    "entrained_since_stride",
    "parameters",
}


def simulate(capsys, *options):
    code = main(["simulate", *options])
    out, err = capsys.readouterr()
    return code, out, err


def test_json_is_as_documented(capsys):
    code, out, err = simulate(capsys, "--json", "--initial-phase", "0.2", "--side", "left")
    assert (code, err) == (0, "")
    outcome = json.loads(out)
    assert set(outcome) >= KEYS
    assert outcome["verdict"] == "entrained"
    assert outcome["entrained"] is True
    assert len(outcome["stride_period"]) == 80
    assert len(outcome["pulses"]) == 50
    period, measured = outcome["perturbation_period"], outcome["unperturbed_stride_period"]
    assert period == pytest.approx(measured - 0.05, abs=1e-12)
    # The first pulse falls 0.2 of a stride after the strike that ends the baseline of 15 strides.
    first = outcome["pulses"][0]["onset"]
    assert first == pytest.approx((15 + 0.2) * measured, abs=1e-6)
    gaps = [b["onset"] - a["onset"] for a, b in itertools.pairwise(outcome["pulses"])]
    assert gaps == pytest.approx([period] * 49, abs=2e-9)
    assert outcome["parameters"]["walker"]["ankle_stiffness"] == 87.3


def test_a_sham_without_torque_is_walked_and_drifts(capsys):
    code, out, err = simulate(capsys, "--json", "--torque", "0")
    assert (code, err) == (0, "")
    outcome = json.loads(out)
    assert outcome["verdict"] == "drifting"
    assert len(outcome["pulses"]) == 50
    assert outcome["pulse_timing"]["measured"] is None  # no torque shows them
    code, out, err = simulate(capsys, "--torque", "0", "--driver", "emulated")
    assert (code, err) == (0, "")


def test_a_stride_period_that_was_not_measured_is_not_reported(capsys):
    options = ["--baseline", "1", "--period", "1.8", "--driver", "emulated"]
    code, out, _ = simulate(capsys, *options)
    assert code == 0
    assert "not measured unperturbed" in out
    assert "every 1.8000 s\n" in out
    _, out, _ = simulate(capsys, *options, "--json")
    assert "NaN" not in out
    assert json.loads(out)["unperturbed_stride_period"] is None


def test_options_reach_the_walker(capsys):
    _, out, _ = simulate(
        capsys,
        "--json",
        "--pulses",
        "2",
        "--washout",
        "0",
        "--baseline",
        "2",
        "--leg-length",
        "0.9",
        "--mass",
        "70",
        "--torque",
        "5",
        "--period",
        "1.7",
    )
    outcome = json.loads(out)
    assert outcome["parameters"]["walker"]["leg_length"] == 0.9
    assert outcome["perturbation_period"] == 1.7
    assert outcome["parameters"]["pulses"]["torque"] == 5
    assert len(outcome["stride_period"]) == 4


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--width", "-0.1"], ["--width", "pulses.width", "1e-09 to 10 s"]),
        (["--width", "nan"], ["--width", "nan"]),
        (["--ankle-stiffness", "60"], ["--ankle-stiffness", "67.4792 to 111.878"]),
        (["--period", "0.05"], ["overlap"]),
        (["--torque", "5", "--torque-fraction", "0.1"], ["--torque-fraction", "not both"]),
        (["--period-offset", "-1.9"], ["overlap"]),
        (["--baseline", "1"], ["--baseline", "at least 2"]),
        (["no_such_file.yaml"], ["no_such_file.yaml", "cannot be read"]),
    ],
)
def test_a_mistake_gives_one_line_and_exit_code_2(capsys, options, words):
    code, out, err = simulate(capsys, *options)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    for word in words:
        assert word in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--torque", "45"], ["torque: 45 N m", "-30 to 30"]),
        (["--driver", "unheard_of"], ["driver", "unheard_of", "ideal"]),
        (["--driver", "emulated:delay=2"], ["delay: '2'", "0 to 0.5 s"]),
        (["--driver", "emulated:peak_torque=5"], ["13.3464 N m is more than", "-5 to 5 N m"]),
        (["--driver", "ak_mit_can:channel=none"], ["real time only", "entrain run --real-time"]),
    ],
)
def test_an_impossible_robot_setting_gives_one_line_and_exit_code_1(capsys, options, words):
    code, out, err = simulate(capsys, *options)
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    for word in words:
        assert word in err


def test_a_fall_is_reported_with_exit_code_1(capsys):
    code, out, err = simulate(
        capsys, "--torque", "-29", "--width", "0.4", "--initial-phase", "0.5", "--json"
    )
    assert code == 1
    assert json.loads(out)["entrained"] is False
    assert "J were missing" in err or "had to pull" in err


def test_simulating_loads_neither_ros_nor_matplotlib():
    """Loading them takes longer than the simulation."""
    code = (
        "import sys, gait_entrainment_commands as c;"
        "c.main(['simulate', '--pulses', '2', '--washout', '1', '--baseline', '2']);"
        "print(sorted({'rclpy', 'matplotlib', 'scipy.stats', 'pandas'} & set(sys.modules)))"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert out.splitlines()[-1] == "[]"
