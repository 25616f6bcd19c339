# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""False-positive rate and power of the verdict, with bounds that a worse rule would break."""

import pytest
from monte_carlo import NOISES, Case, interval, run
from synthetic_gait import (
    Noise,
    autoregressive,
    follows_partly,
    ignores,
    locks,
    long_range,
    white,
)

from gait_entrainment.gait import Verdict

TRIALS = 200


@pytest.mark.parametrize("noise", NOISES)
def test_indifferent_walker_is_rarely_called_entrained(noise: Noise) -> None:
    outcome = run(Case(ignores, noise, 0.02), TRIALS)
    print(outcome)
    assert interval(outcome.ever_entrained, TRIALS)[0] < 0.05
    assert outcome.final[Verdict.ENTRAINED] <= 0.02 * TRIALS
    assert outcome.final[Verdict.DRIFTING] > 0.6 * TRIALS


def test_slow_drift_is_rarely_called_entrained() -> None:
    outcome = run(Case(follows_partly, white, 0.02), TRIALS)
    print(outcome)
    assert outcome.final[Verdict.ENTRAINED] <= 0.05 * TRIALS
    assert outcome.ever_entrained <= 0.15 * TRIALS


@pytest.mark.parametrize(
    ("noise", "variation", "power"),
    [
        (white, 0.02, 0.7),
        (white, 0.01, 0.98),
        (autoregressive, 0.01, 0.7),
        (long_range, 0.01, 0.8),
    ],
)
def test_locked_walker_is_called_entrained(noise: Noise, variation: float, power: float) -> None:
    outcome = run(Case(locks, noise, variation), TRIALS)
    print(outcome)
    assert outcome.final[Verdict.ENTRAINED] > power * TRIALS
    assert outcome.final[Verdict.DRIFTING] + outcome.final[Verdict.LOST] <= 0.02 * TRIALS
