# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One recorded run, read from its bag and analyzed anew, without ROS.

Only what is needed is read, through the index of the bag: of an hour of samples the events, the
promised pulses and what the analyzer published. Ankle torque is read where a figure shows it.
"""

import json
import math
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import EventKind, Side, stamp_nanoseconds
from gait_entrainment.experiment import Conductor
from gait_entrainment.gait import (
    Analysis,
    GaitEvent,
    Stride,
    VerdictSettings,
    analyze,
    published_values,
)
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.outcome import Run, outcome_of, timing_outcome
from gait_entrainment.protocol import Protocol, ProtocolError, read_protocol
from gait_entrainment.robot import PulseTiming
from gait_entrainment_bags import ENDED_EARLY, BagError, BagMessage, BagReader
from gait_entrainment_bags.pulse_timing import fields_expected, recorded_timings

# Strides of which the ankle torque is read: more would not be told apart in a figure.
STRIDES_DRAWN = 24
_EVENTS, _PROFILES = "gait_events", "perturbation/torque_profile"
_TORQUE = "ankle_torque"
_STRIDES, _PULSES, _VERDICTS = "gait/strides", "gait/pulse_phases", "gait/entrainment"
_TYPES = {
    _EVENTS: "GaitEvent",
    _PROFILES: "TorqueProfile",
    _TORQUE: "AnkleTorque",
    _STRIDES: "Stride",
    _PULSES: "PulsePhase",
    _VERDICTS: "Entrainment",
}


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

    protocol: Protocol
    events: tuple[GaitEvent, ...]
    onsets: tuple[int, ...]  # of the pulses [ns]
    measured_period: float  # mean stride period over the baseline [s]; NaN without a plan
    pulse_period: float  # as planned from it [s]; NaN without a plan
    analysis: Analysis
    timings: tuple[PulseTiming, ...]  # commanded, sent and measured onset of each pulse
    torques: AnkleTorques  # of the strides that figures show; empty unless asked for
    messages: int  # in the bag, on all topics
    lost: int | None  # published but not recorded; None where no publisher gave a count
    real_time_factor: float  # walked time over wall time, first to last /clock; NaN without
    onset: str = "commanded"  # what the live analysis took pulses to begin with, or "measured"
    ended_early: str = ""  # why the recording ended before the run did
    differences: tuple[str, ...] | None = None
    """How what the analyzer published live differs from an analysis anew of the same onsets, a
    line per topic; () where they are equal to the last bit, None where nothing was recorded."""


def read_run(
    path: Path | str,
    settings: VerdictSettings | None = None,
    *,
    torques: bool = True,
    onset: str | None = None,
) -> RecordedRun:
    """
    Read a bag of this project and analyze it anew.

    Parameters
    ----------
    path
        Folder or ``.mcap`` file.
    settings
        The numbers in the verdict.
    torques
        Read the ankle torque of the strides that figures show.
    onset
        Where a pulse begins: "commanded" or "measured"; by default as the live analysis took it.

    Raises
    ------
    BagError
        where it is no bag, is damaged, or lacks the protocol or the topics that are needed.

    """
    with BagReader(path) as bag:
        try:
            protocol = read_protocol(bag.custom_data["protocol"])
        except KeyError:
            raise BagError(f"{path}: holds no protocol: not a run of this project") from None
        except ProtocolError as error:
            raise BagError(f"{path}: its protocol cannot be read: {error}") from None
        record = _Record(bag, path)
        timings = tuple(recorded_timings(path))
        onsets = {"commanded": record.onsets, "measured": [t.onset for t in timings]}
        live_onset = bag.custom_data.get("onset", "commanded")
        if live_onset not in onsets:
            raise BagError(f"{path}: its onset is {live_onset!r}; allowed: {', '.join(onsets)}")
        live, analysis = (
            analyze(record.events, onsets[kind], protocol.side, settings)
            for kind in (live_onset, onset or live_onset)
        )
        conductor = Conductor(protocol)
        try:
            for event in record.events:
                conductor.add_event(event)
        except ProtocolError:
            pass  # too few events are left to plan by: the periods stay unknown
        return RecordedRun(
            protocol=protocol,
            events=tuple(record.events),
            onsets=tuple(record.onsets),
            measured_period=conductor.measured_period,
            pulse_period=conductor.train.period if conductor.train else math.nan,
            analysis=analysis,
            timings=timings,
            onset=live_onset,
            differences=record.differences_from(live, protocol.side),
            torques=_read_torques(
                bag,
                protocol.side,
                drawn_strides(protocol, analysis) if torques else [],
                stamped=record.stamped,
            ),
            messages=bag.message_count,
            lost=_lost(bag),
            real_time_factor=record.real_time_factor,
            ended_early=bag.custom_data.get(ENDED_EARLY, ""),
        )


def _lost(bag: BagReader) -> int | None:
    """Return how many messages the recorder missed; None where it does not say."""
    told = bag.custom_data.get("messages_lost")
    if told is None:
        return None
    try:
        return sum(map(int, json.loads(told).values()))
    except (ValueError, TypeError, AttributeError):
        raise BagError(
            f"{bag.path}: its messages_lost is {told!r}; allowed: a JSON object of counts by topic"
        ) from None


def drawn_strides(protocol: Protocol, analysis: Analysis) -> list[Stride]:
    """Return the strides whose ankle torque is drawn: up to 24, evenly spread over the run."""
    strides = [s for s in analysis.strides if s.number <= protocol.strides]
    if not strides:
        return []
    chosen = np.unique(np.linspace(0, len(strides) - 1, STRIDES_DRAWN).round().astype(int))
    return [strides[i] for i in chosen]


class _Record:
    """
    Events, onsets and published results of a bag, read in one pass.

    Messages are taken in the order in which they were received, which is that of the file: the
    analyzer met them in that order, and a stop voids only what was promised before it.
    """

    def __init__(self, bag: BagReader, path: Path | str) -> None:
        self.events: list[GaitEvent] = []
        self.onsets: list[int] = []
        self.stamped = True  # log times are the stamps, so that instants can be looked up
        self._published: dict[str, list[Any]] = {}
        names = {suffix: _find(bag, suffix) for suffix in (_EVENTS, _PROFILES)}
        if missing := [suffix for suffix, name in names.items() if name is None]:
            raise BagError(f"{path}: lacks the topics {', '.join(missing)}")
        for suffix in (_STRIDES, _PULSES, _VERDICTS):
            if (name := _find(bag, suffix)) is not None:
                names[suffix] = name
                self._published[suffix] = []
        suffixes = {name: suffix for suffix, name in names.items() if name is not None}
        clocks: list[BagMessage] = []
        decoded = []
        # /clock tells how fast the run went; of its messages the first and the last are kept.
        clock = ["/clock"] if "/clock" in bag.topics else []
        for message in bag.messages([*suffixes, *clock]):
            if message.topic == "/clock":
                clocks[1:] = [message]
            else:
                decoded.append(message)
        decoded.sort(key=lambda message: message.place)
        decode = {name: bag.decoder(name) for name in suffixes}
        for message in decoded:
            with fields_expected(message.topic):
                self._add(suffixes[message.topic], message, decode[message.topic](message.data))
        self.real_time_factor = _real_time_factor(clocks)

    def _add(self, suffix: str, message: BagMessage, content: Any) -> None:
        stamp = stamp_nanoseconds(content.header.stamp)
        if suffix == _EVENTS:
            self.stamped &= message.log_time == stamp
            try:
                kind, side = EventKind(content.kind), Side(content.side)
            except ValueError as error:
                raise BagError(f"{message.topic}: not a gait event: {error}") from None
            self.events.append(GaitEvent(stamp, kind, side, content.step))
        elif suffix == _PROFILES:
            if content.stop:
                self.onsets = [onset for onset in self.onsets if onset < stamp]
            else:
                self.onsets += [stamp_nanoseconds(onset) for onset in content.onsets]
        else:
            self._published[suffix].append(content)

    def differences_from(self, analysis: Analysis, side: Side) -> tuple[str, ...] | None:
        """Return how the published results differ from an analysis; None where there are none."""
        if not self._published:
            return None
        results: dict[str, Sequence[Result]] = {
            _STRIDES: analysis.strides,
            _PULSES: analysis.pulses,
            _VERDICTS: analysis.entrainments,
        }
        differences = []
        for suffix, contents in self._published.items():
            anew = [published_values(result, side) for result in results[suffix]]
            with fields_expected(suffix):
                differences.append(_difference(suffix, contents, anew))
        return tuple(filter(None, differences))


def _find(bag: BagReader, suffix: str) -> str | None:
    """Return the topic of a bag with this relative name and its type, in whatever namespace."""
    type_name = f"gait_entrainment_msgs/msg/{_TYPES[suffix]}"
    return next(
        (
            name
            for name, topic in bag.topics.items()
            if name.endswith(f"/{suffix}") and topic.type == type_name
        ),
        None,
    )


def _difference(suffix: str, published: Sequence[Any], anew: Sequence[dict[str, Any]]) -> str:
    """Say where published messages first differ from results; an empty text where nowhere."""
    for number, (content, values) in enumerate(zip(published, anew, strict=False), start=1):
        for name, value in values.items():
            found = getattr(content, name)
            if _bits(found) != _bits(value):
                return (
                    f"{suffix}: {name} of message {number}: {_told(found)} recorded, {value} anew"
                )
    if len(published) != len(anew):
        return f"{suffix}: {len(published)} messages recorded, {len(anew)} anew"
    return ""


def _bits(value: Any) -> Any:
    """Return a value in a form that is equal where every bit of a float is, also of a NaN."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, (list, tuple)):
        return [_bits(item) for item in value]
    if hasattr(value, "stamp"):
        return stamp_nanoseconds(value.stamp)
    return stamp_nanoseconds(value) if hasattr(value, "nanosec") else int(value)


def _told(value: Any) -> Any:
    return _bits(value) if hasattr(value, "stamp") or hasattr(value, "nanosec") else value


def _real_time_factor(clocks: Sequence[BagMessage]) -> float:
    """Return simulated over wall time from the first to the last /clock; NaN without two."""
    if len(clocks) < 2 or clocks[1].publish_time <= clocks[0].publish_time:
        return math.nan
    wall = clocks[1].publish_time - clocks[0].publish_time
    return (clocks[1].log_time - clocks[0].log_time) / wall


def _read_torques(
    bag: BagReader, side: Side, strides: Sequence[Stride], *, stamped: bool
) -> AnkleTorques:
    """Read the ankle torque of some strides; of all where the log times are not the stamps."""
    rows: list[tuple[int, float, float, float]] = []
    name = _find(bag, _TORQUE)
    spans: Iterable[tuple[int, float]] = [(stride.start, stride.end) for stride in strides]
    if strides and not stamped:
        spans = [(0, math.inf)]
    for start, end in spans if name is not None else []:
        rows += _torque_rows(bag, str(name), side, start, end)
    stamps, *columns = zip(*rows, strict=True) if rows else ((), (), (), ())
    return AnkleTorques(
        np.array(stamps, np.int64), *(np.array(column, float) for column in columns)
    )


def _torque_rows(
    bag: BagReader, name: str, side: Side, start: int, end: float
) -> Iterator[tuple[int, float, float, float]]:
    for _, message in bag.decoded([name], start, end):
        with fields_expected(name):
            row = (
                stamp_nanoseconds(message.header.stamp),
                message.intrinsic[side],
                message.delivered[side],
                message.effective_perturbation[side],
            )
        yield row


def recorded_outcome(run: RecordedRun, bag: Path) -> dict[str, Any]:
    """Return the outcome of a run, and what its bag tells of how it went."""
    factor = run.real_time_factor
    return outcome_of(run) | {
        "bag": str(bag),
        "messages": run.messages,
        "lost": run.lost,
        "real_time_factor": None if math.isnan(factor) else factor,
        "pulse_timing": timing_outcome(run.timings, run.measured_period),
    }


def messages_line(run: RecordedRun) -> str:
    """Say how many messages were recorded, and what is missing."""
    left_out = "" if run.lost is None else f", {run.lost} lost"
    if run.ended_early:
        left_out = f"; the recording ended early: {run.ended_early}"
    return f"messages         {run.messages} recorded{left_out}"
