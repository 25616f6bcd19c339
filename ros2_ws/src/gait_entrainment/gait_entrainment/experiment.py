# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The conductor of an experiment: a pure function from received stamps to pulses and promises.

It is told which gait events happened and up to which instant all of them are known, and answers
with a horizon, the promise to request no pulse that begins earlier. It plans the pulses one
stride ahead, at the strike that starts the last baseline stride. So a robot has its lead time, and
a walker that never computes past the promises is never held back by the very event that everybody
is waiting for.
"""

import enum
import math
import statistics
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.gait import GaitEvent, GaitLimits, StrideTracker
from gait_entrainment.gait.strides import PLACES
from gait_entrainment.protocol import Protocol, ProtocolError
from gait_entrainment.robot import PulseTrain


class Part(enum.IntEnum):
    """Part of the protocol that is under way."""

    WAITING = 0
    BASELINE = 1
    PULSES = 2
    WASHOUT = 3
    FINISHED = 4
    FAILED = 5


@dataclass(frozen=True)
class Horizon:
    """No new pulse begins before ``until`` [ns]; the run ends there if ``last`` is set."""

    until: int
    last: bool


class GaitError(EntrainmentError):
    """The gait is not one that torque may follow; the message says why, with the figures."""


class Conductor:
    """
    Conducts one protocol.

    ``longest_lookahead`` [s] bounds how far ahead it promises. In lock-step that is a stride,
    which is where the speed comes from; in real time a short one leaves more to be decided late.
    ``limits`` say which strides can be believed, of a person; for a walker of another size they
    are scaled by sqrt(L / g).
    """

    def __init__(
        self,
        protocol: Protocol,
        longest_lookahead: float = math.inf,
        limits: GaitLimits | None = None,
    ) -> None:
        self.protocol = protocol
        self.train: PulseTrain | None = None  # planned when the last baseline stride starts
        # Mean stride period over the baseline [s] and its standard error; NaN if not measured.
        self.measured_period = math.nan
        self.measured_period_error = math.nan
        self._limits = limits or GaitLimits()
        own = self._limits.scaled(protocol.walker.time_scale)
        self._tracker = StrideTracker(protocol.side, own)
        self._periods: list[float] = []  # of the baseline strides [s]
        self._longest_lookahead = longest_lookahead
        self._lookahead = min(_shortest_stride(protocol), longest_lookahead)
        self._longest_promise = self._lookahead
        self._closing_strike: int | None = None  # strike that closes the last stride [ns]

    @property
    def pulse_period(self) -> float:
        """Period of the pulses as planned [s]; NaN without a plan."""
        return math.nan if self.train is None else self.train.period

    @property
    def strides(self) -> int:
        """Strides of the perturbed leg completed so far."""
        return max(self._tracker.stride_in_progress - 1, 0)

    def part(self, known_until: int) -> Part:
        """Return the part of the protocol that is under way at an instant [ns]."""
        train = self.train
        if self._closing_strike is not None:
            return Part.FINISHED
        if train is None or known_until < train.first_onset:
            return Part.BASELINE
        return Part.PULSES if known_until < train.end(train.count - 1) else Part.WASHOUT

    def add_event(self, event: GaitEvent) -> PulseTrain | None:
        """
        Take one gait event; return the pulses to request, if this event lets them be planned.

        Raises ProtocolError if they would overlap at the resulting period, GaitError if the
        baseline is not one to measure a period by.
        """
        strike = self._tracker.latest_strike
        stride = self._tracker.add(event)
        if self._tracker.latest_strike == strike:
            return None  # not a heel strike of the leg, or not believed
        if stride is not None and self.train is None:
            self._periods.append(stride.period)
            # A promise must end before the next strike can be an onset's reference: see horizon.
            self._lookahead = min(self._longest_lookahead, *self._periods)
            self._longest_promise = max(self._longest_promise, self._lookahead)
        started = self._tracker.stride_in_progress
        if started > self.protocol.strides and self._closing_strike is None:
            self._closing_strike = event.stamp
        if started < self.protocol.baseline or self.train is not None:
            return None
        self.train = self._plan(event.stamp)
        return self.train

    def horizon(self, known_until: int) -> Horizon:
        """
        Return how far to promise, all events up to ``known_until`` [ns] having been added.

        The first onset lies (1 + P) measured periods after a strike that was not yet known when
        the promise before was made, and no lookahead is longer than the shortest stride that
        entered the measured period: so no promise ever covers an onset that is not yet planned.
        The run ends at a fixed distance after its closing strike, which no promise made before
        that strike can have passed: the end does not depend on how the run was cut into grants.

        Raises GaitError if pulses are planned and nobody walks any more.
        """
        if self._closing_strike is not None:
            return Horizon(self._closing_strike + nanoseconds(self._longest_promise), last=True)
        stopped = self._tracker.watch.stopped(known_until) if self.train is not None else ""
        if stopped:
            raise GaitError(stopped)
        return Horizon(known_until + nanoseconds(self._lookahead), last=False)

    def _plan(self, strike: int) -> PulseTrain:
        """Plan the pulses at the strike [ns] that starts the last baseline stride."""
        protocol, plan = self.protocol, self.protocol.pulses
        self._require_steady_baseline()
        if self._periods:
            stride = self.measured_period = statistics.fmean(self._periods)
        elif plan.period is not None:  # the best guess if no complete stride was asked for
            stride = plan.period
        else:
            raise ProtocolError(
                "baseline: no complete stride was seen from which period_offset could be measured"
            )
        if len(self._periods) > 1:
            spread = statistics.stdev(self._periods, self.measured_period)
            self.measured_period_error = spread / math.sqrt(len(self._periods))
        delay = nanoseconds((1 + plan.initial_phase) * stride)
        if self._periods:
            # The stamps of a constant gait are rounded, so its next stride can be a nanosecond
            # longer than the mean: a pulse at phase 0 is not to come before the strike.
            delay = math.floor((1 + plan.initial_phase) * stride * NANOSECONDS_PER_SECOND) + 1
        return PulseTrain(
            side=protocol.side,
            first_onset=strike + delay,
            period=plan.period_for(stride),
            count=plan.count,
            torque=protocol.pulse_torque,
            duration=plan.width,
        )

    def _require_steady_baseline(self) -> None:
        """Raise GaitError if the baseline's strides are not those of one steady gait."""
        periods = self._periods
        doubted = math.ceil(
            self._tracker.counts.implausible / PLACES
        )  # a stride's worth of events
        if doubted > len(periods):
            raise GaitError(
                f"baseline: {doubted} of {doubted + len(periods)} strides cannot be: check the "
                "sensor, or whether the person stood still"
            )
        if len(periods) < 3:
            return
        mean, spread = statistics.fmean(periods), statistics.stdev(periods)
        if spread > self._limits.baseline_spread * mean:
            raise GaitError(
                f"baseline: strides of {min(periods):.3g} to {max(periods):.3g} s, which vary by "
                f"{100 * spread / mean:.0f} % of their mean; allowed: "
                f"{100 * self._limits.baseline_spread:g} %"
            )


def _shortest_stride(protocol: Protocol) -> float:
    """
    Return a period [s] that no stride undercuts, for promises made before one is measured.

    A foot stays on the ground only while the leg turns slower than sqrt(g / L), and a stride
    turns it by 4 alpha. An absolute pulse period stands in if nothing will be measured.
    """
    walker = protocol.walker
    stride = 4 * walker.leg_angle * math.sqrt(walker.leg_length / walker.gravity)
    return stride if protocol.pulses.period is None else min(stride, protocol.pulses.period)
