# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Study planning, checked against known results and the Monte Carlo of the verdict."""

import numpy as np
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.errors import UsageError
from gait_entrainment.gait import Verdict, analyze
from gait_entrainment_sessions import statistics
from gait_entrainment_sessions.power import Power, PowerPlan, enough_of, power, walk
from gait_entrainment_studies.cohort.population import step_noise


def test_steady_walks_are_judged_correctly_as_soon_as_possible():
    plan = PowerPlan(variation=0.001, gain=0.9, trials=20)
    found = power(plan, -0.05, [10, 60])
    assert [(row.pulses, row.wrongly.value) for row in found] == [(10, 0.0), (60, 0.0)]
    assert found[0].drifting.value == 0.0
    assert (found[1].entrained.value, found[1].drifting.value) == (1.0, 1.0)


def test_chances_are_those_of_the_monte_carlo_in_docs_analysis():
    plan = PowerPlan(variation=0.03, hurst=0.85, stride=1.934, trials=80, limit=1.0, seed=1)
    (found,) = power(plan, -0.05, [50])
    # Rows "ignores" and "locks", long range, 3 %: 83.6 and 96.8 %.
    assert found.drifting.low < 0.836 < found.drifting.high
    assert found.entrained.low < 0.968
    assert found.wrongly.low < 0.008 < found.wrongly.high


def test_the_slope_passes_more_walkers_that_ignore_the_pulses_than_the_verdict():
    plan = PowerPlan(variation=0.03, hurst=0.85, stride=1.934)
    slopes_pass = verdicts_pass = 0
    noise = step_noise(0, 15 + 52, 100, plan.hurst).T
    for row, generator in zip(noise, np.random.default_rng(0).spawn(100), strict=True):
        free = plan.stride * (1 + plan.variation * row)
        found = analyze(*walk(plan, free, -0.05, 50, locks=False, generator=generator), Side.RIGHT)
        last = statistics.last_pulses(found)[-statistics.SLOPE_PULSES :]
        slope = statistics.slope([p.stride for p in last], [p.unwrapped_lag for p in last])
        slopes_pass += slope.low < 0 < slope.high
        verdicts_pass += found.entrainments[-1].verdict is Verdict.ENTRAINED
    assert (slopes_pass, verdicts_pass) == (9, 2)


@pytest.mark.parametrize(
    ("chances", "enough"),
    [((0.5, 0.8, 0.9), 20), ((0.8, 0.7, 0.9), 30), ((0.9, 0.9, 0.7), None), ((1, 1, 1), 10)],
)
def test_enough_pulses_means_that_any_more_are_also_enough(chances, enough):
    estimates = [statistics.Estimate(chance, 0, 1) for chance in chances]
    found = [Power(10 * n, e, e, e) for n, e in enumerate(estimates, start=1)]
    assert enough_of(found, 0.8) == enough


def test_an_offset_at_which_no_walker_locks_is_refused():
    with pytest.raises(UsageError, match=r"period_offset: -0.2 s; allowed: within 0.088 s"):
        power(PowerPlan(), -0.2)
