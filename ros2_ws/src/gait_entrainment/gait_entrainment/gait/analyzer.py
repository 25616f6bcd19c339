# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The analyzer, which turns gait events and pulse onsets into strides, phases and verdicts."""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side
from gait_entrainment.gait.plausibility import GaitLimits
from gait_entrainment.gait.pulse_phase import (
    LagFollower,
    PulseNumbers,
    PulsePhase,
    depends_on_next_toe_off,
)
from gait_entrainment.gait.strides import (
    EventCounts,
    GaitEvent,
    Stride,
    StrideTracker,
    UnperturbedPeriod,
)
from gait_entrainment.gait.verdict import Entrainment, EntrainmentTest, VerdictSettings

Result = Stride | PulsePhase | Entrainment
# The walker's size is not known here: strides may be ten times shorter or longer than a person's.
_ANYBODY = GaitLimits(stride_least=0.03, stride_most=50.0)
# This many strides in a row known to have no pulse are the pause before another train.
_PAUSE_STRIDES = 5


@dataclass(slots=True)
class PulseCounts:
    """Outcome of the pulse onsets received."""

    placed: int = 0  # in a stride, published
    without_lag: int = 0  # of those, the ones whose nearest toe-off is missing
    outside_strides: int = 0  # before stride 1, in a missed stride, or after the last stride
    late: int = 0  # dropped: arrived after the promise that no such pulse would follow
    withdrawn: int = 0  # announced, then withdrawn by a stop


@dataclass(frozen=True, slots=True, order=True)
class Hole:
    """A part of a run in which the record lacks something."""

    start: int  # [ns]
    end: int  # [ns]
    missing: str  # such as "2 strides"


class GaitAnalyzer:
    """
    Analyzes one run of one perturbed leg, online.

    There are two inputs, interleaved in any way: gait events and promises about pulses. A stride
    is returned with the heel strike that closes it. Its pulses follow, with the verdict at that
    stride, once the promises reach that heel strike and, if a pulse may be nearer to the next
    toe-off than to its own, the next stride is closed. So results depend on the events and the
    onsets, never on how events and promises interleave, except for a stop, which acts on arrival.
    Lags and verdicts start over after each of ``holes`` and with each train.
    """

    def __init__(
        self, side: Side, settings: VerdictSettings | None = None, strides_before: int = 0
    ) -> None:
        self._tracker = StrideTracker(side, _ANYBODY)
        self._strides_before = strides_before  # of the leg in the run, not part of the analysis
        settings = settings or VerdictSettings()
        self._test = EntrainmentTest(settings)
        self._lags = LagFollower()
        self._toe_offs = False  # whether a stride has had one; fixed at the first pulse
        self._unperturbed = UnperturbedPeriod()
        self._pause = self._unperturbed  # strides since the latest pulse
        self._strides: deque[Stride] = deque()  # closed, pulses not placed yet
        self._before: Stride | None = None  # the latest stride whose pulses are placed
        self._onsets: list[int] = []  # announced, not placed yet; ascending
        self._promised = -math.inf  # no pulse before this time will be added [ns]
        self._finished = False
        self._numbers = PulseNumbers(settings.irregularity)
        self._unknown: list[tuple[int, int]] = []  # intervals with possible unseen pulses [ns]
        self.holes: list[Hole] = []
        self.pulse_counts = PulseCounts()

    @property
    def event_counts(self) -> EventCounts:
        """Outcome of the events received so far."""
        return self._tracker.counts

    def add_event(self, event: GaitEvent) -> list[Result]:
        """Take one gait event; return the results that it completes, in order."""
        stride = self._tracker.add(event)
        if stride is None:
            return []
        self._strides.append(stride)
        return [stride, *self._place()]

    def add_promise(self, onsets: Iterable[int], valid_until: int) -> list[Result]:
        """
        Take pulse onsets [ns], and the promise that none before ``valid_until`` [ns] will follow.

        An onset that was already announced is ignored; one that an earlier promise excludes is
        dropped and counted. Returns the results that this completes, in order.
        """
        for onset in onsets:
            if onset < self._promised:
                self.pulse_counts.late += 1
                continue
            place = bisect_left(self._onsets, onset)
            if self._onsets[place : place + 1] != [onset]:
                self._onsets.insert(place, onset)
        self._promised = max(self._promised, valid_until)
        return self._place()

    def add_hole(self, start: int, end: int) -> None:
        """Note, ahead of promises, that pulses that began in [start, end) [ns] are unknown."""
        self._unknown.append((start, end))
        self.holes.append(Hole(start, end, "which pulses began"))

    def stop(self, stamp: int) -> None:
        """Take a stop [ns]: no announced pulse begins from then on, no promise extends beyond."""
        kept = bisect_left(self._onsets, stamp)
        self.pulse_counts.withdrawn += len(self._onsets) - kept
        del self._onsets[kept:]
        self._promised = min(self._promised, stamp)

    def finish(self) -> list[Result]:
        """End the run: no more events or pulses. Returns the results that were pending."""
        self._promised = math.inf
        self._finished = True
        results = self._place()
        self.pulse_counts.outside_strides += len(self._onsets)
        self._onsets.clear()
        return results

    def _place(self) -> list[Result]:
        """Place the pulses of closed strides, as far as events and promises allow."""
        results: list[Result] = []
        while self._strides and self._strides[0].end <= self._promised:
            stride = self._strides[0]
            onsets = self._onsets[: bisect_left(self._onsets, stride.end)]
            after = self._strides[1] if len(self._strides) > 1 else None
            waiting = after is None and not self._finished
            if waiting and onsets and depends_on_next_toe_off(onsets[-1], stride):
                break
            self._strides.popleft()
            del self._onsets[: len(onsets)]
            results += self._place_in(stride, after, onsets)
            self._before = stride
        return results

    def _place_in(
        self, stride: Stride, after: Stride | None, onsets: Sequence[int]
    ) -> list[Result]:
        """Place the pulses that began before the end of a stride, then form the verdict."""
        before = self._before
        number = self._strides_before if before is None else before.number
        if stride.number != number + 1:
            start = stride.start if before is None else before.end
            lost = f"{stride.number - number - 1} stride(s)"
            self._start_over(Hole(start, stride.start, lost))
            before = None
        if after is not None and after.number != stride.number + 1:
            after = None
        paused = self._numbers.number > 0 and len(self._pause.periods) >= _PAUSE_STRIDES
        if onsets and (paused or self._numbers.number == 0):
            self._unperturbed = self._pause
            self._unperturbed.settle(_ANYBODY)
        unperturbed = self._unperturbed
        if self._numbers.number == 0:
            self._toe_offs |= stride.toe_off is not None
            self._lags = LagFollower(from_strikes=not self._toe_offs)
        pulses: list[PulsePhase] = []
        judged = 0  # the first of them after the latest hole or the start of another train
        for onset in onsets:
            latest = self._numbers.latest
            missing = self._numbers.place(onset, unperturbed.mean, anew=paused)
            paused = False
            if missing != 0:
                hole = Hole(latest, onset, f"{missing} pulse(s)") if missing else None
                self._start_over(hole, another_train=missing is None)
                judged = len(pulses)
            if onset < stride.start:
                self.pulse_counts.outside_strides += 1
                continue
            placed = self._numbers.number, onset, stride, before, after, unperturbed.mean
            pulse = self._lags.place(*placed)
            self.pulse_counts.placed += 1
            self.pulse_counts.without_lag += math.isnan(pulse.phase_lag)
            pulses.append(pulse)
        unseen = any(s < stride.end and stride.start < e for s, e in self._unknown)
        if onsets or (unseen and self._numbers.number):
            self._pause = UnperturbedPeriod()
        # Once pulses may have begun unseen, no stride counts as unperturbed.
        elif self._numbers.number or not any(s < stride.end for s, _ in self._unknown):
            self._pause.periods.append(stride.end - stride.start)
        if unseen:
            self._start_over(None)
            return list(pulses)
        entrainment = self._test.add(stride, pulses[judged:], unperturbed)
        return [*pulses, entrainment] if entrainment else list(pulses)

    def _start_over(self, hole: Hole | None, *, another_train: bool = False) -> None:
        """Restart lags and verdicts: after a hole (None if already listed) or with a new train."""
        self.holes += [hole] if hole else []
        self._lags = LagFollower(from_strikes=not self._toe_offs)
        self._test.restart(hole=not another_train)


@dataclass(frozen=True)
class Analysis:
    """All results of one run."""

    strides: tuple[Stride, ...]
    pulses: tuple[PulsePhase, ...]
    entrainments: tuple[Entrainment, ...]  # the last one is the verdict of the run
    event_counts: EventCounts
    pulse_counts: PulseCounts
    holes: tuple[Hole, ...]  # in the record, in order


def analyze(
    events: Iterable[GaitEvent],
    onsets: Iterable[int],
    side: Side,
    settings: VerdictSettings | None = None,
    unknown: Iterable[tuple[int, int]] = (),
    strides_before: int = 0,
) -> Analysis:
    """
    Analyze a whole run of one perturbed leg offline, with the same class that runs online.

    Events are in the order in which they were received; onsets [ns] are in any order. ``unknown``
    are the intervals [ns] in which unknown pulses may have begun. If this is part of a run,
    ``strides_before`` is the number of the leg's strides before it.
    """
    analyzer = GaitAnalyzer(side, settings, strides_before)
    for start, end in unknown:
        analyzer.add_hole(start, end)
    results = [result for event in events for result in analyzer.add_event(event)]
    results += analyzer.add_promise(onsets, 0) + analyzer.finish()
    return Analysis(
        strides=tuple(result for result in results if isinstance(result, Stride)),
        pulses=tuple(result for result in results if isinstance(result, PulsePhase)),
        entrainments=tuple(result for result in results if isinstance(result, Entrainment)),
        event_counts=analyzer.event_counts,
        pulse_counts=analyzer.pulse_counts,
        holes=tuple(sorted(analyzer.holes)),
    )
