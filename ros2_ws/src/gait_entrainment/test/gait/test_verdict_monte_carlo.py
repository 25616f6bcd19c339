# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""False-positive rate and power of the verdict, with bounds that a worse rule would break."""

import pytest
from monte_carlo import NOISES, STEADY, Case, interval, run, run_recorded
from synthetic_gait import Noise, follows_partly, ignores, locks, recorded_strides, white

from gait_entrainment.gait import Verdict

TRIALS = 200


def test_interval_of_a_rate() -> None:
    assert interval(0, 100) == pytest.approx((0.0, 0.0362), abs=1e-4)  # Clopper and Pearson


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("variation", [0.02, 0.03])
def test_indifferent_walker_is_rarely_called_entrained(noise: Noise, variation: float) -> None:
    outcome = run(Case(ignores, noise, variation), TRIALS)
    print(outcome)
    assert interval(outcome.ever_entrained, TRIALS)[0] < 0.025
    assert interval(outcome.final[Verdict.ENTRAINED], TRIALS)[0] < 0.01
    assert outcome.final[Verdict.DRIFTING] > 0.5 * TRIALS


def test_slow_drift_is_rarely_called_entrained() -> None:
    outcome = run(Case(follows_partly, white, 0.02), TRIALS)
    print(outcome)
    assert outcome.final[Verdict.ENTRAINED] <= 0.08 * TRIALS
    assert outcome.ever_entrained <= 0.15 * TRIALS


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("variation", [0.01, 0.03])
def test_locked_walker_is_called_entrained(noise: Noise, variation: float) -> None:
    outcome = run(Case(locks, noise, variation), TRIALS)
    print(outcome)
    assert outcome.final[Verdict.ENTRAINED] > 0.95 * TRIALS
    assert outcome.final[Verdict.DRIFTING] + outcome.final[Verdict.LOST] <= 0.02 * TRIALS


@pytest.mark.parametrize(("least", "below"), [(0.0, STEADY), (STEADY, 1.0)])
def test_recorded_strides(least: float, below: float) -> None:
    if not recorded_strides():
        pytest.skip("PhysioNet's gait-maturation-db is not in shared/data next to the repository")
    indifferent = run_recorded(ignores, least, below)
    assert indifferent.final[Verdict.ENTRAINED] <= 0.015 * indifferent.trials
    locking = run_recorded(locks, least, below)
    assert locking.followed[Verdict.ENTRAINED] >= 0.95 * locking.followed.total()
    assert not locking.slipped[Verdict.ENTRAINED]
    assert locking.slipped.total() < 0.1 * locking.trials
