# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The plan of a study, against what must be and what the Monte Carlo of the verdict measured."""

import pytest

from gait_entrainment.errors import UsageError
from gait_entrainment_sessions.power import PowerPlan, power


def test_steady_walks_are_judged_right_as_soon_as_they_can_be():
    plan = PowerPlan(variation=0.001, gain=0.9, trials=20)
    found = power(plan, -0.05, [10, 60])
    assert [(one.pulses, one.wrongly.value) for one in found] == [(10, 0.0), (60, 0.0)]
    assert found[0].drifting.value == 0.0
    assert (found[1].entrained.value, found[1].drifting.value) == (1.0, 1.0)


def test_chances_are_those_of_the_monte_carlo_in_docs_analysis():
    plan = PowerPlan(variation=0.03, hurst=0.85, stride=1.934, trials=80, limit=1.0, seed=1)
    (found,) = power(plan, -0.05, [50])
    # Rows "ignores" and "locks", long range, 3 %: 83.6 and 96.8 %.
    assert found.drifting.low < 0.836 < found.drifting.high
    assert found.entrained.low < 0.968
    assert found.wrongly.low < 0.008 < found.wrongly.high


def test_an_offset_at_which_nobody_locks_is_refused():
    with pytest.raises(UsageError, match=r"period_offset: -0.2 s; allowed: within 0.088 s"):
        power(PowerPlan(), -0.2)
