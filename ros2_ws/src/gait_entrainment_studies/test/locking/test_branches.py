# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from step_to_step import step_to_step

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import Protocol, PulsePlan
from gait_entrainment.simulation import simulate
from gait_entrainment_studies.locking.branches import (
    Border,
    locked_gaits,
    pieces_of,
    stable_intervals,
)
from gait_entrainment_studies.locking.pulsed_gait import Place, PulsedGait
from gait_entrainment_studies.locking.walked import Outcome, shares_of, walk_under_pulses

TABLE_1 = WalkerParameters()
GAIT = PulsedGait(TABLE_1, 0.1 * TABLE_1.peak_torque, 0.1)


def offset(end):
    return end.period - GAIT.unperturbed_period


def test_borders_of_the_papers_basin_are_the_corners_at_toe_off():
    basin = stable_intervals(pieces_of(GAIT))[-1]
    assert basin.place is Place.LATE
    assert basin.least_period.border is Border.END_AT_TOE_OFF
    assert basin.least_period.lag == pytest.approx(-0.1, abs=1e-12)
    assert basin.greatest_period.border is Border.START_AT_TOE_OFF
    assert offset(basin.greatest_period) == pytest.approx(0.0, abs=1e-12)


def test_early_double_stance_locks_between_a_corner_and_a_fold():
    early = stable_intervals(pieces_of(GAIT))[0]
    assert early.place is Place.INSIDE
    assert early.least_period.border is Border.START_AT_HEEL_STRIKE
    assert early.least_period.onset == pytest.approx(0.0, abs=1e-12)
    assert early.greatest_period.border is Border.FOLD
    # At a fold the period is greatest: a plain scan around it finds none longer.
    scan = GAIT.gaits(Place.INSIDE, np.linspace(early.first.angle, early.last.angle + 0.1, 1001))
    assert scan.period.max() == pytest.approx(early.greatest_period.period, abs=1e-9)
    assert scan.period.max() <= early.greatest_period.period + 1e-14


def test_a_multiplier_is_one_at_a_fold_and_minus_one_at_a_flip():
    gait = PulsedGait(TABLE_1, 0.3 * TABLE_1.peak_torque, 0.1)
    found = {}
    for piece in pieces_of(gait):
        for end in (piece.first, piece.last):
            if end.border in (Border.FOLD, Border.FLIP):
                found[end.border] = gait.gaits(piece.place, np.array([end.angle])).multipliers[0]
    assert found[Border.FOLD][0] == pytest.approx(1, abs=1e-9)
    assert found[Border.FLIP][0] == pytest.approx(-1, abs=1e-9)


def run(period_offset, initial_phase, pulses):
    plan = PulsePlan(count=pulses, period_offset=period_offset, initial_phase=initial_phase)
    return simulate(Protocol(pulses=plan, washout=1)).analysis.pulses


@pytest.mark.parametrize("initial_phase", [0.1, 0.5, 0.9])
def test_the_simulated_experiment_ends_in_the_solved_lock(initial_phase):
    last = run(-0.05, initial_phase, 80)[-1]
    stable = [g for g in locked_gaits(GAIT, GAIT.unperturbed_period - 0.05) if g.stable]
    assert len(stable) == 1
    # Pulse onsets are whole nanoseconds.
    assert last.phase_lag == pytest.approx(stable[0].lag, abs=5e-9)
    assert last.phase == pytest.approx(stable[0].phase, abs=5e-9)


def test_two_attractors_each_draw_some_initial_phases():
    period = -0.067
    stable = [g for g in locked_gaits(GAIT, GAIT.unperturbed_period + period) if g.stable]
    assert [g.place for g in stable] == [Place.INSIDE, Place.LATE]
    ends = [run(period, phase, 450)[-1].phase_lag for phase in (0.51, 0.62)]
    assert ends == pytest.approx([g.lag for g in stable], abs=1e-6)


@pytest.mark.parametrize(("beyond", "locks"), [(-2e-4, False), (2e-4, True)])
def test_simulation_confirms_the_border(beyond, locks):
    border = offset(stable_intervals(pieces_of(GAIT))[-1].least_period)
    lags = [pulse.unwrapped_lag for pulse in run(border + beyond, 0.65, 60)]
    # Just beyond the corner the pulse slips by a fraction of a millisecond a stride at first.
    assert (abs(lags[-1] - lags[-2]) < 1e-6) is locks


def test_a_pulse_longer_than_double_stance_has_no_branch_inside_it():
    places = {piece.place for piece in pieces_of(PulsedGait(TABLE_1, 13.3, 0.5))}
    assert places == {Place.EARLY, Place.LATE}


def test_dorsiflexion_pulses_lock_to_longer_periods_as_solved():
    gait = PulsedGait(TABLE_1, -0.1 * TABLE_1.peak_torque, 0.1)
    period = gait.unperturbed_period + 0.05
    stable = [lock for lock in locked_gaits(gait, period) if lock.stable]
    assert [lock.place for lock in stable] == [Place.EARLY]
    _, drawn = shares_of(gait, period, stable, 8)
    assert list(drawn.values()) == [1.0]
    walk = walk_under_pulses(gait, period, 0.3, 200)
    # Pulses last to the end of the walk, though its strides are longer than the unperturbed ones.
    assert walk.lags[-1] == pytest.approx(stable[0].lag, abs=5e-9)


def test_a_walk_too_short_to_slip_through_is_censored_not_failed():
    period = GAIT.unperturbed_period + 0.01
    outcomes = [walk_under_pulses(GAIT, period, 0.3, strides).outcome() for strides in (50, 300)]
    assert outcomes == [Outcome.CENSORED, Outcome.SLIPPING]


def test_beyond_the_flip_every_other_stride_is_alike():
    strong = PulsedGait(TABLE_1, 0.25 * TABLE_1.peak_torque, 0.1)
    period = GAIT.unperturbed_period - 0.03
    walk = walk_under_pulses(strong, period, 0.3, 1000)
    assert walk.outcome() is Outcome.ALTERNATING
    assert abs(walk.lags[-1] - walk.lags[-2]) > 1e-3


@pytest.mark.parametrize("fraction", [0.1, 0.2, -0.1])
def test_every_border_agrees_with_the_walkers_poincare_map(fraction):
    torque = fraction * TABLE_1.peak_torque
    gait = PulsedGait(TABLE_1, torque, 0.1)
    for piece in pieces_of(gait):
        for end in (piece.first, piece.last):
            solved = gait.gaits(piece.place, np.array([end.angle])).at(0)
            speed = gait.speed(solved.apex)
            first = step_to_step(TABLE_1, speed, end.onset, 0.1, torque)
            second = step_to_step(TABLE_1, first.speed)
            assert first.duration + second.duration == pytest.approx(end.period, abs=1e-11)
            assert second.speed == pytest.approx(speed, abs=1e-11)


def test_a_walk_with_a_pulse_or_two_is_not_called_locked():
    for period in (150.0, 1e3, 1e10, 1e300):
        walk = walk_under_pulses(GAIT, period, 0.0, 100)
        assert walk.outcome() in (Outcome.CENSORED, Outcome.SLIPPING)


def test_a_pulse_without_effect_is_not_a_lock():
    # At the unperturbed period the branches end in such pulses, whatever the torque.
    for fraction in (0.1, -0.1, 0.3):
        gait = PulsedGait(TABLE_1, fraction * TABLE_1.peak_torque, 0.1)
        assert locked_gaits(gait, gait.unperturbed_period) == []


def test_a_flip_close_to_a_corner_is_not_overlooked():
    # The stable interval between the two is a hundredth of the branch, or less.
    walker = WalkerParameters(
        leg_length=0.8446,
        foot_length=0.0961,
        leg_angle=0.3186,
        max_plantarflexion=1.6442,
        ankle_stiffness=168.5,
    )
    gait = PulsedGait(walker, -0.05522 * walker.peak_torque, 0.2483)
    early = [piece for piece in pieces_of(gait) if piece.place is Place.EARLY]
    borders = [piece.last.border for piece in early]
    assert borders == [Border.FLIP, Border.FLIP, Border.END_AT_TOE_OFF]
    assert [piece.stable for piece in early] == [True, False, True]
    between = 0.5 * (early[2].first.period + early[2].last.period)
    [lock] = [lock for lock in locked_gaits(gait, between, early) if lock.stable]
    assert abs(lock.multipliers[0]) < 1


def test_no_gait_is_made_up_where_the_pulse_does_not_fit():
    # Beyond some onset the walker falls before a pulse of this width and depth has passed.
    walker = WalkerParameters(
        leg_length=1.09,
        foot_length=0.517,
        leg_angle=0.6245,
        max_plantarflexion=2.293,
        ankle_stiffness=204.5,
    )
    gait = PulsedGait(walker, -1.62 * walker.peak_torque, 0.8936)
    gaits = gait.gaits(Place.INSIDE, np.linspace(gait.heel_strike, gait.last_start, 331))
    found = np.isfinite(gaits.period)
    time = gait._pulse_time(gaits.start[found], gaits.end[found], gaits.apex[found]).time
    assert time == pytest.approx(gait.width, abs=1e-9)
