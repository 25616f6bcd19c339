# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Simulated walks under a train of pulses, which confirm the solved locks.

A walk that has not locked is called slipping only once the pulses have gone through a whole gait
cycle, and so through every phase. Near a border this takes a number of strides of about 2 tau_0
over the distance to it, so a shorter walk proves nothing and is reported as censored.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np

from gait_entrainment.conventions import nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import EndingKind
from gait_entrainment.walker.model import Floats, Model, make_model
from gait_entrainment_studies.locking.branches import LockedGait
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.walks import Pulses, walk

# A lag that creeps by less than this per stride [s], for several strides, is called locked. So
# the solver, not walking, decides for a pulse period closer than this to a border.
CREEP = 1e-7
_QUIET_STRIDES = 5

# Gait cycles that the pulses must slip through: one, plus what the first strides may skip.
_SLIPPED_CYCLES = 1.25

# The longest time that whole nanoseconds can count [s], with room for a pulse.
_CLOCK = 9e9

# How close to a solved lock a walk must end [s]: the sum of the creep that is still allowed, at a
# multiplier of 0.99, which is far below the distance between two locks.
_NEAR = 2e-5

# Strides of a walk in addition to those that slipping takes.
_SETTLING_STRIDES = 100
# Near a fold or with a slow multiplier it takes longer; a censored walk is repeated, longer.
_LONGEST = 4000


class Outcome(str, Enum):
    """The outcome of a walk under pulses, from the best to the worst."""

    LOCKED = "locked"
    ALTERNATING = "locked 2:2: every other stride alike"
    CENSORED = "censored: neither locked nor slipped through a cycle"
    """Too short to tell; or, past a flip, bound to the pulses without ever repeating itself."""
    SLIPPING = "slipping"
    FELL = "fell"
    FLEW_OFF = "flew off"


ENDINGS = {EndingKind.FALL: Outcome.FELL, EndingKind.FLY_OFF: Outcome.FLEW_OFF}


@dataclass(frozen=True)
class PulsedWalk:
    """A walk with a pulse on one leg every `period`; times in s since that leg's heel strike 0."""

    period: float
    heel_strikes: Floats
    """Of the perturbed leg, from number 0 on."""
    toe_offs: Floats
    """Of the perturbed leg, one in each stride."""
    onsets: Floats
    ending: Outcome | None
    """FELL or FLEW_OFF if the walker did so before the last stride."""

    @property
    def stride_periods(self) -> Floats:
        """Durations of the perturbed leg's strides."""
        return np.diff(self.heel_strikes)

    @property
    def unwrapped_lags(self) -> Floats:
        """Onset of pulse n minus toe-off of stride n: the lag, up to whole strides."""
        count = min(self.onsets.size, self.toe_offs.size)
        lags: Floats = self.onsets[:count] - self.toe_offs[:count]
        return lags

    @property
    def lags(self) -> Floats:
        """Pulse onset minus the nearest toe-off of the perturbed leg; NaN if that is unknown."""
        onsets = self.onsets[self.onsets <= self.toe_offs[-1]]
        after = np.clip(np.searchsorted(self.toe_offs, onsets), 1, self.toe_offs.size - 1)
        before, following = onsets - self.toe_offs[after - 1], onsets - self.toe_offs[after]
        lags: Floats = np.where(before <= -following, before, following)
        # There was another toe-off a stride before the first one of the walk.
        lags[onsets < self.toe_offs[0] - self.stride_periods[0] / 2] = np.nan
        return lags

    def outcome(self, creep: float = CREEP) -> Outcome:
        """The outcome of the walk; locked if its lag creeps by less than `creep` [s] a stride."""
        if self.ending is not None:
            return self.ending
        lags = self.unwrapped_lags
        quiet = np.abs(np.diff(lags))[-_QUIET_STRIDES:] < creep
        if quiet.size == _QUIET_STRIDES and quiet.all():
            return Outcome.LOCKED
        quiet = np.abs(lags[2:] - lags[:-2])[-2 * _QUIET_STRIDES :] < creep
        if quiet.size == 2 * _QUIET_STRIDES and quiet.all():
            return Outcome.ALTERNATING
        if abs(lags[-1] - lags[0]) > _SLIPPED_CYCLES * self.stride_periods[-1]:
            return Outcome.SLIPPING
        return Outcome.CENSORED


def walk_under_pulses(
    gait: PulsedGait, period: float, initial_phase: float, strides: int
) -> PulsedWalk:
    """
    Walk `strides` strides from the unperturbed gait with the gait's pulses on one leg.

    The period is in s. The first pulse comes `initial_phase` of an unperturbed stride after the
    leg's heel strike 0. Pulses begin and end on whole nanoseconds.
    """
    model, stride = _prepared(gait.parameters)
    # Enough for strides a third longer than the pulse period or the walker's own.
    count = int(4 / 3 * (strides + 1) * max(stride / period, 1.0)) + 1
    # There are no pulses after the end of the clock.
    count = min(count, 1 + int(_CLOCK / period))
    onsets = np.rint(np.arange(count) * (min(period, _CLOCK) * 1e9)).astype(np.int64)
    onsets += nanoseconds(initial_phase * stride)
    pulses = Pulses(onsets, nanoseconds(gait.width), gait.torque)
    walked = walk(model, 2 * strides, pulses)
    return PulsedWalk(
        period=period,
        heel_strikes=walked.heel_strikes[::2],
        toe_offs=walked.toe_offs[1::2],
        onsets=onsets[: np.searchsorted(onsets, walked.heel_strikes[-1] * 1e9)] * 1e-9,
        ending=None if walked.ending is None else ENDINGS[walked.ending],
    )


@lru_cache(maxsize=64)
def _prepared(parameters: WalkerParameters) -> tuple[Model, float]:
    """Return the walker's constants, and its unperturbed stride period [s]."""
    model = make_model(parameters)
    return model, float(walk(model, 2).heel_strikes[-1])


def shares_of(
    gait: PulsedGait, period: float, locks: Sequence[LockedGait], phases: int = 32
) -> tuple[list[Outcome], dict[LockedGait, float]]:
    """
    Walk from `phases` initial phases, spread evenly over the stride, at a pulse period [s].

    Return the outcomes of the walks, and the share of them that each stable lock draws.
    """
    distance = max(abs(period - gait.unperturbed_period), 1e-4)
    enough = _SETTLING_STRIDES + int(1.5 * gait.unperturbed_period / distance)
    outcomes: list[Outcome] = []
    lags: list[float] = []
    for phase in np.arange(phases) / phases:
        strides = min(enough, _LONGEST)
        while True:
            walked = walk_under_pulses(gait, period, float(phase), strides)
            outcome = walked.outcome()
            if outcome is not Outcome.CENSORED or strides >= _LONGEST:
                break
            strides = min(4 * strides, _LONGEST)
        outcomes.append(outcome)
        lags.append(float(walked.lags[-1]) if outcome is Outcome.LOCKED else np.nan)
    stable = [lock for lock in locks if lock.stable]
    drawn = {lock: float(np.mean(np.abs(np.array(lags) - lock.lag) < _NEAR)) for lock in stable}
    return outcomes, drawn
