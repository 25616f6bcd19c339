# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Which initial phases each stable lock draws, by walking from the unperturbed gait."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gait_entrainment_studies.locking.branches import LockedGait
from gait_entrainment_studies.locking.pulsed_gait import Floats, PulsedGait
from gait_entrainment_studies.locking.walked import Outcome, walk_under_pulses

# How close to a solved lock a walk must end [s]: what the creep still allowed adds up to at a
# multiplier of 0.99, far below the distance between two locks.
_NEAR = 2e-5

# Strides that a walk is given beside those that slipping takes.
_SETTLING_STRIDES = 100
# Near a fold or beside a slow multiplier it takes longer; a walk still censored is walked again.
_LONGEST = 4000


@dataclass(frozen=True)
class Shares:
    """What became of walks from initial phases spread evenly over the stride."""

    phases: Floats
    outcomes: tuple[Outcome, ...]
    final_lags: Floats
    locks: tuple[LockedGait, ...]
    """The stable locked gaits."""
    drawn: tuple[float, ...]
    """Share of the initial phases that each draws, in the order of `locks`."""

    def share(self, outcome: Outcome) -> float:
        """Share of the initial phases with this outcome."""
        return self.outcomes.count(outcome) / len(self.outcomes)


def shares_of(
    gait: PulsedGait, period: float, locks: Sequence[LockedGait], phases: int = 32
) -> Shares:
    """Walk from `phases` initial phases at a pulse period [s] and see which lock each ends in."""
    initial = np.arange(phases) / phases
    stable = tuple(lock for lock in locks if lock.stable)
    distance = max(abs(period - gait.unperturbed_period), 1e-4)
    enough = _SETTLING_STRIDES + int(1.5 * gait.unperturbed_period / distance)
    outcomes, lags = [], []
    for phase in initial:
        strides = min(enough, _LONGEST)
        while True:
            walk = walk_under_pulses(
                gait.parameters, gait.torque, gait.width, period, float(phase), strides
            )
            outcome = walk.outcome()
            if outcome is not Outcome.CENSORED or strides >= _LONGEST:
                break
            strides = min(4 * strides, _LONGEST)
        outcomes.append(outcome)
        lags.append(float(walk.lags[-1]) if outcome is Outcome.LOCKED else np.nan)
    final = np.array(lags)
    drawn = tuple(float(np.mean(np.abs(final - lock.lag) < _NEAR)) for lock in stable)
    return Shares(initial, tuple(outcomes), final, stable, drawn)
