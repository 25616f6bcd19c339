# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One recorded run, read from its bag and analyzed anew, without ROS.

Only what is needed is read, through the index of the bag: of an hour of samples the events, what
the robot promised and felt, and what the analyzer published. Ankle torque is read only where a
figure shows it.
"""

import json
import math
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import Side
from gait_entrainment.experiment import BlockRun, Conductor, GaitError
from gait_entrainment.gait import Analysis, GaitEvent, Stride, VerdictSettings, analyze
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.protocol import Protocol, ProtocolError, read_protocol
from gait_entrainment.robot import MeasuredOnsets, TorqueProfile
from gait_entrainment.run import Run, analyze_blocks, settings_for
from gait_entrainment.settings import SettingError
from gait_entrainment_bags import messages, topic_names
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.holes import hole_before
from gait_entrainment_bags.mcap_records import BagMessage
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_bags.recovery import RECOVERY_KEY
from gait_entrainment_bags.truth import TOE_OFF_BIAS, detector_errors, lag_shift, without_bias
from gait_entrainment_bags.writer import ENDED_EARLY
from gait_entrainment_commands.outcome import outcome_of, timing_outcome

# Strides of which the ankle torque is drawn: more would not be told apart in a figure. Those while
# a lock forms are drawn one by one, the latest of them if they are many.
STRIDES_DRAWN = 24
_FORMING_DRAWN = 30
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
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class AnkleTorques:
    """Sampled ankle torque of the perturbed leg, plantarflexion positive."""

    stamps: NDArray[np.int64]  # [ns], shape (n,)
    intrinsic: NDArray[np.float64]  # of the leg's own spring [N m], shape (n,)
    delivered: NDArray[np.float64]  # by the robot, whatever the phase [N m], shape (n,)
    effective: NDArray[np.float64]  # the part of it that acts on the walker [N m], shape (n,)


@dataclass(frozen=True)
class RecordedRun(Run):
    """What a bag holds of one run; stamps are nanoseconds since 1970, as recorded."""

    name: str  # of the protocol; without one, of the bag
    side: Side  # the perturbed leg
    torques: AnkleTorques  # of the strides that figures show; empty unless asked for
    messages: int  # in the bag, on all topics
    lost: int | None  # published but not recorded; None if no publisher gave a count
    real_time_factor: float  # walked time over wall time, first to last /clock; NaN without
    onset: str = "commanded"  # what the live analysis took pulses to begin with, or "measured"
    toe_off_bias: float = 0.0  # [s] by which the toe-offs of the events are late
    detector_errors: dict[str, Any] | None = None  # None if nobody knows the exact events
    ended_early: str = ""  # why the recording ended before the run did
    # How what the analyzer published live differs from an analysis anew of the same onsets, a
    # line per topic; () if they are equal to the last bit, None if nothing was recorded.
    differences: tuple[str, ...] | None = None


def read_run(
    path: Path | str,
    settings: VerdictSettings | None = None,
    *,
    torques: bool = True,
    onset: str | None = None,
    protocol: Protocol | None = None,
    side: Side | None = None,
) -> RecordedRun:
    """
    Read a bag, a folder or an ``.mcap`` file, and analyze it anew, whoever recorded it.

    ``settings`` are the numbers in the verdict. ``torques`` reads the ankle torque of the strides
    in figures. A pulse begins at its "commanded" or "measured" ``onset``, by default that of the
    live analysis; ``protocol`` and ``side`` as in `protocol_and_side`. Raises BagError if it is no
    bag, is damaged, or lacks the topics that are needed.
    """
    with BagReader(path) as bag:
        protocol, side = protocol_and_side(bag, protocol, side)
        record = _Record(bag)
        onsets = {"commanded": record.onsets, "measured": [t.onset for t in record.timings]}
        if (live_onset := bag.custom_data.get("onset", "commanded")) not in onsets:
            raise BagError(f"{path}: its onset is {live_onset!r}; allowed: {', '.join(onsets)}")
        recorded_side = _side_in(bag, topic_names.STRIDES)
        live_side = side if recorded_side is None else recorded_side
        bias = _toe_off_bias(bag)
        events = without_bias(record.events, bias)
        told = settings_for(protocol.sequence if protocol else (), settings)
        live = analyze(events, onsets[live_onset], live_side, told, record.unknown)
        blocks = _conducted(protocol, record.events) if protocol else ()
        begun = onsets[onset or live_onset]
        analysis, judged = analyze_blocks(blocks, events, begun, side, settings, record.unknown)
        measured_period, pulse_period = _periods(blocks, analysis)
        run = RecordedRun(
            protocol=protocol,
            name=Path(path).stem if protocol is None else protocol.name,
            side=side,
            events=tuple(record.events),
            onsets=tuple(record.onsets),
            measured_period=measured_period,
            pulse_period=pulse_period,
            analysis=analysis,
            blocks=judged,
            timings=tuple(record.timings),
            onset=live_onset,
            differences=record.differences_from(live, live_side),
            torques=record.read_torques(side, []),
            toe_off_bias=bias,
            messages=bag.message_count,
            lost=_lost(bag),
            real_time_factor=record.real_time_factor,
            ended_early=bag.custom_data.get(ENDED_EARLY, ""),
        )
        if record.true_events:
            exact = analyze(record.true_events, begun, side, settings)
            errors = detector_errors(record.events, record.true_events)
            run = replace(run, detector_errors=errors | lag_shift(analysis, exact))
        if torques:
            run = replace(run, torques=record.read_torques(side, drawn_strides(run)))
        return run


def protocol_and_side(
    bag: BagReader, protocol: Protocol | None = None, side: Side | None = None
) -> tuple[Protocol | None, Side]:
    """
    Return the protocol of a recorded run, if anybody tells it, and the perturbed leg.

    A ``protocol`` that is given stands for the one in the bag, and a ``side`` for the protocol's.
    A recorder of another project keeps no protocol: the leg is then that on which the robot sat.
    Raises BagError if the bag's protocol cannot be read, or nothing tells the leg.
    """
    if protocol is None and "protocol" in bag.custom_data:
        try:
            protocol = read_protocol(bag.custom_data["protocol"])
        except ProtocolError as error:
            raise BagError(f"{bag.path}: its protocol cannot be read: {error}") from None
    if protocol is not None:
        protocol = protocol if side is None else replace(protocol, side=side)
        return protocol, protocol.side
    side = _side_in(bag, topic_names.TORQUE_PROFILE) if side is None else side
    if side is None:
        raise BagError(
            f"{bag.path}: holds no run, or one of which nothing tells the perturbed leg: "
            "give --side or --protocol"
        )
    return None, side


def _side_in(bag: BagReader, relative: str) -> Side | None:
    """Return the side that the first message of a topic names; None if there is none."""
    if name := _find(bag, relative):
        with _fields_expected(name):
            for _, message in bag.decoded([name]):
                return messages.side_of(message)
    return None


def _conducted(protocol: Protocol, events: Sequence[GaitEvent]) -> Sequence[BlockRun]:
    """Return the blocks of a protocol, as they were planned on a walk."""
    conductor = Conductor(protocol)
    try:
        for event in events:
            conductor.add_event(event)
    except (GaitError, ProtocolError):
        pass  # too few events are left to plan by: the periods stay unknown
    return conductor.blocks


def periods_of(
    protocol: Protocol | None, events: Sequence[GaitEvent], analysis: Analysis
) -> tuple[float, float]:
    """Return unperturbed and pulse period [s]: as a protocol plans them, else as analyzed."""
    return _periods(_conducted(protocol, events) if protocol else (), analysis)


def _periods(blocks: Sequence[BlockRun], analysis: Analysis) -> tuple[float, float]:
    """Return unperturbed and pulse period [s]: as a protocol plans them, else as analyzed."""
    if blocks:
        return blocks[-1].measured_period, blocks[-1].pulse_period
    last = analysis.entrainments[-1] if analysis.entrainments else None
    return (last.unperturbed_period, last.pulse_period) if last else (math.nan, math.nan)


def _toe_off_bias(bag: BagReader) -> float:
    """Return by how much toe-offs are late [s], as it was known when the run was recorded."""
    told = bag.custom_data.get("toe_off_bias", "0")
    try:
        return float(TOE_OFF_BIAS.parse("toe_off_bias", told))
    except SettingError as error:
        raise BagError(f"{bag.path}: {error}") from None


def _lost(bag: BagReader) -> int | None:
    """Return how many messages of what was published are not here; None if nothing tells."""
    published: dict[str, int] = {}
    names = [n for n, topic in bag.topics.items() if topic.type.endswith("/PublishedCounts")]
    for _, message in bag.decoded(names) if names else ():
        published |= dict(zip(message.topics, message.counts, strict=True))
    lost = sum(max(n - bag.counts.get(name, n), 0) for name, n in published.items())
    told = bag.custom_data.get("messages_lost")
    if told is None or (RECOVERY_KEY in bag.custom_data and not published):
        return lost or None
    try:
        return max(lost, sum(map(int, json.loads(told).values())))
    except (ValueError, TypeError, AttributeError):
        raise BagError(
            f"{bag.path}: its messages_lost is {told!r}; allowed: a JSON object of counts by topic"
        ) from None


def drawn_strides(run: Run) -> list[Stride]:
    """Return the strides whose ankle torque is drawn: evenly spread, each while a lock forms."""
    strides, analysis = run.strides, run.analysis
    if not strides:
        return []
    forming: list[Stride] = []
    since = analysis.entrainments[-1].entrained_since_stride if analysis.entrainments else None
    if since is not None and analysis.pulses:
        first = analysis.pulses[0].stride
        forming = [s for s in strides if first <= s.number <= since + 1][-_FORMING_DRAWN:]
    others = [stride for stride in strides if stride not in forming]
    count = min(max(STRIDES_DRAWN - len(forming), STRIDES_DRAWN // 3), len(others))
    spread = np.linspace(0, len(others) - 1, count).round().astype(int)
    return sorted([*forming, *(others[i] for i in spread)], key=lambda stride: stride.number)


class _Record:
    """
    Events, onsets and published results of a bag, read in one pass.

    The messages of a topic are taken in the order in which they were received, which is that of
    the file: the analyzer met them in that order, and a stop voids only what was promised before.
    """

    def __init__(self, bag: BagReader) -> None:
        self._bag = bag
        self._names = {relative: name for relative in _TYPES if (name := _find(bag, relative))}
        needed = (topic_names.GAIT_EVENTS, topic_names.TORQUE_PROFILE)
        if missing := [relative for relative in needed if relative not in self._names]:
            raise BagError(f"{bag.path}: lacks the topics {', '.join(missing)}")
        self._torque = self._names.pop(topic_names.ANKLE_TORQUE, "")
        self._messages: dict[str, list[BagMessage]] = {name: [] for name in self._names.values()}
        self.real_time_factor = self._read()
        events = self._messages[self._names[topic_names.GAIT_EVENTS]]
        self.events, self.true_events = (
            [event for event in self._values(name, _event_of) if event]
            for name in (topic_names.GAIT_EVENTS, topic_names.TRUE_EVENTS)
        )
        # Whether the log times are the stamps, so that instants can be looked up.
        self._stamped = [m.log_time for m in events] == [event.stamp for event in self.events]
        self.onsets: list[int] = []
        self.unknown: list[tuple[int, int]] = []  # spans of which no torque profile is here [ns]
        measured = MeasuredOnsets()
        adjoins: float | None = None
        promises = self._values(topic_names.TORQUE_PROFILE, lambda m: (m, _promise_of(m)))
        for message, promise in promises:
            if isinstance(promise, TorqueProfile):
                if hole := hole_before(message, adjoins):
                    self.unknown.append(hole)
                adjoins = promise.valid_until
                self.onsets += promise.onsets
                measured.add_promise(promise.onsets, promise.valid_until)
            else:
                adjoins = math.inf
                self.onsets = [onset for onset in self.onsets if onset < promise]
                measured.stop(promise)
        for pulse in self._values(topic_names.PULSES, messages.pulse_of):
            measured.add_pulse(*pulse)
        for state in self._values(topic_names.ROBOT_STATE, messages.state_of):
            measured.add_state(state)
        measured.finish()
        self.timings = measured.timings

    def _read(self) -> float:
        """Read the messages by topic; return walked over wall time by /clock, NaN without."""
        clocks: list[BagMessage] = []  # the first and the last
        clock = [topic_names.CLOCK] if topic_names.CLOCK in self._bag.topics else []
        for message in self._bag.messages([*self._messages, *clock]):
            if message.topic in self._messages:
                self._messages[message.topic].append(message)
            else:
                clocks[1:] = [message]
        for received in self._messages.values():
            received.sort(key=lambda message: message.place)
        if len(clocks) < 2 or clocks[1].publish_time <= clocks[0].publish_time:
            return math.nan
        # By what the clock said: other recorders log by the wall clock.
        decode = decoder_for(self._bag.topics[topic_names.CLOCK])
        begin, end = (messages.nanoseconds_of(decode(tick.data).clock) for tick in clocks)
        return (end - begin) / (clocks[1].publish_time - clocks[0].publish_time)

    def _values(self, relative: str, value_of: Callable[[Any], _Value]) -> Iterator[_Value]:
        """Give the values of the messages of a topic, which are not kept."""
        if relative in self._names:
            name = self._names[relative]
            decode = decoder_for(self._bag.topics[name])
            with _fields_expected(name):
                for message in self._messages.pop(name):
                    yield value_of(decode(message.data))

    def differences_from(self, analysis: Analysis, side: Side) -> tuple[str, ...] | None:
        """Return how the published results differ from an analysis; None if there are none."""
        results: dict[str, Sequence[Result]] = {
            topic_names.STRIDES: analysis.strides,
            topic_names.PULSE_PHASES: analysis.pulses,
            topic_names.ENTRAINMENT: analysis.entrainments,
        }
        if results.keys().isdisjoint(self._names):
            return None
        differences = []
        for relative in filter(self._names.get, results):
            anew = [messages.result_values(result, side) for result in results[relative]]
            with _fields_expected(relative):
                found = list(self._values(relative, lambda message: message))
                differences.append(_difference(relative, found, anew))
        return tuple(filter(None, differences))

    def read_torques(self, side: Side, strides: Sequence[Stride]) -> AnkleTorques:
        """Read the ankle torque of some strides; of all if the log times are not the stamps."""
        stamps: list[int] = []
        rows: list[tuple[float, float, float]] = []
        spans: list[tuple[int, float]] = [(stride.start, stride.end) for stride in strides]
        if strides and not self._stamped:
            spans = [(0, math.inf)]
        with _fields_expected(self._torque):
            for span in spans if self._torque else []:
                for _, message in self._bag.decoded([self._torque], *span):
                    torques = message.intrinsic, message.delivered, message.effective_perturbation
                    stamps.append(messages.nanoseconds_of(message.header.stamp))
                    rows.append(tuple(torque[side] for torque in torques))
        return AnkleTorques(np.array(stamps, np.int64), *np.array(rows).reshape(-1, 3).T)


def _find(bag: BagReader, relative: str) -> str | None:
    """Return the topic of a bag with this relative name and its type, in whatever namespace."""
    type_name = f"gait_entrainment_msgs/msg/{_TYPES[relative]}"
    names = (name for name, topic in bag.topics.items() if topic.type == type_name)
    # The shortest: /truth/gait_events holds what is to be compared with /gait_events.
    return min((n for n in names if n.endswith(f"/{relative}")), key=len, default=None)


def _event_of(message: Any) -> GaitEvent | None:
    """Return the event of a message; None for one that cannot be, which the analyzer drops too."""
    try:
        return messages.event_of(message)
    except messages.MessageError:
        return None


def _promise_of(message: Any) -> TorqueProfile | int:
    """Return what a TorqueProfile message promises, or the instant of the stop it reports."""
    stop = messages.stop_of(message)
    return messages.profile_of(message) if stop is None else stop


@contextmanager
def _fields_expected(topic: str) -> Iterator[None]:
    """Raise BagError for a message without a field or a meaning that this version knows."""
    try:
        yield
    except AttributeError as error:
        raise BagError(
            f"{topic}: its messages have no field {error.name}: recorded by another version"
        ) from None
    except messages.MessageError as error:
        raise BagError(f"{topic}: {error}") from None


def _difference(topic: str, published: Sequence[Any], anew: Sequence[dict[str, Any]]) -> str:
    """Say where published messages first differ from results; an empty text if nowhere."""
    for number, (message, values) in enumerate(zip(published, anew, strict=False), start=1):
        for name, value in values.items():
            if name in _ADDED and not hasattr(message, name):
                continue
            found = _plain(getattr(message, name))
            if _bits(found) != _bits(value):
                return f"{topic}: {name} of message {number}: {found} recorded, {value} anew"
    if len(published) != len(anew):
        return f"{topic}: {len(published)} messages recorded, {len(anew)} anew"
    return ""


def _plain(value: Any) -> Any:
    """Return a header or a time as nanoseconds, anything else as it is."""
    value = getattr(value, "stamp", value)
    return messages.nanoseconds_of(value) if hasattr(value, "nanosec") else value


def _bits(value: Any) -> Any:
    """Return a value in a form that is equal only if every bit of a float is, also of a NaN."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    return [_bits(item) for item in value] if isinstance(value, (list, tuple)) else int(value)


def recorded_outcome(run: RecordedRun, bag: Path) -> dict[str, Any]:
    """Return the outcome of a run, and what its bag says about how it went."""
    factor = run.real_time_factor
    return outcome_of(run) | {
        "bag": str(bag),
        "side": run.side.name.lower(),
        "messages": run.messages,
        "lost": run.lost,
        "real_time_factor": None if math.isnan(factor) else factor,
        "pulse_timing": timing_outcome(run.timings, run.measured_period),
        **({"toe_off_bias": run.toe_off_bias} if run.toe_off_bias else {}),
        **({"detector_errors": run.detector_errors} if run.detector_errors else {}),
    }


def messages_line(run: RecordedRun) -> str:
    """Say how many messages were recorded, and what is missing."""
    left_out = "" if run.lost is None else f", {run.lost} lost"
    if run.ended_early:
        left_out = f"; the recording ended early: {run.ended_early}"
    return f"messages         {run.messages} recorded{left_out}"
