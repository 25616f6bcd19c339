# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the walker, walked in stretches as promises of torque come in."""

from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.robot import TorqueProfile
from gait_entrainment.walker.sampling import Samples
from gait_entrainment.walker.walker import Ending, Transition, Walker


@dataclass(frozen=True)
class Stretch:
    """What happened in one stretch of a run."""

    transitions: list[Transition]  # gait events in it
    sample_times: np.ndarray  # [ns since the start of the run], shape (n,), int64
    samples: Samples | None  # at those instants; None where there are none


class WalkerRun:
    """
    Walks one run and keeps account of what a node must report.

    How a run is cut into stretches changes neither events nor samples: the grid of samples is
    fixed, and the walker's state is only ever computed from the last switching instant.

    Parameters
    ----------
    parameters
        The walker.
    first_heel_strike
        Leg of heel strike 0, at time 0.
    sample_rate
        Samples per second; 0 samples at the gait events, None not at all.

    Attributes
    ----------
    reached
        Instant up to which everything has been walked [ns since the start of the run].
    events, samples
        Gait events and samples so far.
    late
        Length of promised torque that came after its instant [ns], and so was not walked.
    starved
        Length of stretches walked without torque for want of a promise [ns].
    ended
        Whether the run is over; ``ending`` says how the walker ended it, if it did.

    """

    def __init__(
        self, parameters: WalkerParameters, first_heel_strike: Side, sample_rate: float | None
    ) -> None:
        self._walker = Walker(parameters, first_heel_strike)
        self._sampled = sample_rate is not None
        self._period = NANOSECONDS_PER_SECOND / sample_rate if sample_rate else None
        self._promised = 0
        self.reached = 0
        self.events = 0
        self.samples = 0
        self.late = 0
        self.starved = 0
        self.ended = False

    @property
    def ending(self) -> Ending | None:
        """How the walker ended the run by itself: a fall or a fly-off."""
        return self._walker.ending

    @property
    def next_sample(self) -> int:
        """Instant of the next sample of the grid [ns]; far away where there is no grid."""
        return 2**62 if self._period is None else round(self.samples * self._period)

    def accept(self, profile: TorqueProfile) -> int:
        """
        Take a promise; return how much of it [ns] came too late to be walked.

        Raises
        ------
        ProfileError
            if it does not adjoin the one before, or breaks its contract in another way.

        """
        if not profile.has_length:
            return 0
        profile.check(self._promised)
        self._promised = profile.valid_until
        late = max(min(self.reached, profile.valid_until) - profile.times[0], 0)
        self.late += late
        if profile.valid_until > self.reached:
            # What is over stays as it was walked, without torque; the rest keeps its instants.
            self._walker.extend_torque(
                profile.side, profile.times, profile.torques, profile.valid_until
            )
        return late

    def stop(self, stamp: int) -> None:
        """End all torque at an instant [ns], or now where that is over."""
        self._walker.cut_torque(max(stamp, self.reached))

    def advance(self, until: int, last: bool = False) -> Stretch:
        """Walk up to an instant [ns]; with ``last`` the run is over then."""
        begin = self.reached
        transitions = self._walker.advance(until)
        self.starved += max(until - max(begin, self._promised), 0)
        ending = self._walker.ending
        self.reached = until if ending is None else min(nanoseconds(ending.time), until)
        self.ended = last or ending is not None
        times = self._sample_times(transitions, self.reached)
        self.events += len(transitions)
        self.samples += len(times)
        return Stretch(transitions, times, self._walker.sample(times) if len(times) else None)

    def _sample_times(self, transitions: list[Transition], until: int) -> np.ndarray:
        """Return the instants of the samples that are due before ``until`` [ns]."""
        if not self._sampled:
            return np.empty(0, np.int64)
        if self._period is None:
            return np.array([t.stamp for t in transitions], np.int64)
        # Torque at ``until`` itself belongs to the next promise.
        end = self.samples
        while round(end * self._period) < until:
            end += 1
        return np.array([round(k * self._period) for k in range(self.samples, end)], np.int64)
