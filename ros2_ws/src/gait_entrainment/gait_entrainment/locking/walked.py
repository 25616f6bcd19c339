# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Walks under a train of pulses, by the walker in time: what the solved locks are confirmed with.

A walk that has not locked is called slipping only when the pulses have gone through a whole gait
cycle: then every phase has been tried. Near a border that takes of the order of 2 tau_0 over the
distance to it in strides, so a shorter walk proves nothing and is reported as censored.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from gait_entrainment.conventions import EventKind, Side, nanoseconds
from gait_entrainment.locking.pulsed_gait import Floats
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Ending, Walker

# A lag that creeps by less than this per stride [s], for several strides, is called locked. So a
# pulse period closer than this to a border is decided by the solver, not by walking.
_CREEP = 1e-7
_QUIET_STRIDES = 5

# Gait cycles that the pulses must slip through: one, and what the first strides may have skipped.
_SLIPPED_CYCLES = 1.25


class Outcome(str, Enum):
    """What became of a walk under pulses."""

    LOCKED = "locked"
    SLIPPING = "slipping"
    CENSORED = "censored: too short to tell"
    ENDED = "fell or flew off"


@dataclass(frozen=True)
class PulsedWalk:
    """A walk with one pulse on the right leg every `period`; times in s since heel strike 0."""

    period: float
    heel_strikes: Floats
    """Of the perturbed leg, from number 0 on."""
    toe_offs: Floats
    """Of the perturbed leg, one in each stride."""
    onsets: Floats
    ending: Ending | None

    @property
    def stride_periods(self) -> Floats:
        """Durations of the perturbed leg's strides."""
        return np.diff(self.heel_strikes)

    @property
    def unwrapped_lags(self) -> Floats:
        """Onset of pulse n minus toe-off of stride n, which is a lag up to whole strides."""
        count = min(self.onsets.size, self.toe_offs.size)
        lags: Floats = self.onsets[:count] - self.toe_offs[:count]
        return lags

    @property
    def lags(self) -> Floats:
        """Pulse onset minus the nearest toe-off of the perturbed leg; NaN if that is not known."""
        onsets = self.onsets[self.onsets <= self.toe_offs[-1]]
        after = np.clip(np.searchsorted(self.toe_offs, onsets), 1, self.toe_offs.size - 1)
        before, following = onsets - self.toe_offs[after - 1], onsets - self.toe_offs[after]
        lags: Floats = np.where(before <= -following, before, following)
        # A stride before the first toe-off of the walk there was another one.
        lags[onsets < self.toe_offs[0] - self.stride_periods[0] / 2] = np.nan
        return lags

    @property
    def outcome(self) -> Outcome:
        """Whether it has locked, and whether it was long enough to say that it does not."""
        if self.ending is not None:
            return Outcome.ENDED
        lags = self.unwrapped_lags
        if (np.abs(np.diff(lags[-_QUIET_STRIDES - 1 :])) < _CREEP).all():
            return Outcome.LOCKED
        if abs(lags[-1] - lags[0]) > _SLIPPED_CYCLES * self.stride_periods[-1]:
            return Outcome.SLIPPING
        return Outcome.CENSORED


def walk_under_pulses(
    parameters: WalkerParameters,
    torque: float,
    width: float,
    period: float,
    initial_phase: float,
    pulses: int,
) -> PulsedWalk:
    """
    Walk from the unperturbed gait with pulses on the right leg.

    The first comes at this fraction of an unperturbed stride after the leg's heel strike 0.
    Instants of the pulses are whole nanoseconds, as everywhere in the project.
    """
    walker = Walker(parameters, Side.RIGHT)
    far = nanoseconds((pulses + 2) * max(period, 1.0)) + 10**10
    walker.extend_torque(Side.LEFT, [], [], far)
    step = _unperturbed_step(parameters)
    first = nanoseconds(2 * step * initial_phase)
    onsets = first + np.rint(np.arange(pulses) * period * 1e9).astype(np.int64)
    changes = np.column_stack([onsets, onsets + nanoseconds(width)]).ravel()
    walker.extend_torque(Side.RIGHT, changes, np.tile([torque, 0.0], pulses), far)
    events = walker.advance(int(onsets[-1]) + nanoseconds(width))
    right = [event for event in events if event.side is Side.RIGHT]
    strikes = [e.time for e in right if e.kind is EventKind.HEEL_STRIKE]
    return PulsedWalk(
        period=period,
        heel_strikes=np.array([0.0, *(time for time in strikes if time > 0)]),
        toe_offs=np.array([e.time for e in right if e.kind is EventKind.TOE_OFF]),
        onsets=onsets * 1e-9,
        ending=walker.ending,
    )


def _unperturbed_step(parameters: WalkerParameters) -> float:
    """Duration of a step of the unperturbed gait [s]."""
    walker = Walker(parameters, Side.RIGHT)
    while True:
        for event in walker.advance(walker.time_reached + 10**9):
            if event.kind is EventKind.HEEL_STRIKE and event.step == 1:
                return event.time
