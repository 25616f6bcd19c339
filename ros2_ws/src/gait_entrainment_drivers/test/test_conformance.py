# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The conformance kit: drivers that keep their promises pass, and every broken one is caught."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from types import SimpleNamespace

import pytest
from misbehaving_device import MisbehavingOptions, MisbehavingRobot

from gait_entrainment.robot import AnkleRobot, find_driver
from gait_entrainment.robot.drivers import OWN_DRIVERS, Driver
from gait_entrainment_commands import main
from gait_entrainment_drivers.conformance import checks
from gait_entrainment_drivers.conformance.bench import DriverBench, Tolerances, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS
from gait_entrainment_drivers.proof import keep_proof, proof_of

from .broken_robots import BROKEN
from .emulator_process import emulator

# A shared machine wakes processes up late; the kit's own limits are for a quiet one.
TOLERANT = Tolerances(
    onset=0.25, zero_within=1.0, watchdog=1.6, call=0.1, slowest_call=2.0, impulse=0.6
)


@pytest.fixture
def state(tmp_path, monkeypatch):
    """Keep proofs in a temporary folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def run_checks(text, tolerances=None):
    bench = DriverBench(find_driver(text), tolerances)
    return [run_check(check, bench) for check in CHECKS]


@pytest.mark.parametrize(
    "text", ["ideal", "emulated", "emulated:bandwidth=8,delay=0.03,noise=0.2,state_rate=1000"]
)
def test_the_simulated_drivers_keep_every_promise(text):
    results = run_checks(text)
    assert [result for result in results if not result.kept] == []
    assert len(results) == len(CHECKS)


def test_the_can_driver_keeps_every_promise():
    with emulator("--timeout", "0.3") as text:
        results = run_checks(text, TOLERANT)
    assert [result for result in results if not result.kept] == []
    figures = {result.check: result.figures for result in results}
    assert figures["timing"]["median_ms"] > 0
    assert "time_to_zero_ms" in figures["stopping_in_mid_pulse"]


@pytest.mark.parametrize(
    ("broken", "check", "words"), BROKEN, ids=[f"{b.__name__}-{c}" for b, c, _ in BROKEN]
)
def test_a_broken_driver_is_caught(broken, check, words):
    driver = Driver("broken", broken, broken.Options())
    result = run_check(getattr(checks, check), DriverBench(driver))
    assert re.search(words, result.broken), result.broken
    assert "\n" not in result.broken


def test_every_check_can_fail():
    caught = {check for _, check, _ in BROKEN}
    # These two need real time or a faulty guard, and are made to fail below.
    assert {check.__name__ for check in CHECKS} - caught == {"stale_commands", "silent_host"}


def test_a_guard_that_misses_silence_is_caught(monkeypatch):
    from gait_entrainment.robot.guard import GuardedRobot

    monkeypatch.setattr(GuardedRobot, "_watch", lambda _: None)
    with emulator() as text:
        result = run_check(checks.stale_commands, DriverBench(find_driver(text), TOLERANT))
    assert "silence was not noticed" in result.broken


MOTORS = [("ak_motor_emulator", "ak_mit_can"), ("odrive_emulator", "odrive_can")]
HOLDS = (
    "holds its last command when the host is silent: 8 N m were measured after .* ms of silence"
)


@pytest.mark.usefixtures("state")
@pytest.mark.parametrize(("program", "name"), MOTORS)
def test_a_motor_with_a_watchdog_is_proved_and_its_proof_is_kept(program, name, capsys):
    with emulator("--timeout", "0.02", program=program, driver=name) as text:
        text = text.replace("rate=250", "rate=500")
        assert main(["driver", "prove", text, "--arm", "--json"]) == 0
        (check,) = json.loads(capsys.readouterr().out)["checks"]
        proof = proof_of(text)
        assert proof.within == pytest.approx(check["figures"]["zero_within_ms"] / 1e3)
        assert proof.within > 0.02
        assert datetime.now(timezone.utc) - datetime.fromisoformat(proof.at) < timedelta(minutes=1)


@pytest.mark.usefixtures("state")
@pytest.mark.parametrize(("program", "name"), MOTORS)
def test_a_motor_that_holds_its_last_command_is_caught_and_loses_its_proof(program, name, capsys):
    with emulator(program=program, driver=name) as text:
        keep_proof(text, 0.05)
        assert main(["driver", "prove", text, "--arm"]) == 1
        assert re.search(HOLDS, capsys.readouterr().out)
        assert proof_of(text) is None


def test_a_driver_that_cannot_silence_its_host_is_not_provable():
    class Unprovable(MisbehavingRobot):
        frozen = AnkleRobot.frozen

    driver = Driver("unprovable", Unprovable, MisbehavingOptions(rate=250.0, lateness=0.5))
    result = run_check(checks.silent_host, DriverBench(driver))
    assert result.broken.startswith("not provable: this driver cannot silence its host")


def test_a_simulated_robot_has_nothing_to_prove(capsys):
    assert main(["driver", "prove", "ideal", "--arm"]) == 1
    assert "nothing to prove" in capsys.readouterr().err


def test_the_command_prints_a_sentence_for_each_promise(capsys):
    assert main(["driver", "check", "ideal"]) == 0
    out = capsys.readouterr().out
    assert out.count("kept   ") == len(CHECKS)
    assert main(["driver", "check", "ideal", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["broken"] == 0
    assert {check["check"] for check in report["checks"]} == {c.__name__ for c in CHECKS}


def test_single_checks_can_be_run_in_any_order(capsys):
    assert main(["driver", "check", "ideal", "--only", "cuts,pulses", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [check["check"] for check in report["checks"]] == ["cuts", "pulses"]


def test_a_broken_promise_gives_exit_code_1(capsys, monkeypatch):
    monkeypatch.setitem(OWN_DRIVERS, "late", "late:Late")
    late = next(b for b, check, _ in BROKEN if b.__name__ == "PushesLate")
    monkeypatch.setitem(sys.modules, "late", SimpleNamespace(Late=late))
    assert main(["driver", "check", "late"]) == 1
    out, err = capsys.readouterr()
    assert "BROKEN timing" in out
    assert "+80.0 ms" in out
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nobody"], "'nobody' is unknown; allowed: .*ideal"),
        (["ideal:x=1"], "option 'x=1'; allowed: rate"),
        (["ideal", "--torque", "nan"], "--torque: 'nan'"),
        (["ideal", "--only", "cuts,cut"], "--only: 'cut' is unknown; allowed: construction, "),
        (["ak_mit_can"], "applies real torque.*--arm"),
        (["ak_mit_can:motor=AK1", "--arm"], "motor: 'AK1'; allowed: AK60-6"),
        (["ak_mit_can:channel=nosuchcan7", "--arm"], "nosuchcan7 cannot be opened"),
        (["ak_mit_can:interface=virtual,channel=x", "--arm"], "motor 1 does not answer"),
    ],
)
def test_a_mistake_gives_a_one_line_error(capsys, arguments, words):
    assert main(["driver", "check", *arguments]) in (1, 2)  # failed, or wrong usage
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert re.search(words, err)


def test_the_list_has_every_driver_and_option(capsys):
    assert main(["driver", "list"]) == 0
    out = capsys.readouterr().out
    for words in ("ideal: ", "emulated: ", "ak_mit_can: ", "motor=AK80-9", "AK60-6, AK70-10"):
        assert words in out
    assert "bandwidth=20.0 Hz  torque bandwidth (-3 dB) of the lag; 0.5 to 300" in out
    assert main(["driver", "list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert "torque bandwidth" in listed["emulated"]["options"][0]["meaning"]


def run_plugin(folder, *options):
    (folder / "test_it.py").write_text(
        "def test_it(ankle_robot_check):\n    ankle_robot_check()\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "--disable-plugin-autoload", "-p"]
    command += ["gait_entrainment_drivers.pytest_plugin", "-p", "no:cacheprovider", *options]
    # Options that colcon test gives the outer pytest are not for this one.
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_ADDOPTS"}
    return subprocess.run(
        [*command, "--rootdir", str(folder), str(folder)],
        capture_output=True, text=True, cwd=folder, check=False, env=environment,
    )  # fmt: skip


def test_the_plugin_turns_each_check_into_a_test(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\nankle_robots = ideal\n")
    done = run_plugin(tmp_path, "--ankle-robot", "emulated:delay=0.08")
    # Later than the kit allows: the only broken promise.
    assert done.returncode == 1
    assert f"1 failed, {2 * len(CHECKS) - 1} passed" in done.stdout
    assert "allowed: -2.0 to +60.0 ms" in done.stdout


def test_the_plugin_skips_drivers_that_apply_real_torque(tmp_path):
    done = run_plugin(tmp_path, "--ankle-robot", "ak_mit_can")
    assert f"{len(CHECKS)} skipped" in done.stdout


def test_a_lab_can_set_its_own_tolerances():
    strict = replace(Tolerances(), onset=0.001)
    result = run_check(checks.timing, DriverBench(find_driver("emulated"), strict))
    assert "allowed: -2.0 to +1.0 ms" in result.broken
