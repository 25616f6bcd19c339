# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the walker, walked in stretches as promises of torque arrive."""

from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.robot import ProfileError, TorqueProfile
from gait_entrainment.walker import Ending, Samples, Transition, Walker

# Longest promise to a walker of human size [s]; an experiment requests a stride.
_LONGEST_PROMISE = 1000.0


@dataclass(frozen=True)
class Stretch:
    """What happened in one stretch of a run, which is walked in one go."""

    transitions: list[Transition]  # gait events in it
    sample_times: np.ndarray  # [ns since the start of the run], (n,)
    samples: Samples | None  # at those times; None if there are none


class WalkerRun:
    """
    Walks one run and keeps the figures that a node must report.

    Heel strike 0, at time 0, is that of ``first_heel_strike``. There are ``sample_rate`` samples
    per second; 0 samples at the gait events, None not at all. ``variation`` and ``seed`` determine
    how strides vary. Torque is promised for one ankle, or for ``both_ankles``.

    How a run is cut into stretches changes neither events nor samples: the grid of samples is
    fixed, and the walker's state is always computed from the last switch.
    """

    def __init__(
        self,
        parameters: WalkerParameters,
        first_heel_strike: Side,
        sample_rate: float | None,
        variation: Variation | None = None,
        seed: int = 0,
        *,
        both_ankles: bool = False,
    ) -> None:
        self._walker = Walker(parameters, first_heel_strike, variation=variation, seed=seed)
        self._longest = _LONGEST_PROMISE * parameters.time_scale
        self._sampled = sample_rate is not None
        self._period = NANOSECONDS_PER_SECOND / sample_rate if sample_rate else None
        self.ankles = 1 + both_ankles  # number of those whose torque is promised
        self._promised: dict[Side, int] = {}  # time up to which torque is promised [ns]
        self.reached = 0  # everything up to this time has been walked [ns]
        self.events = 0  # gait events so far
        self.samples = 0  # samples so far
        self.late = 0  # promised torque that arrived too late and was not walked [ns]
        self.starved = 0  # walked without torque for lack of a promise [ns]
        self.ended = False  # whether the run is over

    @property
    def promised(self) -> int:
        """Time up to which all torque is promised [ns]."""
        return min(self._promised.values()) if len(self._promised) >= self.ankles else 0

    @property
    def ending(self) -> Ending | None:
        """How the walker ended the run by itself, if it did: a fall or a fly-off."""
        return self._walker.ending

    @property
    def next_sample(self) -> int:
        """Time of the next sample of the grid [ns]; far in the future if there is no grid."""
        return 2**62 if self._period is None else round(self.samples * self._period)

    def accept(self, profile: TorqueProfile) -> int:
        """
        Take a promise; return how much of it [ns] arrived too late to be walked.

        Raises ProfileError if it does not adjoin the one before, is invalid, or is longer than any
        experiment requests.
        """
        begin = self._promised.get(profile.side, 0)
        length = (profile.valid_until - max(begin, self.reached)) / NANOSECONDS_PER_SECOND
        if length > self._longest:
            raise ProfileError(f"a profile of {length:.3g} s; allowed: {self._longest:.3g} s")
        if not profile.has_length:
            return 0
        profile.check(begin)
        self._promised[profile.side] = profile.valid_until
        late = max(min(self.reached, profile.valid_until) - profile.times[0], 0)
        self.late += late
        if profile.valid_until > self.reached:
            # The past stays as it was walked, without torque; the rest keeps its times.
            self._walker.promise(profile)
        return late

    def stop(self, stamp: int) -> None:
        """End all torque at a time [ns], or now if that is past."""
        self._walker.cut_torque(max(stamp, self.reached))

    def advance(self, until: int, last: bool = False) -> Stretch:
        """Walk up to a time [ns]; with ``last`` the run is over then."""
        begin = self.reached
        transitions = self._walker.advance(until)
        self.starved += max(until - max(begin, self.promised), 0)
        ending = self._walker.ending
        self.reached = until if ending is None else min(nanoseconds(ending.time), until)
        self.ended = last or ending is not None
        times = np.array(self._sample_times(transitions), np.int64)
        self.events += len(transitions)
        self.samples += times.size
        return Stretch(transitions, times, self._walker.sample(times) if times.size else None)

    def _sample_times(self, transitions: list[Transition]) -> list[int]:
        """Return the times [ns] of the samples that are due."""
        if not self._sampled:
            return []
        if self._period is None:
            return [transition.stamp for transition in transitions]
        # Torque at ``reached`` itself belongs to the next promise.
        times, number = [], self.samples
        while (instant := round(number * self._period)) < self.reached:
            times.append(instant)
            number += 1
        return times
