# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
When a pulse really came: commanded, sent and measured onset, from the device's own states.

The commanded onset is the one that was planned. The sent onset is the stamp of the first state in
which the device has been asked for the pulse. The measured onset is the instant at which the
measured torque crosses a fraction of the pulse's height, interpolated between two states.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import nanoseconds
from gait_entrainment.robot.contract import RobotState

# Half the height: noise has to reach that far to be mistaken, and the instant does not depend on
# where the flank starts to be seen.
CROSSING = 0.5
# A device this late after the end of a pulse did not deliver it [s].
LATEST = 0.2
# States further apart [ns] are those of a torque that jumped at the later one: there is nothing
# to interpolate over.
LONGEST_GAP = 20_000_000


def measured_onset(
    stamps: Sequence[int], torques: Sequence[float], height: float, fraction: float = CROSSING
) -> tuple[int, int] | None:
    """
    Find where a torque first rises through a fraction of a pulse's height.

    Parameters
    ----------
    stamps
        Instants [ns], ascending, from before the pulse on.
    torques
        Measured torque at them [N m]; NaN where there is none.
    height
        Of the pulse [N m]; a negative one is crossed downwards.
    fraction
        Of the height, in (0, 1).

    Returns
    -------
    (int, int) or None
        Index of the first state past the crossing, and the instant of the crossing [ns],
        interpolated linearly between two states; None where the torque never gets there. A
        torque that is over the threshold from the first state on has no onset in view.

    """
    before: tuple[int, float] | None = None
    for index, (stamp, torque) in enumerate(zip(stamps, torques, strict=True)):
        level = torque / height
        if math.isnan(level):
            continue
        if level >= fraction and before is not None and before[1] < fraction:
            earlier, lower = before
            if stamp - earlier > LONGEST_GAP:
                return index, stamp
            share = (fraction - lower) / (level - lower)
            return index, earlier + round((stamp - earlier) * share)
        before = (stamp, level)
    return None


@dataclass(frozen=True)
class PulseTiming:
    """Onsets of one pulse [ns]; None where the states do not show it."""

    commanded: int
    sent: int | None
    measured: int | None

    @property
    def onset(self) -> int:
        """The measured onset; the commanded one where no torque shows it."""
        return self.commanded if self.measured is None else self.measured


@dataclass(frozen=True)
class _Pulse:
    onset: int
    height: float
    duration: float

    @property
    def judged_at(self) -> int:
        return self.onset + nanoseconds(self.duration + LATEST)


class TimingAudit:
    """Follows pulses and states as they come; tells the timing of each pulse once it is known."""

    def __init__(self) -> None:
        self._pulses: list[_Pulse] = []
        self._states: list[RobotState] = []

    def add_pulse(self, onset: int, height: float, duration: float) -> None:
        """Note a pulse: commanded onset [ns], height [N m], width [s]."""
        self._pulses.append(_Pulse(onset, height, duration))

    def stop(self, stamp: int) -> None:
        """Forget the pulses that would have begun from an instant [ns] on."""
        self._pulses = [pulse for pulse in self._pulses if pulse.onset < stamp]

    def add_states(self, states: Sequence[RobotState]) -> list[PulseTiming]:
        """Note states, and return the timing of the pulses about which all is known now."""
        self._states += states
        done = []
        while self._pulses and self._states and self._states[-1].stamp >= self._judged_at():
            done.append(self._judge(self._pulses.pop(0)))
        if not self._pulses and self._states:
            # One from before the next pulse is enough, and keeps an idle device from filling up.
            del self._states[:-1]
        return done

    def finish(self) -> list[PulseTiming]:
        """Return the timing of the remaining pulses, from what is known."""
        done = []
        while self._pulses:
            done.append(self._judge(self._pulses.pop(0)))
        return done

    def _judged_at(self) -> int:
        """Return the instant [ns] at which the oldest pulse can be judged."""
        pulse = self._pulses[0]
        return min([pulse.judged_at, *(other.onset for other in self._pulses[1:2])])

    def _judge(self, pulse: _Pulse) -> PulseTiming:
        end = min([pulse.judged_at, *(other.onset for other in self._pulses[:1])])
        before = [s for s in self._states if s.stamp < pulse.onset]
        during = [s for s in self._states if pulse.onset <= s.stamp <= end]
        self._states = [*before[-1:], *(s for s in self._states if s.stamp >= pulse.onset)]
        seen = [*before[-1:], *during]
        if pulse.height == 0:  # of no height, a sham: no state can show it
            return PulseTiming(pulse.onset, None, None)
        sent = next((s.stamp for s in during if s.commanded / pulse.height > 0), None)
        stamps, torques = [s.stamp for s in seen], [s.measured for s in seen]
        found = measured_onset(stamps, torques, pulse.height)
        measured = None if found is None else found[1]
        if found is not None and seen[found[0]].measured == seen[found[0]].commanded:
            # Equal to the last bit: not measured but computed, and known at each of its jumps.
            measured = seen[found[0]].stamp
        return PulseTiming(pulse.onset, sent, measured)


def lateness_ms(timings: Sequence[PulseTiming], kind: str) -> list[float]:
    """Return by how many ms pulses were "sent" or "measured" after their command, ascending."""
    return sorted(
        (onset - timing.commanded) / 1e6
        for timing in timings
        if (onset := getattr(timing, kind)) is not None
    )


def distribution(
    timings: Sequence[PulseTiming], kind: str, stride: float
) -> dict[str, Any] | None:
    """
    Return how late pulses came against their commanded onsets; None where no pulse shows it.

    The kind of onset is "sent" or "measured"; percentages are of a stride [s], None where that is
    NaN: unknown.
    """
    late = lateness_ms(timings, kind)
    if not late:
        return None
    figures = {"median": quantile(late, 0.5), "p99": quantile(late, 0.99), "worst": late[-1]}
    return {
        "pulses": len(late),
        "missing": len(timings) - len(late),
        **{f"{name}_ms": value for name, value in figures.items()},
        **{
            f"{name}_percent": None if math.isnan(stride) else value / stride / 10
            for name, value in figures.items()
        },
    }


def quantile(ascending: Sequence[float], share: float) -> float:
    """Return the value below or at which a share of the values lies (nearest rank)."""
    return ascending[max(math.ceil(share * len(ascending)) - 1, 0)]
