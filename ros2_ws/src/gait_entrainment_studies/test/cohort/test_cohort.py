# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import csv
import json

import numpy as np
import pytest

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import Protocol, PulsePlan
from gait_entrainment.simulation import simulate
from gait_entrainment_commands import main
from gait_entrainment_studies.cohort.study import StudyPlan, run_study, verdicts
from gait_entrainment_studies.cohort.subjects import SubjectDistributions, Subjects, draw_subjects
from gait_entrainment_studies.locking.branches import locked_gaits
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait


def table_1_subjects(count, variation):
    """Return subjects that are all the walker of Table 1, to see what noise alone does."""
    return Subjects((WalkerParameters(),) * count, np.full(count, variation), 0)


def test_a_trial_without_variability_equals_the_run_of_entrain_simulate():
    study = run_study(table_1_subjects(2, 1e-9), StudyPlan(torque=13.3))
    trial = study.trials[0]
    simulation = simulate(Protocol(pulses=PulsePlan(torque=13.3, torque_fraction=None)))
    assert trial.verdict == simulation.analysis.entrainments[-1].verdict.name.lower()
    assert trial.measured_period == pytest.approx(simulation.measured_period, abs=1e-6)
    last = [pulse.phase_lag for pulse in simulation.analysis.pulses[-20:]]
    assert trial.median_lag == pytest.approx(np.median(last), abs=1e-5)


def test_a_trial_without_noise_ends_in_the_solved_lock():
    subjects = draw_subjects(SubjectDistributions(variation=(1e-9, 0.0)), 4, 5)
    plan = StudyPlan(period_offsets=(-0.03,), pulses=90)
    for trial in run_study(subjects, plan).trials:
        gait = PulsedGait(subjects.walkers[trial.subject], 10.0, 0.1)
        locks = locked_gaits(gait, gait.unperturbed_period - 0.03)
        stable = [lock.lag for lock in locks if lock.stable]
        assert trial.verdict == "entrained"
        assert min(abs(trial.median_lag - lag) for lag in stable) < 1e-5


def test_variability_keeps_subjects_from_being_shown_entrained():
    calm, lively = (
        verdicts(run_study(table_1_subjects(12, variation), StudyPlan(torque=13.3)), -0.05)
        for variation in (0.002, 0.03)
    )
    assert calm == {"entrained": 12}
    assert lively.get("entrained", 0) < 12
    assert sum(lively.values()) == 12


def test_subjects_that_cannot_walk_with_their_variation_are_reported():
    found = verdicts(run_study(table_1_subjects(6, 0.4), StudyPlan()), -0.05)
    assert set(found) <= {"fell", "flew off"}
    assert sum(found.values()) == 6


def test_a_trial_is_the_same_whatever_other_periods_are_requested():
    subjects = table_1_subjects(3, 0.02)
    alone = run_study(subjects, StudyPlan(period_offsets=(-0.05,))).trials
    among = run_study(subjects, StudyPlan(period_offsets=(-0.08, -0.05))).trials
    assert [trial for trial in among if trial.period_offset == -0.05] == list(alone)
    assert among[0].measured_period != among[3].measured_period


def test_basins_are_those_of_the_solved_borders_and_only_where_these_apply():
    study = run_study(table_1_subjects(2, 1e-9), StudyPlan(torque=13.3464))
    assert study.basins[0] == pytest.approx([-4.1045, 0.0], abs=1e-4)
    assert study.basin_widths == pytest.approx([4.1045] * 2, abs=1e-4)
    assert run_study(table_1_subjects(2, 1e-9), StudyPlan(slope=-0.01)).basins.shape == (0, 2)


def test_subjects_are_drawn_from_the_given_distributions_and_seed():
    distributions = SubjectDistributions(mass=(70.0, 5.0))
    subjects = draw_subjects(distributions, 400, 1)
    masses = np.array([walker.mass for walker in subjects.walkers])
    assert masses.mean() == pytest.approx(70.0, abs=0.8)
    assert np.abs(masses - 70.0).max() <= 10.0
    assert draw_subjects(distributions, 400, 1).walkers == subjects.walkers
    assert draw_subjects(distributions, 400, 2).walkers != subjects.walkers


def test_command_counts_every_subject_in_its_denominators(tmp_path, capsys):
    arguments = [
        "cohort",
        "--subjects",
        "5",
        "--period-offset",
        "-0.05",
        "--period-offset",
        "0.02",
        # A repeated offset adds no trials.
        "--period-offset",
        "-0.05",
    ]
    assert main([*arguments, "--out", str(tmp_path), "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert [sum(row["verdicts"].values()) for row in outcome["periods"]] == [5, 5]
    with open(tmp_path / "trials.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == 10
    assert (tmp_path / "cohort.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--mass", "10", "6"], "mass: 10 +/- 6; allowed: a mean above twice"),
        (["--slope", "0.7"], "slope: 0.7 rad; allowed: within the leg angle"),
        (["--period-offset", "-1.5"], "period_offset: -1.5 s; allowed: within"),
        (["--period-offset", "-0.5", "--width", "0.7"], "period_offset: -0.5 s; allowed: within"),
        (["--initial-phase", "inf"], "initial_phase: 'inf'; allowed: at least 0 and below 1"),
        (["--subjects", "1"], "subjects: '1'; allowed: a whole number from 2 to 10000"),
        (["--seed", "-1"], "seed: '-1'; allowed: a whole number at least 0"),
        (["--peak-torque", "0.9", "0.001"], "hardly any subject drawn has a gait"),
    ],
)
def test_wrong_usage_is_reported_in_one_line(arguments, message, capsys):
    assert main(["cohort", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
