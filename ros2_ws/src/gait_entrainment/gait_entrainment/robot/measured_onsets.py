# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The onset of each pulse as measured, while a run goes on or from its record: one code for both.

What a robot tells of its pulses comes in three streams: promises name the onsets, announcements
say height and width, states show the torque. On topics, each may be ahead of the others.
"""

from bisect import bisect_left, insort
from operator import attrgetter

from gait_entrainment.robot.contract import RobotState
from gait_entrainment.robot.timing import LONGEST_GAP, PulseTiming, TimingAudit

_STAMP = attrgetter("stamp")


class MeasuredOnsets:
    """
    Times each pulse once all that it depends on is here; never sooner.

    A state is looked at when every pulse that begins before it has been promised and announced,
    and a later state is known. So the timings are those of an audit of the whole run at once,
    however the streams interleave. (A stop is not bound by this: it happens when it happens.)

    Each ``add`` returns the onsets that have become known, with the instant before which none
    will follow: what ``GaitAnalyzer.add_promise`` takes.

    Attributes
    ----------
    timings
        Of the pulses so far, in the order of their commands.
    states_until
        Stamp of the latest state [ns].

    """

    def __init__(self) -> None:
        self.timings: list[PulseTiming] = []
        self.states_until = 0
        self._audit = TimingAudit()
        self._promised = 0  # every pulse that begins before this has been named [ns]
        self._named: list[int] = []  # onsets whose pulse has not been announced yet; ascending
        self._announced: dict[int, tuple[float, float]] = {}  # height, width; not named yet
        self._audited: list[int] = []  # onsets of pulses that the audit has not judged yet
        self._states: list[RobotState] = []  # not looked at yet; ascending

    def add_promise(self, onsets: list[int], valid_until: int) -> tuple[list[int], int]:
        """Take the onsets of pulses [ns], and the promise that no others lie before an instant."""
        self._named += onsets
        self._promised = valid_until
        return self._resolve()

    def add_pulse(self, onset: int, height: float, duration: float) -> tuple[list[int], int]:
        """Take the announcement of a pulse: onset [ns], height [N m], width [s]."""
        self._announced[onset] = height, duration
        return self._resolve()

    def add_state(self, state: RobotState) -> tuple[list[int], int]:
        """Take a state of the robot."""
        insort(self._states, state, key=_STAMP)
        self.states_until = max(self.states_until, state.stamp)
        return self._resolve()

    def stop(self, stamp: int) -> None:
        """Take a stop [ns]: pulses that begin from it on were promised and never came."""
        self._promised = min(self._promised, stamp)
        self._audit.stop(stamp)
        self._named = [onset for onset in self._named if onset < stamp]
        self._audited = [onset for onset in self._audited if onset < stamp]

    def finish(self) -> list[int]:
        """End the run; returns the remaining onsets. One never announced is as commanded."""
        self._hand_over()
        onsets = self._take([*self._audit.add_states(self._states), *self._audit.finish()])
        self._states = []
        self.timings += [PulseTiming(onset, None, None) for onset in self._named]
        self.timings.sort(key=attrgetter("commanded"))
        return onsets + self._named

    def _resolve(self) -> tuple[list[int], int]:
        self._hand_over()
        known = min([self._promised, self.states_until, *self._named[:1]])
        count = bisect_left(self._states, known, key=_STAMP)
        ready, self._states = self._states[:count], self._states[count:]
        onsets = self._take(self._audit.add_states(ready))
        # A crossing lies at most one gap before the state that shows it.
        until = min([self._promised, *self._named[:1], *self._audited[:1]]) - LONGEST_GAP
        return onsets, until

    def _hand_over(self) -> None:
        """Give the audit the pulses that have been named and announced, in their order."""
        while self._named and self._named[0] in self._announced:
            onset = self._named.pop(0)
            self._audited.append(onset)
            self._audit.add_pulse(onset, *self._announced.pop(onset))

    def _take(self, timings: list[PulseTiming]) -> list[int]:
        """Keep timings and return their onsets."""
        self._audited = self._audited[len(timings) :]
        self.timings += timings
        return [timing.onset for timing in timings]
