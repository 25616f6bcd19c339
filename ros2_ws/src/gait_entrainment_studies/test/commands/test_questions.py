# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands about locking: lock, phase-response, existence."""

import csv
import json

import pytest

from gait_entrainment_commands import main


def printed(capsys, *arguments):
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_lock_shows_both_attractors_with_the_share_that_each_draws(capsys):
    outcome = printed(capsys, "lock", "--period-offset", "-0.067", "--phases", "16")
    stable = [lock for lock in outcome["locked_gaits"] if lock["stable"]]
    assert [lock["place"] for lock in stable] == [
        "pulse inside double stance",
        "pulse outlasts double stance",
    ]
    assert sum(lock["share_of_initial_phases"] for lock in stable) == 1
    assert all(lock["share_of_initial_phases"] > 0 for lock in stable)
    assert outcome["walked"] == {"locked": 16}


def test_lock_reports_walks_that_slip(capsys):
    outcome = printed(capsys, "lock", "--period-offset", "0.02", "--phases", "4")
    assert outcome["locked_gaits"] == []
    assert outcome["walked"] == {"slipping": 4}


def test_lock_prints_no_number_where_there_is_no_gait(capsys):
    arguments = ["lock", "--torque-fraction", "-2", "--width", "0.2", "--phases", "1"]
    branches = printed(capsys, *arguments)["branches"]
    assert any(branch["first"]["period"] is None for branch in branches)
    assert main(arguments) == 0
    assert "nan" not in capsys.readouterr().out


def test_phase_response_writes_curve_and_csv(capsys, tmp_path):
    outcome = printed(capsys, "phase-response", "--points", "21", "--out", str(tmp_path))
    assert len(outcome["locks"]) == 1
    with open(tmp_path / "phase_response.csv", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "phase [1]"
    assert [float(x) for x in rows[30]] == pytest.approx(outcome["curve"][29], rel=1e-11)
    assert (tmp_path / "phase_response.svg").stat().st_size > 10_000


def test_phase_response_reports_pulses_that_the_walker_does_not_survive(capsys):
    assert main(["phase-response", "--torque", "60", "--points", "9"]) == 0
    line = capsys.readouterr().out.splitlines()[2]
    # Early in double stance they lift the leading leg; 2 points at each end are in swing.
    assert line == "falls or flies off at 10 of 31 phases, between 0.4556 and 0.5156"


def test_existence_gives_the_range_and_the_map(capsys, tmp_path):
    outcome = printed(capsys, "existence", "--points", "30", "--out", str(tmp_path))
    assert outcome["walker"]["just_vault_over"] == pytest.approx(67.4792, abs=1e-4)
    assert all(row["just_vault_over"] < row["just_fly_off"] for row in outcome["map"])
    assert (tmp_path / "existence.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["lock", "--leg-angle", "0.9"], "leg_angle: '0.9'; allowed: above 0 and at most"),
        (["lock", "--width", "1.2"], "width: 1.2 s; allowed: above 0 and below a step"),
        (["lock", "--period-offset", "-1.9"], "period_offset: -1.9 s; allowed: above"),
        (["lock", "--period-offset", "nan"], "period_offset: 'nan'; allowed: any finite number"),
        (["lock", "--period-offset", "0"], "period_offset: 0 s is the stride period itself"),
        (["lock", "--phases", "0"], "phases: '0'; allowed: a whole number from 1 to 10000"),
        (["lock", "--torque", "nan"], "torque: 'nan'; allowed: any finite number"),
        (
            ["phase-response", "--period-offset", "nan"],
            "period_offset: 'nan'; allowed: any finite",
        ),
        (["phase-response", "--points", "1"], "points: '1'; allowed: a whole number from 2 to"),
        (["existence", "--points", "1"], "points: '1'; allowed: a whole number from 2 to"),
        (["phase-response", "--ankle-stiffness", "10"], "the walker falls"),
        (["existence", "--foot-length", "-1"], "foot_length: '-1'; allowed: above 0"),
    ],
)
def test_a_users_mistake_gives_one_line_and_exit_code_2(arguments, message, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_folder_that_cannot_be_written_is_named(tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("in the way")
    assert main(["existence", "--points", "5", "--out", str(file / "figures")]) == 1
    assert str(file) in capsys.readouterr().err
