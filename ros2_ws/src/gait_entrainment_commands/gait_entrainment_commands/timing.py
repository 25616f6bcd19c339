# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
When a pulse really came: commanded, sent and measured onset, from the device's own states.

The commanded onset was planned. The sent onset is the stamp of the first state in which the pulse
has been sent to the device. The measured onset is the instant at which the measured torque
crosses a fraction of the pulse's height, interpolated between two states.
"""

import math
from bisect import bisect_left, insort
from collections.abc import Sequence
from operator import attrgetter

from gait_entrainment.conventions import nanoseconds
from gait_entrainment.robot import Pulse, PulseTiming, RobotState

# Half the height: only noise that large can be mistaken for it, and the instant does not depend on
# where the flank becomes visible.
CROSSING = 0.5
# If states are further apart [ns], the torque is taken to have jumped at the later one: there is
# nothing to interpolate.
LONGEST_GAP = 20_000_000
# A device that is this late after the end of a pulse did not deliver it [s].
LATEST = 0.2
_STAMP = attrgetter("stamp")


def measured_onset(
    stamps: Sequence[int], torques: Sequence[float], height: float, fraction: float = CROSSING
) -> tuple[int, int] | None:
    """
    Find where a torque first rises through a fraction of a pulse's height.

    ``stamps`` [ns] ascend and start before the pulse; ``torques`` [N m] are measured at them, NaN
    if missing. A negative ``height`` [N m] is crossed downwards; ``fraction`` is in (0, 1).

    Returns the index of the first state past the crossing and the instant of the crossing [ns],
    interpolated linearly between two states. None if the torque never gets there, or exceeds the
    threshold from the first state on.
    """
    before: tuple[int, float] | None = None
    for index, (stamp, torque) in enumerate(zip(stamps, torques, strict=True)):
        level = torque / height
        if not math.isfinite(level):
            continue
        if level >= fraction and before is not None and before[1] < fraction:
            earlier, lower = before
            if stamp - earlier > LONGEST_GAP:
                return index, stamp
            share = (fraction - lower) / (level - lower)
            return index, earlier + round((stamp - earlier) * share)
        before = (stamp, level)
    return None


class MeasuredOnsets:
    """
    Times each pulse once everything that it depends on is known, in a run or from its record.

    A robot reports its pulses in three streams, each of which may be ahead of the others: promises
    give the onsets, announcements height and width, states the torque. A pulse is judged by the
    states up to LATEST after its end, or up to the onset of the next pulse. So the timings do not
    depend on how the streams interleave; they are those of the whole run processed in one go. (A
    stop is an exception: it takes effect when it happens.)

    Each ``add`` returns the onsets that have become known and the instant before which no more
    will follow, as ``GaitAnalyzer.add_promise`` takes them.
    """

    def __init__(self) -> None:
        self.timings: list[PulseTiming] = []  # of the pulses so far, in order
        self.states_until = 0  # stamp of the latest state [ns]
        self._promised = 0  # every pulse that begins before this has been named [ns]
        self._named: list[int] = []  # onsets of pulses not judged yet; ascending
        self._announced: dict[int, tuple[float, float]] = {}  # their height, width
        self._states: list[RobotState] = []  # ascending; those of pulses not judged yet

    def add_promise(self, onsets: Sequence[int], valid_until: int) -> tuple[list[int], int]:
        """Take the onsets of pulses [ns] and the promise that no others lie before an instant."""
        self._named += onsets
        self._promised = valid_until
        return self._judge_what_is_known()

    def add_pulse(self, onset: int, height: float, width: float) -> tuple[list[int], int]:
        """Take the announcement of a pulse: onset [ns], height [N m], width [s]."""
        self._announced[onset] = height, width
        return self._judge_what_is_known()

    def add_state(self, state: RobotState) -> tuple[list[int], int]:
        """Take a state of the robot."""
        insort(self._states, state, key=_STAMP)
        self.states_until = max(self.states_until, state.stamp)
        return self._judge_what_is_known()

    def stop(self, stamp: int) -> None:
        """Take a stop [ns]: pulses from that time on were promised but never came."""
        self._promised = min(self._promised, stamp)
        self._named = [onset for onset in self._named if onset < stamp]

    def finish(self) -> list[int]:
        """End the run; return the remaining onsets. One never announced is as commanded."""
        onsets, _ = self._judge_what_is_known(ended=True)
        return onsets

    def _judge_what_is_known(self, ended: bool = False) -> tuple[list[int], int]:
        count = len(self.timings)
        while self._named and (ended or self._next_is_known()):
            self.timings.append(self._judge())
        until = min([self._promised, *self._named[:1]])
        self._forget_states_before(until)
        # A crossing lies at most one gap before the state that shows it.
        return [timing.onset for timing in self.timings[count:]], until - LONGEST_GAP

    def _next_is_known(self) -> bool:
        """Whether the next pulse, the one after it, and all states in between are known."""
        onset, *later = self._named[:2]
        if onset not in self._announced:
            return False
        end = self._end(onset, self._announced[onset][1], later)
        return end < self.states_until and (bool(later) or end <= self._promised)

    def _judge(self) -> PulseTiming:
        """Remove the next pulse from those named, and return its timing."""
        onset = self._named.pop(0)
        announced = height, width = self._announced.pop(onset, (math.nan, math.nan))
        if height == 0 or math.isnan(height):
            return PulseTiming(onset, None, None, *announced)
        end = self._end(onset, width, self._named[:1])
        self._forget_states_before(onset)
        seen = [state for state in self._states if state.stamp <= end]
        during = (state for state in seen if state.stamp >= onset)
        sent = next((state.stamp for state in during if state.commanded / height > 0), None)
        stamps, torques = [s.stamp for s in seen], [s.measured for s in seen]
        found = measured_onset(stamps, torques, height)
        if found is None:
            return PulseTiming(onset, sent, None, *announced)
        index, measured = found
        if seen[index].measured == seen[index].commanded:
            # Equal to the last bit: computed rather than measured, and known at each jump.
            measured = seen[index].stamp
        return PulseTiming(onset, sent, measured, *announced)

    def _end(self, onset: int, width: float, later: Sequence[int]) -> int:
        """Return the end [ns] of the states by which a pulse is judged."""
        return min([onset + nanoseconds(width + LATEST), *later])

    def _forget_states_before(self, instant: int) -> None:
        """Drop the states before an instant [ns], except for the last one."""
        first = bisect_left(self._states, instant, key=_STAMP)
        del self._states[: max(first - 1, 0)]


def timings_of(pulses: Sequence[Pulse], states: Sequence[RobotState]) -> list[PulseTiming]:
    """Return when the pulses of a whole run began, by all states of their robot."""
    onsets = MeasuredOnsets()
    onsets.add_promise([pulse.onset for pulse in pulses], 0)
    for pulse in pulses:
        onsets.add_pulse(pulse.onset, pulse.torque, pulse.duration)
    for state in states:
        onsets.add_state(state)
    onsets.finish()
    return onsets.timings


def late_ms(timing: PulseTiming, kind: str) -> float | None:
    """Return by how many ms the "sent" or "measured" onset came after the command."""
    onset: int | None = getattr(timing, kind)
    return None if onset is None else (onset - timing.commanded) / 1e6


def lateness_ms(timings: Sequence[PulseTiming], kind: str) -> list[float]:
    """Return by how many ms pulses were "sent" or "measured" after their command, ascending."""
    return sorted(late for timing in timings if (late := late_ms(timing, kind)) is not None)


def quantile(ascending: Sequence[float], share: float) -> float:
    """Return the value at or below which a share of the values lies (nearest rank)."""
    return ascending[max(math.ceil(share * len(ascending)) - 1, 0)]
