# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A rehearsal on walkers that do not vary finds what the simulation finds; its command."""

import json

import numpy as np
import pytest

from gait_entrainment.simulation import simulate
from gait_entrainment_commands import main
from gait_entrainment_commands.outcome import outcome_of
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.rehearsal import rehearse
from gait_entrainment_sessions.session_file import SessionError, read_session
from gait_entrainment_studies.cohort.subjects import Subjects

SLOWER = ("period: 1.9, torque_fraction: 0.1", "period_offset: 0.05")


def test_steady_subjects_do_what_the_simulation_does(write):
    session = read_session(write(SLOWER))
    walker = session.blocks[0].protocol.walker
    subjects = Subjects((walker, walker), np.full(2, 1e-9), 0)
    runs = list(rehearse(session, subjects, seed=0, hurst=0.5))
    assert [(one.place.person, one.place.name) for one in runs] == [
        ("S01", "faster"),
        ("S02", "faster"),
        ("S01", "slower"),
        ("S02", "slower"),
    ]
    for one in runs:
        block = session.blocks[one.place.block - 1]
        expected, found = outcome_of(simulate(block.protocol)), outcome_of(one.run)
        assert found["verdict"] == expected["verdict"]
        assert found["stride_period"] == pytest.approx(expected["stride_period"], abs=1e-6)
        assert found["final_phase_lag"] == pytest.approx(expected["final_phase_lag"], abs=1e-4)
    study = StudyFindings.of([found for one in runs for found in Findings.of(one)])
    assert len(study.persons) == 2


def test_pulses_without_an_offset_are_refused(write):
    session = read_session(write())
    subjects = Subjects((session.blocks[0].protocol.walker,) * 2, np.full(2, 0.01), 0)
    with pytest.raises(SessionError, match=r"session.yaml:15: pulses: no rehearsal of these"):
        list(rehearse(session, subjects, seed=0, hurst=0.5))


def test_the_command_tells_what_would_have_been_found(write, tmp_path, capsys):
    path, out = write(SLOWER), tmp_path / "out"
    arguments = ["cohort", str(path), "--subjects", "3", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert {name: sum(v.values()) for name, v in outcome["blocks"].items()} == {
        "faster": 3,
        "slower": 3,
    }
    assert "persons that entrained in some block" in outcome["study"]
    assert {"blocks.tsv", "blocks.json", "verdicts.svg"} <= {p.name for p in out.iterdir()}
    assert main([*arguments[:2], "--torque", "5"]) == 2
    assert "torque: the session file says it" in capsys.readouterr().err
