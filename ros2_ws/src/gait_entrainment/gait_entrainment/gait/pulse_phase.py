# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Where in the gait cycle a pulse began, and how far from toe-off."""

import math
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.gait.strides import Stride

_Other = Stride | None  # a neighbour, None if it is missing


@dataclass(frozen=True, slots=True)
class PulsePhase:
    """One pulse, placed in the gait cycle of the perturbed leg."""

    number: int  # of the pulse in the run, from 1; counts pulses missing from the record
    onset: int  # [ns]
    stride: int  # stride in which the pulse began
    phase: float  # (onset - heel strike) / stride period, in [0, 1)
    phase_lag: float  # onset minus nearest toe-off or strike (`LagFollower`) [s]; NaN if missing
    unwrapped_lag: float  # the same, followed across wraps from the first lag on [s]
    toe_off: int | None  # the toe-off that the lag refers to [ns]
    phase_lag_uncertainty: float = 0.0  # standard deviation of the event [s]; 0 if exact


def depends_on_next_toe_off(onset: int, stride: Stride) -> bool:
    """
    Whether the next stride's toe-off could be nearer to an onset than its own stride's.

    The next toe-off follows the closing heel strike, so an onset nearer to its own need not wait.
    """
    return stride.toe_off is not None and onset - stride.toe_off > stride.end - onset


def nearest_toe_off(
    onset: int, stride: Stride, before: _Other, after: _Other
) -> tuple[int, int] | None:
    """
    Return the stamp [ns] of the toe-off nearest to an onset [ns], and the number of its stride.

    ``stride`` is the one in which the pulse began, ``before`` and ``after`` are its neighbours,
    None if they are missing. Returns None if a missing toe-off might be the nearest: a lag to the
    next best one would be wrong by up to a stride. Ties go to the earlier toe-off.
    """
    own = stride.toe_off
    if own is None:
        return None
    if onset < own:
        # The toe-off before the stride lies before the heel strike that starts it.
        other, settled = before, own - onset <= onset - stride.start
    else:
        other, settled = after, not depends_on_next_toe_off(onset, stride)
    if other is None or other.toe_off is None:
        return (own, stride.number) if settled else None
    candidates = sorted([(own, stride.number), (other.toe_off, other.number)])
    return min(candidates, key=lambda candidate: abs(onset - candidate[0]))


class PulseNumbers:
    """
    Numbers the pulses of a run, separates its trains and counts the pulses missing in them.

    The period of a train is known once an interval agrees with the one before or with the
    unperturbed stride within a quarter, more than any robot jitters. From then on an interval of
    several periods has missing pulses in it; any other is the pause before another train. Pulses
    planned with too much ``irregularity`` [s] for this are numbered one after the other.
    """

    def __init__(self, irregularity: float = 0.0) -> None:
        self._irregularity = irregularity
        self.number = 0  # of the latest pulse
        self.latest = self._first = 0  # onset of the latest pulse, of the first of its train [ns]
        self._periods = 0  # between the two
        self._steady = False  # whether the period is known

    def place(self, onset: int, stride: float, *, anew: bool = False) -> int | None:
        """Take an onset [ns]; return how many are missing before it, None if a train begins."""
        steps = 1.0 if self.number else 0.0
        if self._periods and not self._irregularity > stride / 4:
            steps = (onset - self.latest) * self._periods / (self.latest - self._first)
        count, interval = round(steps), (onset - self.latest) / NANOSECONDS_PER_SECOND
        self.latest = onset
        follows = 1 <= count <= (count if self._steady else 1) and abs(steps - count) <= 0.25
        if anew or not follows:
            self._first, self._periods, self._steady = onset, 0, False
            self.number += 1
            return None if self.number > 1 else 0
        self._steady = self._periods > 0 or abs(interval - stride) < 0.25 * stride
        self._periods += count
        self.number += count
        return count - 1


class LagFollower:
    """
    Follows the phase lag across wraps, ``from_strikes`` of the leg if no toe-offs are found.

    Pulse n is compared with the toe-off n strides after the first pulse's. That may lie in the
    future, so the strides T in between are counted: unwrapped lag = lag + (m - n) T after m
    strides and n pulses. Assumes one train with one pulse per stride and no hole.
    """

    def __init__(self, *, from_strikes: bool = False) -> None:
        self._from_strikes = from_strikes
        self._first: tuple[int, int] | None = None  # stride of the toe-off, number of the pulse

    def place(
        self, number: int, onset: int, stride: Stride, before: _Other, after: _Other, period: float
    ) -> PulsePhase:
        """Place one pulse; arguments as in ``nearest_toe_off``, and the unperturbed period [s]."""
        phase = (onset - stride.start) / (stride.end - stride.start)
        nearest = nearest_toe_off(onset, stride, before, after)
        if self._from_strikes:
            strikes = (stride.start, stride.number), (stride.end, stride.number + 1)
            nearest = min(strikes, key=lambda strike: abs(onset - strike[0]))
        if nearest is None:
            return PulsePhase(number, onset, stride.number, phase, math.nan, math.nan, None)
        toe_off, toe_off_stride = nearest
        lag = (onset - toe_off) / NANOSECONDS_PER_SECOND
        if self._first is None:
            self._first = toe_off_stride, number
        ahead = (toe_off_stride - self._first[0]) - (number - self._first[1])
        # Without a wrap the lag is used as it is, even if T is unknown (NaN).
        unwrapped = lag + ahead * period if ahead else lag
        uncertainty = next(
            (s.toe_off_uncertainty for s in (before, after) if s and s.toe_off == toe_off),
            stride.toe_off_uncertainty,
        )
        off = None if self._from_strikes else toe_off
        return PulsePhase(number, onset, stride.number, phase, lag, unwrapped, off, uncertainty)
