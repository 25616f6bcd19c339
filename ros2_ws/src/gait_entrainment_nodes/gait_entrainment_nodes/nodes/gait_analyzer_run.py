# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run of the analyzer: events and onsets in, results out, without a node."""

from dataclasses import asdict
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Entrainment, GaitAnalyzer, PulsePhase, Stride, VerdictSettings
from gait_entrainment.gait.analyzer import Result
from gait_entrainment_bags.messages import (
    ProfileOrder,
    event_of,
    nanoseconds_of,
    pulse_of,
    result_values,
    state_of,
)
from gait_entrainment_bags.truth import without_bias
from gait_entrainment_commands.timing import MeasuredOnsets
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.stamps import header, to_time

# Where each kind of result is published.
RESULTS: dict[type, topics.Topic] = {
    Stride: topics.STRIDES,
    PulsePhase: topics.PULSE_PHASES,
    Entrainment: topics.ENTRAINMENT,
}


class Run:
    """
    One run; all times are [ns since 1970].

    Each message may complete results, which are returned in the order of publishing. Onsets are
    those that were promised, or, if ``measured``, those at which the robot's torque rises.
    Toe-offs are known to be detected late by ``toe_off_bias`` [s].
    """

    def __init__(
        self,
        number: int,
        side: Side,
        settings: VerdictSettings,
        toe_off_bias: float = 0.0,
        *,
        measured: bool,
    ) -> None:
        self.number, self.side = number, side
        self.promised_until = 0  # all pulses up to this time are known
        self.end: int | None = None  # of the walk, once it is known
        self._analyzer = GaitAnalyzer(side, settings)
        self._bias = toe_off_bias
        self._measured = MeasuredOnsets() if measured else None
        self._events = 0
        self._closed = False  # nothing more will be promised
        self._expected = 0  # events, once the end is known
        self._doubts: dict[str, int] = {}  # counts of suspicious events, as reported last
        self._order = ProfileOrder()
        self._latest = 0  # stamp of the latest event

    @property
    def complete(self) -> bool:
        """Whether the walk has ended and everything about it has arrived."""
        if self.end is None or self._events < self._expected:
            return False
        if self.promised_until < self.end:
            return False
        # With measured onsets the state at the closing time is the last one.
        return self._measured is None or (
            self._closed and self._measured.states_until >= self.promised_until
        )

    def add_event(self, event: msg.GaitEvent) -> list[Result]:
        """Take one gait event."""
        taken = event_of(event)
        self._events += 1
        self._latest = max(self._latest, taken.stamp)
        (mended,) = without_bias([taken], self._bias)
        return self._analyzer.add_event(mended)

    def add_profile(self, message: msg.TorqueProfile) -> list[Result]:
        """Take the promised onsets, or a stop: the time from which torque is zero."""
        void, hole, profile = self._order.take(message)
        if void is not None:
            self._analyzer.stop(void)
            if self._measured is not None:
                self._measured.stop(void)
        if hole:
            self._analyzer.add_hole(*hole)
        if profile is None:
            return []
        known = list(profile.onsets), profile.valid_until
        self.promised_until, self._closed = profile.valid_until, not profile.has_length
        if self._measured is not None:
            known = self._measured.add_promise(*known)
        return self._analyzer.add_promise(*known)

    def add_pulse(self, pulse: msg.TorquePulse) -> list[Result]:
        """Take the height and width of a pulse, which determine its measured onset."""
        assert self._measured is not None
        return self._analyzer.add_promise(*self._measured.add_pulse(*pulse_of(pulse)))

    def add_state(self, state: msg.AnkleRobotState) -> list[Result]:
        """Take the torque that the robot measured."""
        assert self._measured is not None
        return self._analyzer.add_promise(*self._measured.add_state(state_of(state)))

    def add_progress(self, progress: msg.Progress) -> list[Result]:
        """Take progress, of which only the end of the walk matters."""
        if progress.state != msg.Progress.WALKING:
            self.end, self._expected = nanoseconds_of(progress.header.stamp), progress.events
        return []

    def finish(self, end: int) -> list[Result]:
        """Return the remaining results of a run that is over at ``end``."""
        results = []
        if hole := self._order.hole_up_to(self._latest):
            self._analyzer.add_hole(*hole)
        if self._measured is not None:
            results += self._analyzer.add_promise(self._measured.finish(), end)
        return results + self._analyzer.finish()

    def new_doubts(self) -> dict[str, int]:
        """Return the counts of doubtful events and of holes; {} if none or unchanged."""
        doubts = asdict(self._analyzer.event_counts) | {"holes": len(self._analyzer.holes)}
        del doubts["accepted"]
        if not any(doubts.values()) or doubts == self._doubts:
            return {}
        self._doubts = doubts
        return doubts

    def message_of(self, result: Result) -> Any:
        """Return the message that publishes a result."""
        values = result_values(result, self.side)
        values["header"] = header(values["header"])
        for name in values.keys() & {"start", "toe_off"}:
            values[name] = to_time(values[name])
        return RESULTS[type(result)].type(run=self.number, **values)
