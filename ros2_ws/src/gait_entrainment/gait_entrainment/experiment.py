# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The conductor of an experiment: a pure function from received stamps to pulses and promises.

It receives gait events and the instant up to which all of them are known, and returns a horizon:
the promise to request no pulse that begins earlier. It plans pulses at a period one stride ahead,
at the strike that starts the last baseline stride, and a pulse by phase at the strike that starts
its stride, whose length it predicts. This gives a robot its lead time, and a walker that never
computes past the promises is never held back by the very event that the experiment awaits.
"""

import enum
import math
import statistics
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice, pairwise

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.gait import GaitEvent, GaitLimits, Stride, StrideTracker
from gait_entrainment.gait.strides import PLACES
from gait_entrainment.protocol import Block, Protocol, ProtocolError
from gait_entrainment.robot import Pulse, PulseTrain

# The predicted length of a stride is the mean of this many before it, as in exoskeletons timed by
# heel strikes: more would follow a change of the gait too slowly.
PREDICTED_FROM = 5
# The number of strides whose coefficient of variation decides whether a gait is steady, and how
# many may pass before it has to be.
STEADY_STRIDES = 10
_MOST_UNSTEADY = 200
# Most pulses in one request: a longer message would block its sender and its receiver.
PART_PULSES = 2000


class Part(enum.IntEnum):
    """Part of the protocol that is under way."""

    WAITING = 0
    BASELINE = 1
    PULSES = 2
    WASHOUT = 3
    FINISHED = 4
    FAILED = 5
    REST = 6


@dataclass(frozen=True)
class Horizon:
    """No new pulse begins before ``until`` [ns]; the run ends there if ``last`` is set."""

    until: int
    last: bool


class GaitError(EntrainmentError):
    """The gait is not fit for torque; the message says why, with figures."""


@dataclass
class BlockRun:
    """The state of one block as it is conducted."""

    plan: Block
    number: int  # from 1
    ankles: tuple[Side, ...]  # that get its pulses; the first is of the leg whose strides count
    start: int | None = None  # heel strike that starts its first stride [ns]
    strides_before: int = 0  # of its leg in the run
    doubted_before: int = 0  # events of its leg that were not believed
    baseline: int = 0  # strides of the baseline; 0 until its last one starts
    planned: Counter[Side] = field(default_factory=Counter)  # pulses so far, by ankle
    first_onset: int | None = None  # of the planned pulses [ns]
    pulses_end: int = 0  # end of the last planned pulse [ns]
    trains: dict[Side, PulseTrain] = field(default_factory=dict)  # requested so far
    # Mean stride period over the baseline [s] and its standard error; NaN if not measured.
    measured_period: float = math.nan
    measured_period_error: float = math.nan
    pulse_period: float = math.nan  # the first one as planned [s]; NaN without a plan, or by phase
    end: int | None = None  # heel strike that ends its last stride [ns]

    @property
    def leg(self) -> Side:
        """The leg whose strides count."""
        return self.ankles[0]

    @property
    def train(self) -> PulseTrain | None:
        """The pulses requested on its leg so far."""
        return self.trains.get(self.leg)

    def pulses_left(self, side: Side) -> int:
        """Number of pulses on an ankle that are not planned yet."""
        return self.plan.pulses.count - self.planned[side]


class _Leg:
    """The strides of one leg, as they arrive."""

    def __init__(self, side: Side, limits: GaitLimits) -> None:
        self.side = side
        self.tracker = StrideTracker(side, limits)
        self.recent: deque[float] = deque(maxlen=STEADY_STRIDES)  # latest stride periods [s]

    @property
    def predicted_from(self) -> list[float]:
        """The stride periods [s] whose mean is the prediction of the next one."""
        return list(self.recent)[-PREDICTED_FROM:]


class Conductor:
    """
    Conducts one protocol.

    ``longest_lookahead`` [s] bounds how far ahead it promises. In lock-step that is a stride,
    which is where the speed comes from; in real time a short one leaves more to be decided late.
    ``limits`` define which strides of a person are believed; for a walker of another size they
    are scaled by sqrt(L / g).
    """

    def __init__(
        self,
        protocol: Protocol,
        longest_lookahead: float = math.inf,
        limits: GaitLimits | None = None,
    ) -> None:
        self.protocol = protocol
        self._limits = limits or GaitLimits()
        own = self._limits.scaled(protocol.walker.time_scale)
        self._legs = {side: _Leg(side, own) for side in protocol.sides}
        self.blocks: list[BlockRun] = []  # those that have begun
        self._begin_block()
        self.longest_lookahead = longest_lookahead
        self._shortest = _shortest_stride(protocol)
        self._longest_promise = self._lookahead = min(self._shortest, longest_lookahead)
        self._promised = 0  # up to this instant [ns]
        self._heights: list[float] = []  # of the pulses of the block [N m]
        # By ankle: pulses planned but not requested yet, and the promise that must wait for them.
        self._rest: dict[Side, Iterator[Pulse]] = {side: iter(()) for side in self._legs}
        self._next_part_at = dict.fromkeys(self._legs, 0)  # [ns]
        self._resting_until: int | None = None  # between two blocks [ns]
        self._closing_strike: int | None = None  # strike that closes the last stride [ns]

    @property
    def block(self) -> BlockRun:
        """The block under way; in a rest, the one before it."""
        return self.blocks[-1]

    @property
    def strides(self) -> int:
        """Number of strides of the protocol's leg completed so far."""
        return max(self._legs[self.protocol.side].tracker.stride_in_progress - 1, 0)

    @property
    def _leg(self) -> _Leg:
        """The leg whose strides count: the current block's, or in a rest the next block's."""
        number = self.block.number - (self._resting_until is None)
        return self._legs[self.protocol.leg(self.protocol.sequence[number])]

    def part(self, known_until: int) -> Part:
        """Return the part of the protocol that is under way at an instant [ns]."""
        block, first = self.block, self.block.first_onset
        if self._closing_strike is not None:
            return Part.FINISHED
        if self._resting_until is not None:
            return Part.REST
        if first is None and not block.plan.pulses.count and self._started > block.baseline > 0:
            return Part.WASHOUT
        if first is None or known_until < first:
            return Part.BASELINE
        pulses = known_until < block.pulses_end or block.pulses_left(block.leg)
        return Part.PULSES if pulses else Part.WASHOUT

    def add_event(self, event: GaitEvent, now: float = math.inf) -> None:
        """
        Take one gait event, and plan the pulses that can be planned from it.

        An event stamped after ``now`` [ns] is not believed. Raises ProtocolError if pulses would
        overlap at the resulting period, GaitError if the baseline is unfit to measure a period.
        """
        for leg in self._legs.values():
            strike, stride = leg.tracker.latest_strike, leg.tracker.add(event, now)
            if leg.tracker.latest_strike == strike:
                continue  # not a heel strike of the leg, or not believed
            if stride is not None:
                leg.recent.append(stride.period)
            if leg is self._leg:
                self._take_strike(event.stamp, stride)
            elif self.block.first_onset and self.block.end is None and self._due_by_phase(leg):
                self._plan_by_phase(leg, event.stamp)

    def _take_strike(self, strike: int, stride: Stride | None) -> None:
        """Take a heel strike [ns] of the leg whose strides count, and the stride it closes."""
        if stride is not None and not self.block.baseline:
            self._periods.append(stride.period)
            # A promise must end before the next strike can be an onset's reference.
            self._lookahead = min(self.longest_lookahead, *self._periods)
            self._longest_promise = max(self._longest_promise, self._lookahead)
        if self._closing_strike is not None or not self._in_block(strike):
            return
        if not self.block.baseline:
            if self._baseline_is_over(strike):
                self._plan(strike)
        elif self._due_by_phase(self._leg):
            self._plan_by_phase(self._leg, strike)

    def due(self, known_until: int) -> PulseTrain | None:
        """
        Return pulses to request before the horizon at ``known_until`` [ns], if there are any.

        Many are split: the next part is due before a promise reaches the middle of this one.
        """
        for side, rest in self._rest.items():
            if self._until(known_until) < self._next_part_at[side]:
                continue
            if part := tuple(islice(rest, PART_PULSES)):
                self._next_part_at[side] = part[len(part) // 2].onset
                requested, before = PulseTrain(side, part), self.block.trains.get(side)
                self.block.trains[side] = before.followed_by(requested) if before else requested
                return requested
        return None

    def horizon(self, known_until: int) -> Horizon:
        """
        Return how far to promise once all events up to ``known_until`` [ns] have been added.

        Pulses that are due by then must have been requested.

        The first onset lies (1 + initial phase) measured periods after a strike not yet known when
        the previous promise was made, and no lookahead is longer than the shortest stride that
        entered the measured period, so no promise covers an onset that is not yet planned. If the
        latest stride was that short and changes the mean, the onset is postponed to the end of
        the promise. A pulse by phase lies ``after_strike`` predicted periods after the strike at
        which it is planned, and no lookahead is longer than the shortest time that this can be
        for strides that are believed.

        The run ends a fixed time after its closing strike, which no promise made before that
        strike can have passed, so the end does not depend on how the run was cut into grants.

        Raises GaitError if pulses are planned and the gait has stopped.
        """
        until, last = self._until(known_until), self._closing_strike is not None
        if not last:
            walking = self.block.first_onset is not None and self._resting_until is None
            stopped = self._leg.tracker.watch.stopped(known_until, self.block.pulse_period)
            if walking and stopped:
                raise GaitError(stopped)
            self._promised = max(self._promised, until)
        return Horizon(until, last)

    def _until(self, known_until: int) -> int:
        """Return how far a promise made at an instant reaches, both [ns]."""
        if self._closing_strike is not None:
            return self._closing_strike + nanoseconds(self._longest_promise)
        by_phase = map(self._lookahead_by_phase, self._legs.values())
        return known_until + nanoseconds(min(self._lookahead, *by_phase))

    # Blocks

    @property
    def _started(self) -> int:
        """Number of the stride in progress in its block, from 1."""
        return self._leg.tracker.stride_in_progress - self.block.strides_before

    def _in_block(self, strike: int) -> bool:
        """Whether a stride of a block starts with a strike [ns]; ends and begins blocks."""
        if self._resting_until is not None:
            if strike < self._resting_until:
                return False
            self._begin_block(strike)
            self._resting_until = None
        elif self._is_over(strike):
            self.block.end = strike
            if self.block.number == len(self.protocol.sequence):
                self._closing_strike = strike
                return False
            after = self.protocol.sequence[self.block.number]
            if self.block.plan.rest or self.protocol.leg(after) is not self.block.leg:
                self._resting_until = strike + nanoseconds(self.block.plan.rest)
                return False
            self._begin_block(strike)
        elif self.block.start is None:
            self.block.start = strike
        return True

    def _begin_block(self, strike: int | None = None) -> None:
        """Begin the next block, at a strike [ns] of its leg if there is one."""
        plan = self.protocol.sequence[len(self.blocks)]
        ankles = self.protocol.ankles(plan)
        tracker = self._legs[ankles[0]].tracker
        before = max(tracker.stride_in_progress - 1, 0), tracker.counts.implausible
        self.blocks.append(BlockRun(plan, len(self.blocks) + 1, ankles, strike, *before))
        # Periods [s] of the latest complete strides of the baseline.
        self._periods: deque[float] = deque(maxlen=max(plan.baseline - 1, 1))

    def _baseline_is_over(self, strike: int) -> bool:
        """Whether the stride that starts with a strike [ns] is the last one of the baseline."""
        plan, started = self.block.plan, self._started
        end = strike + nanoseconds(statistics.fmean(self._periods or [0.0]))
        start = end if self.block.start is None else self.block.start
        if started < plan.baseline or end - start < nanoseconds(plan.baseline_time):
            return False
        steady = self._is_steady(plan.baseline_steady)
        if not steady and started > _MOST_UNSTEADY:
            raise GaitError(
                f"baseline: not steady after {started} strides; allowed: a higher baseline_steady "
                f"than {plan.baseline_steady:g}"
            )
        return steady

    def _is_over(self, strike: int) -> bool:
        """Whether the block has ended at a strike [ns]."""
        block, plan = self.block, self.block.plan
        washout = self._started - block.baseline - plan.pulses.count
        if not block.baseline or washout <= plan.washout:
            return False
        pulses_end = block.pulses_end or block.start or 0
        # The last block ends with its strides, whatever the pulse period.
        if block.number < len(self.protocol.sequence) and strike < pulses_end:
            return False
        if strike - pulses_end < nanoseconds(plan.washout_time):
            return False
        return self._is_steady(plan.washout_steady) or washout > _MOST_UNSTEADY

    def _is_steady(self, most: float) -> bool:
        """Whether the latest strides vary by at most a fraction of their mean; 0 allows any."""
        recent = self._leg.recent
        if most == 0:
            return True
        full = len(recent) == STEADY_STRIDES
        return full and statistics.stdev(recent) <= most * statistics.fmean(recent)

    # Pulses

    def _due_by_phase(self, leg: _Leg) -> bool:
        """Whether each coming stride of a leg gets a pulse by phase."""
        block = self.block
        by_phase = block.plan.pulses.phase is not None and leg.side in block.ankles
        return by_phase and block.pulses_left(leg.side) > 0

    def _lookahead_by_phase(self, leg: _Leg) -> float:
        """Return how far [s] a promise may reach without covering an unplanned pulse by phase."""
        if not self._due_by_phase(leg):
            return math.inf
        after = self.block.plan.pulses.after_strike
        periods = leg.predicted_from or [self._shortest]
        # The next stride, if as short as is believed, changes the mean by its share.
        change, share = self._limits.stride_change, 1 / min(len(periods) + 1, PREDICTED_FROM)
        lookahead = after * min(periods) * (1 - change * share)
        if self.block.baseline or after >= 1:
            return lookahead
        # The strike that ends the baseline is not known yet: a full stride precedes the pulse.
        return max(lookahead, (1 + after) * min(periods) * (1 - change))

    def _plan_by_phase(self, leg: _Leg, strike: int) -> None:
        """Plan a leg's next pulse by phase at its strike [ns]."""
        block, plan = self.block, self.block.plan.pulses
        period = statistics.fmean(leg.predicted_from or [block.measured_period])
        onset = max(strike + nanoseconds(plan.after_strike * period), self._promised)
        self._add_pulses(leg.side, [onset])

    def _add_pulses(self, side: Side, onsets: Sequence[int]) -> None:
        """Add an ankle's next pulses at their onsets [ns], to be requested when due."""
        block, plan = self.block, self.block.plan.pulses
        heights = self._heights[block.planned[side] :]
        self._rest[side] = chain(self._rest[side], map(plan.pulse, onsets, heights))
        self._next_part_at[side] = 0
        block.planned[side] += len(onsets)
        if block.first_onset is None:
            block.first_onset = onsets[0]
        block.pulses_end = max(block.pulses_end, onsets[-1] + nanoseconds(plan.width))

    def _plan(self, strike: int) -> None:
        """Plan the pulses at the strike [ns] that starts the last baseline stride."""
        protocol, block, plan = self.protocol, self.block, self.block.plan.pulses
        lasted = self._started if block.plan.open_baseline else block.plan.baseline
        block.baseline = lasted
        self._require_plausible_baseline()
        if self._periods:
            stride = block.measured_period = statistics.fmean(self._periods)
        elif plan.period is not None:  # the best guess if no complete stride is required
            stride = plan.period
        elif plan.count == 0:
            return
        else:
            raise ProtocolError(
                "baseline: no complete stride was seen to measure period_offset from"
            )
        if len(self._periods) > 1:
            spread = statistics.stdev(self._periods, block.measured_period)
            block.measured_period_error = spread / math.sqrt(len(self._periods))
        seed = protocol.seed, block.number
        self._heights = plan.heights(block.plan.torque(protocol.walker), seed)
        if plan.count == 0:
            return
        if plan.phase is not None:
            if plan.after_strike >= 1:
                self._plan_by_phase(self._leg, strike)
            return
        delay = nanoseconds((1 + plan.initial_phase) * stride)
        if self._periods:
            # The stamps of a constant gait are rounded, so its next stride can be a nanosecond
            # longer than the mean, but a pulse at phase 0 must not come before the strike. As a
            # double, the product is off by less than a thousandth of a nanosecond.
            exact = (1 + plan.initial_phase) * stride * NANOSECONDS_PER_SECOND
            delay = math.floor(exact + 1e-3) + 1
        block.pulse_period = plan.period_for(stride)
        first = max(strike + delay, self._promised)
        *onsets, after = plan.onsets(first, block.pulse_period, seed)
        self._add_pulses(block.leg, onsets)
        for other in block.ankles[1:]:
            self._add_pulses(other, [sum(pair) // 2 for pair in pairwise([*onsets, after])])

    def _require_plausible_baseline(self) -> None:
        """Raise GaitError if the baseline's strides are not those of one gait."""
        periods = self._periods
        # The implausible events, as a number of strides.
        events = self._leg.tracker.counts.implausible - self.block.doubted_before
        doubted = math.ceil(events / PLACES)
        if doubted > len(periods):
            raise GaitError(
                f"baseline: {doubted} of {doubted + len(periods)} strides are implausible: check "
                "the sensor, or whether the person stood still"
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
    Return a period [s] that no stride is shorter than, for promises before one is measured.

    A foot stays on the ground only while the leg turns slower than sqrt(g / L), and a stride
    turns it by 4 alpha. An absolute pulse period also limits it: no stride may be measured then.
    """
    walker = protocol.walker
    stride = 4 * walker.leg_angle * math.sqrt(walker.leg_length / walker.gravity)
    return min(stride, *(block.pulses.period or stride for block in protocol.sequence))
