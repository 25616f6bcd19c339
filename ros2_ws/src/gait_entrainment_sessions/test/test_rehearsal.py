# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A rehearsal walks any block that a session may have; its command reports the findings."""

import json

import numpy as np
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.robot import LimitError, Shape
from gait_entrainment.simulation import simulate
from gait_entrainment_commands import main
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.rehearsal import rehearse
from gait_entrainment_sessions.session_file import read_session
from gait_entrainment_studies.cohort.subjects import Subjects

ANY = (
    "{pulses: {period: 1.9, torque_fraction: 0.1}}",
    "{pulses: {count: 6, phase: 0.4, shape: half_sine, catch_pulses: [3]}, baseline: 4}",
)


def test_each_subject_walks_as_in_the_simulation(write):
    session = read_session(write(ANY, ("side: left", "side: left\n  driver: odrive_can")))
    walker = session.blocks[0].protocol.walker
    subjects = Subjects((walker, walker), np.array([0.02, 0.01]), 0)
    runs = list(rehearse(session, subjects, seed=0, hurst=0.5, jobs=2))
    walked = {(r.place.person, r.place.name): r.run for r in runs}
    assert walked.keys() == {(s, b) for s in ("S01", "S02") for b in ("faster", "slower")}
    for run in walked.values():
        assert run.protocol.side is Side.LEFT
        assert run.protocol.driver == "ideal"
        assert simulate(run.protocol).events == run.events
    by_phase = walked["S02", "slower"]
    assert by_phase.protocol.variation.coefficient == 0.01
    assert by_phase.train.pulses[2].torque == 0
    assert by_phase.train.pulses[3].shape is Shape.HALF_SINE
    assert len({run.protocol.seed for run in walked.values()}) == 4
    study = StudyFindings.of([found for placed in runs for found in Findings.of(placed)])
    assert len(study.persons) == 2


def test_a_subject_who_must_not_receive_a_pulse_is_named(write):
    session = read_session(write())
    large = WalkerParameters(mass=160.0, ankle_stiffness=174.6)
    subjects = Subjects((session.blocks[0].protocol.walker, large), np.full(2, 0.01), 0)
    with pytest.raises(LimitError, match=r"session.yaml:15: S02: torque: 26.*-15 to 15"):
        list(rehearse(session, subjects, seed=0, hurst=0.5, jobs=1))


def test_the_command_reports_what_would_have_been_found(write, tmp_path, capsys):
    path, out = write(ANY), tmp_path / "out"
    arguments = ["cohort", str(path), "--subjects", "3", "--jobs", "1", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    found = {name: sum(of["verdicts"].values()) for name, of in outcome["blocks"].items()}
    assert found == {"faster": 3, "slower": 3}
    assert outcome["blocks"]["slower"]["verdicts"] == {"untestable": 3}
    assert 0 < outcome["blocks"]["faster"]["locked"] <= 1
    assert "persons that entrained in some block" in outcome["study"]
    assert {"blocks.tsv", "blocks.json", "verdicts.svg"} <= {p.name for p in out.iterdir()}
    assert main([*arguments[:2], "--torque", "5"]) == 2
    assert "torque: given by the session file" in capsys.readouterr().err
