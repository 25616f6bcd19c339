# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One run's messages in a bag: events, promises, robot measurements, published results."""

import math
import struct
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Analysis, Stride
from gait_entrainment.gait.analyzer import Result
from gait_entrainment_bags import messages, topic_names
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.mcap_records import BagMessage
from gait_entrainment_bags.messages import ProfileOrder, pulse_of, side_of, state_of
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_commands.timing import MeasuredOnsets

_OWN = "gait_entrainment_msgs/msg/"
_TYPES = {
    topic_names.GAIT_EVENTS: "GaitEvent",
    topic_names.TRUE_EVENTS: "GaitEvent",
    topic_names.TORQUE_PROFILE: "TorqueProfile",
    topic_names.PULSES: "TorquePulse",
    topic_names.ROBOT_STATE: "AnkleRobotState",
    topic_names.ANKLE_TORQUE: "AnkleTorque",
    topic_names.STRIDES: "Stride",
    topic_names.PULSE_PHASES: "PulsePhase",
    topic_names.ENTRAINMENT: "Entrainment",
}
# Fields that bags of earlier versions lack.
_ADDED = {"reason", "stretch", "window", "spread", "scatter", "phase_lag_uncertainty"}
# Field of an analysis by the topic on which it is published.
_RESULTS = {
    topic_names.STRIDES: "strides",
    topic_names.PULSE_PHASES: "pulses",
    topic_names.ENTRAINMENT: "entrainments",
}
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class AnkleTorques:
    """Sampled ankle torque of the perturbed leg, plantarflexion positive."""

    stamps: NDArray[np.int64]  # [ns], shape (n,)
    intrinsic: NDArray[np.float64]  # of the leg's own spring [N m], shape (n,)
    delivered: NDArray[np.float64]  # by the robot, at any phase [N m], shape (n,)
    effective: NDArray[np.float64]  # the part that acts on the walker [N m], shape (n,)


class RunMessages:
    """
    Events, onsets and published results of a run, read in one pass.

    Messages of another run are left out, as in the analyzer. Raises BagError if another run
    begins. A topic's messages are taken in the order of the file, in which they were received:
    the analyzer got them in that order, and a stop voids only earlier promises.
    """

    def __init__(self, bag: BagReader) -> None:
        self._bag = bag
        found = {name: bag.find_topic(name, f"{_OWN}{kind}") for name, kind in _TYPES.items()}
        self._names = {relative: name for relative, name in found.items() if name}
        needed = (topic_names.GAIT_EVENTS, topic_names.TORQUE_PROFILE)
        if missing := [relative for relative in needed if relative not in self._names]:
            raise BagError(f"{bag.path}: lacks the topics {', '.join(missing)}")
        self._torque = self._names.pop(topic_names.ANKLE_TORQUE, "")
        self._messages: dict[str, list[BagMessage]] = {name: [] for name in self._names.values()}
        self.real_time_factor = self._read()
        self.left_out = 0  # messages of another run, or invalid ones
        self._run: int | None = None  # its number
        self._first_profiles: dict[int, bytes] = {}  # by ankle
        # Ankle and span without a torque profile [ns].
        self.unknown: list[tuple[Side, int, int]] = []
        measured = defaultdict[Side, MeasuredOnsets](MeasuredOnsets)
        orders = defaultdict[Side, ProfileOrder](ProfileOrder)
        promises = self._values(
            topic_names.TORQUE_PROFILE, lambda m: (side_of(m), orders[side_of(m)].take(m))
        )
        for side, (void, hole, profile) in promises:
            if void is not None:
                measured[side].stop(void)
            if hole:
                self.unknown.append((side, *hole))
            if profile:
                measured[side].add_promise(profile.onsets, profile.valid_until)
        events = self._messages[self._names[topic_names.GAIT_EVENTS]]
        self.events, self.true_events = (
            list(self._values(name, messages.event_of))
            for name in (topic_names.GAIT_EVENTS, topic_names.TRUE_EVENTS)
        )
        latest = max((event.stamp for event in self.events), default=0)
        for side in set(orders) or Side:
            if hole := orders[side].hole_up_to(latest):
                self.unknown.append((side, *hole))
        # Whether the log times are the stamps, so that messages can be looked up by time.
        self._stamped = [m.log_time for m in events] == [event.stamp for event in self.events]
        for side, pulse in self._values(topic_names.PULSES, lambda m: (side_of(m), pulse_of(m))):
            measured[side].add_pulse(*pulse)
        states = self._values(topic_names.ROBOT_STATE, lambda m: (side_of(m), state_of(m)))
        for side, state in states:
            measured[side].add_state(state)
        for ankle in measured.values():
            ankle.finish()
        self.delivered = [(side, timing) for side, m in measured.items() for timing in m.timings]

    def _read(self) -> float:
        """Read the messages by topic; return walked over wall time by /clock, NaN without it."""
        clocks: list[BagMessage] = []  # the first and the last
        clock = [topic_names.CLOCK] if topic_names.CLOCK in self._bag.topics else []
        for message in self._bag.messages([*self._messages, *clock]):
            if message.topic in self._messages:
                self._messages[message.topic].append(message)
            elif not clocks or message.place > clocks[-1].place:  # not by its log time
                clocks[1:] = [message]
        for received in self._messages.values():
            received.sort(key=lambda message: message.place)
        if len(clocks) < 2 or clocks[1].publish_time <= clocks[0].publish_time:
            return math.nan
        # Decode the clock's own time: other recorders log by the wall clock.
        decode = decoder_for(self._bag.topics[topic_names.CLOCK])
        begin, end = (messages.nanoseconds_of(decode(tick.data).clock) for tick in clocks)
        return (end - begin) / (clocks[1].publish_time - clocks[0].publish_time)

    def _values(self, relative: str, value_of: Callable[[Any], _Value]) -> Iterator[_Value]:
        """Yield the values of a topic's valid messages; the messages are not kept."""
        if relative in self._names:
            name = self._names[relative]
            decode = decoder_for(self._bag.topics[name])
            with fields_expected(name):
                for stored in self._messages.pop(name):
                    if self._is_of_run(message := decode(stored.data), stored.data):
                        try:
                            value = value_of(message)
                        except messages.MessageError:
                            self.left_out += 1
                            continue
                        yield value

    def _is_of_run(self, message: Any, data: bytes) -> bool:
        """Return whether a message belongs to the first message's run; profiles come first."""
        if self._run is None:
            self._run = message.run
        # A run's profiles are counted from 0 on each ankle; one may have been recorded twice.
        begins = not getattr(message, "revision", True)
        if begins and (
            message.run != self._run or self._first_profiles.setdefault(message.side, data) != data
        ):
            raise BagError(
                f"{self._bag.path}: holds more than one run (run {self._run}, then run "
                f"{message.run}): record each into its own bag"
            )
        self.left_out += message.run != self._run
        return bool(message.run == self._run)

    def differences_from(self, live: Mapping[Side, Analysis]) -> tuple[str, ...] | None:
        """Return how the published results differ from an analysis; None if there are none."""
        if _RESULTS.keys().isdisjoint(self._names):
            return None
        differences = []
        for relative in filter(self._names.get, _RESULTS):
            with fields_expected(relative):
                found = list(self._values(relative, lambda message: message))
                for leg, analysis in live.items():
                    results: Sequence[Result] = getattr(analysis, _RESULTS[relative])
                    current = [messages.result_values(result, leg) for result in results]
                    own = [m for m in found if len(live) == 1 or m.side == leg]
                    differences.append(_difference(relative, own, current))
        return tuple(filter(None, differences))

    def read_torques(self, side: Side, strides: Sequence[Stride]) -> AnkleTorques:
        """Read some strides' ankle torque; all of it if log times are not stamps."""
        stamps: list[int] = []
        rows: list[tuple[float, float, float]] = []
        spans: list[tuple[int, float]] = [(stride.start, stride.end) for stride in strides]
        if strides and not self._stamped:
            spans = [(0, math.inf)]
        with fields_expected(self._torque):
            for span in spans if self._torque else []:
                for _, message in self._bag.decoded([self._torque], *span):
                    torques = message.intrinsic, message.delivered, message.effective_perturbation
                    stamps.append(messages.nanoseconds_of(message.header.stamp))
                    rows.append(tuple(torque[side] for torque in torques))
        return AnkleTorques(np.array(stamps, np.int64), *np.array(rows).reshape(-1, 3).T)


def side_in(bag: BagReader, relative: str) -> Side | None:
    """Return the side in a topic's first valid message; None if there is none."""
    with fields_expected(relative):
        for message in bag.messages_of(relative, f"{_OWN}{_TYPES[relative]}"):
            with suppress(messages.MessageError):
                return side_of(message)
    return None


@contextmanager
def fields_expected(topic: str) -> Iterator[None]:
    """Raise BagError for a message that lacks a field of this version."""
    try:
        yield
    except AttributeError as error:
        raise BagError(
            f"{topic}: its messages have no field {error.name}: recorded by another version"
        ) from None


def _difference(topic: str, published: Sequence[Any], current: Sequence[dict[str, Any]]) -> str:
    """Describe where published messages first differ from results; "" if they do not."""
    for number, (message, values) in enumerate(zip(published, current, strict=False), start=1):
        for name, value in values.items():
            if name in _ADDED and not hasattr(message, name):
                continue
            found = _plain(getattr(message, name))
            if _bits(found) != _bits(value):
                return f"{topic}: {name} of message {number}: {found} recorded, {value} now"
    if len(published) != len(current):
        return f"{topic}: {len(published)} messages recorded, {len(current)} now"
    return ""


def _plain(value: Any) -> Any:
    """Return a header or a time as nanoseconds, anything else unchanged."""
    value = getattr(value, "stamp", value)
    return messages.nanoseconds_of(value) if hasattr(value, "nanosec") else value


def _bits(value: Any) -> Any:
    """Return a value in a form that compares floats, including NaN, bit by bit."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    return [_bits(item) for item in value] if isinstance(value, (list, tuple)) else int(value)
