# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A recorded run, read from its bag and analyzed again, without ROS.

Only what is needed is read, through the index of the bag: the events, what the robot promised and
measured, and what the analyzer published. Ankle torque is read only for strides that a figure
shows.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gait_entrainment.conventions import Side
from gait_entrainment.experiment import BlockRun, Conductor, GaitError
from gait_entrainment.gait import Analysis, GaitEvent, Stride, VerdictSettings
from gait_entrainment.protocol import Protocol, ProtocolError, read_protocol
from gait_entrainment.run import Run, analyze_blocks, settings_for
from gait_entrainment.settings import SettingError
from gait_entrainment_bags import topic_names
from gait_entrainment_bags.errors import BagError
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_bags.recovery import RECOVERY_KEY
from gait_entrainment_bags.run_messages import AnkleTorques, RunMessages, side_in
from gait_entrainment_bags.truth import TOE_OFF_BIAS, detector_errors, lag_shift, without_bias
from gait_entrainment_bags.writer import ENDED_EARLY
from gait_entrainment_commands.outcome import outcome_of, timing_outcome

# Strides whose ankle torque is drawn: a figure of more would be unreadable. While a lock forms,
# every stride is drawn, or the latest of them if they are many.
STRIDES_DRAWN = 24
_FORMING_DRAWN = 30


@dataclass(frozen=True)
class RecordedRun(Run):
    """One run as recorded in a bag; stamps are nanoseconds since 1970."""

    name: str  # of the protocol; without one, of the bag
    side: Side  # the perturbed leg
    torques: AnkleTorques  # of the strides that figures show; empty unless requested
    messages: int  # in the bag, on all topics
    lost: int | None  # published but not recorded; None if no publisher gave a count
    real_time_factor: float  # walked time over wall time, first to last /clock; NaN without it
    left_out: int = 0  # messages of another run, and invalid ones
    onset: str = "commanded"  # onset used by the live analysis: this or "measured"
    toe_off_bias: float = 0.0  # [s] by which the toe-offs of the events are late
    detector_errors: dict[str, Any] | None = None  # None if the exact events are unknown
    ended_early: str = ""  # why the recording ended before the run did
    # How the results published live differ from another analysis of the same onsets, a line per
    # topic; () if they are equal to the last bit, None if none were recorded.
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
    Read a bag, a folder or an ``.mcap`` file from any recorder, and analyze it again.

    ``settings`` are the verdict's parameters. ``torques`` reads the ankle torque of the strides
    in figures. A pulse begins at its "commanded" or "measured" ``onset``, by default as in the
    live analysis; ``protocol`` and ``side`` are as in `protocol_and_side`. Raises BagError if it
    is not a bag, is damaged, or lacks required topics.
    """
    with BagReader(path) as bag:
        protocol, side = protocol_and_side(bag, protocol, side)
        record = RunMessages(bag)
        onsets = {
            "commanded": [(leg, timing.commanded) for leg, timing in record.delivered],
            "measured": [(leg, timing.onset) for leg, timing in record.delivered],
        }
        if (live_onset := bag.custom_data.get("onset", "commanded")) not in onsets:
            raise BagError(f"{path}: its onset is {live_onset!r}; allowed: {', '.join(onsets)}")
        recorded_side = side_in(bag, topic_names.STRIDES)
        live_sides: Sequence[Side] = [side if recorded_side is None else recorded_side]
        if protocol is not None and len(protocol.sides) > 1:
            live_sides = protocol.sides
        bias = _toe_off_bias(bag)
        events = without_bias(record.events, bias)
        used = settings_for(protocol.sequence if protocol else (), settings)
        live = {
            leg: analyze_blocks((), events, onsets[live_onset], leg, used, record.unknown)[0]
            for leg in live_sides
        }
        blocks = conducted(protocol, record.events)
        chosen, unknown = onsets[onset or live_onset], record.unknown
        if side not in {leg for leg, _ in chosen}:  # its strides, with pulses on the other ankle
            chosen = [(side, time) for _, time in chosen]
            unknown = sorted({(side, start, end) for _, start, end in unknown})
        analysis, judged = analyze_blocks(blocks, events, chosen, side, settings, unknown)
        measured_period, pulse_period = periods_of(blocks, analysis)
        run = RecordedRun(
            protocol=protocol,
            name=Path(path).stem if protocol is None else protocol.name,
            side=side,
            events=tuple(record.events),
            measured_period=measured_period,
            pulse_period=pulse_period,
            analysis=analysis,
            blocks=judged,
            delivered=tuple(record.delivered),
            onset=live_onset,
            differences=record.differences_from(live),
            torques=record.read_torques(side, []),
            toe_off_bias=bias,
            messages=bag.message_count,
            lost=_lost(bag),
            left_out=record.left_out,
            real_time_factor=record.real_time_factor,
            ended_early=bag.custom_data.get(ENDED_EARLY, ""),
        )
        if record.true_events:
            exact, _ = analyze_blocks((), record.true_events, chosen, side, settings)
            errors = detector_errors(record.events, record.true_events)
            run = replace(run, detector_errors=errors | lag_shift(analysis, exact))
        if torques:
            run = replace(run, torques=record.read_torques(side, drawn_strides(run)))
        return run


def protocol_and_side(
    bag: BagReader, protocol: Protocol | None = None, side: Side | None = None
) -> tuple[Protocol | None, Side]:
    """
    Return the protocol of a recorded run, if it is known, and the perturbed leg.

    A given ``protocol`` replaces the one in the bag, and a given ``side`` the protocol's.
    Other projects' recorders store no protocol: the leg is then the one that wore the robot.
    Raises BagError if the bag's protocol cannot be read, or the leg is unknown.
    """
    if protocol is None and (text := bag.custom_data.get("protocol", "").strip()):
        try:
            protocol = read_protocol(f"{text}\n")  # the line break marks it as text, not a path
        except ProtocolError as error:
            raise BagError(
                f"{bag.path}: its protocol cannot be read: {error}; give --protocol"
            ) from None
    if protocol is not None:
        protocol = protocol if side is None else replace(protocol, side=side)
        return protocol, protocol.side
    side = side_in(bag, topic_names.TORQUE_PROFILE) if side is None else side
    if side is None:
        raise BagError(
            f"{bag.path}: holds no run, or does not state which leg is perturbed: "
            "give --side or --protocol"
        )
    return None, side


def conducted(protocol: Protocol | None, events: Sequence[GaitEvent]) -> Sequence[BlockRun]:
    """Return the blocks of a protocol as they were planned on a walk; () without a protocol."""
    if protocol is None:
        return ()
    conductor = Conductor(protocol)
    try:
        for event in events:
            conductor.add_event(event)
    except (GaitError, ProtocolError):
        pass  # too few events are left for planning: the periods stay unknown
    return conductor.blocks


def periods_of(blocks: Sequence[BlockRun], analysis: Analysis) -> tuple[float, float]:
    """Return unperturbed and pulse period [s]: as planned, otherwise as analyzed."""
    if blocks:
        return blocks[-1].measured_period, blocks[-1].pulse_period
    last = analysis.entrainments[-1] if analysis.entrainments else None
    return (last.unperturbed_period, last.pulse_period) if last else (math.nan, math.nan)


def _toe_off_bias(bag: BagReader) -> float:
    """Return by how much toe-offs are late [s], as known when the run was recorded."""
    recorded = bag.custom_data.get("toe_off_bias", "0")
    try:
        return float(TOE_OFF_BIAS.parse("toe_off_bias", recorded))
    except SettingError as error:
        raise BagError(f"{bag.path}: {error}") from None


def _lost(bag: BagReader) -> int | None:
    """Return how many published messages are missing in the bag; None if that is unknown."""
    published: dict[str, int] = {}
    names = [n for n, topic in bag.topics.items() if topic.type.endswith("/PublishedCounts")]
    for _, message in bag.decoded(names):
        published |= dict(zip(message.topics, message.counts, strict=False))
    lost = sum(max(n - bag.counts.get(name, n), 0) for name, n in published.items())
    text = bag.custom_data.get("messages_lost")
    if text is None or (RECOVERY_KEY in bag.custom_data and not published):
        return lost or None
    try:
        return max(lost, sum(map(int, json.loads(text).values())))
    except (ValueError, OverflowError, TypeError, AttributeError):
        raise BagError(
            f"{bag.path}: its messages_lost is {text!r}; allowed: a JSON object of counts by topic"
        ) from None


def drawn_strides(run: Run) -> list[Stride]:
    """Return the strides whose ankle torque is drawn: evenly spaced, all while a lock forms."""
    strides, forming = run.strides, list[Stride]()
    for part in [block.analysis for block in run.blocks] or [run.analysis]:
        since = part.entrainments[-1].entrained_since_stride if part.entrainments else None
        if since is not None and part.pulses:
            first = part.pulses[0].stride
            forming += [s for s in strides if first <= s.number <= since + 1]
    del forming[:-_FORMING_DRAWN]
    others = [stride for stride in strides if stride not in forming]
    count = min(max(STRIDES_DRAWN - len(forming), STRIDES_DRAWN // 3), len(others))
    spread = np.linspace(0, len(others) - 1, count).round().astype(int)
    return sorted([*forming, *(others[i] for i in spread)], key=lambda stride: stride.number)


def recorded_outcome(run: RecordedRun, bag: Path) -> dict[str, Any]:
    """Return the outcome of a run, and what its bag says about the recording."""
    factor = run.real_time_factor
    return outcome_of(run) | {
        "bag": str(bag),
        "side": run.side.name.lower(),
        "messages": run.messages,
        "lost": run.lost,
        "left_out": run.left_out,
        "real_time_factor": None if math.isnan(factor) else factor,
        "pulse_timing": timing_outcome(run.timings, run.measured_period),
        **({"toe_off_bias": run.toe_off_bias} if run.toe_off_bias else {}),
        **({"detector_errors": run.detector_errors} if run.detector_errors else {}),
    }


def walker_timing(reader: BagReader) -> dict[str, dict[str, float]]:
    """Return how punctual a walker was, from its last report; {} without one."""
    last = list(reader.messages_of(topic_names.WALKER_TIMING))[-1:]
    timing = {}
    for walker in last:
        if walker.samples:
            timing["publish_lateness_ms"] = {
                name: 1e3 * getattr(walker, f"publish_late_{name}")
                for name in ("p50", "p99", "worst")
            }
        timing["promises"] = {
            "late_stretches": walker.late_stretches,
            "late_ms": 1e3 * walker.late,
            "starved_stretches": walker.starved_stretches,
            "starved_ms": 1e3 * walker.starved,
        }
    return timing


def messages_line(run: RecordedRun) -> str:
    """Return a line about how many messages were recorded, and what is missing."""
    missing = "" if run.lost is None else f", {run.lost} lost"
    if run.ended_early:
        missing = f"; the recording ended early: {run.ended_early}"
    if run.left_out:
        missing += f"; {run.left_out} left out: of another run, or invalid"
    return f"messages         {run.messages} recorded{missing}"
