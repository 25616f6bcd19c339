# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Gait events of a recording, and the table that stores them.

The table is an ``events.tsv`` of BIDS (1.10, "Task events"): ``onset`` and ``duration`` in
seconds, ``trial_type``, and columns of our own, described in the JSON file next to it.
"""

import csv
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.gait import GaitEvent, GaitLimits
from gait_entrainment_sensors.detection import ChosenDetector, Detection
from gait_entrainment_sensors.numbering import Numbering, numbered
from gait_entrainment_sensors.recording import RecordingError, Stream, Table, read_table

COLUMNS: dict[str, dict[str, Any]] = {
    "onset": {"Description": "Instant of the event, by the clock of the recording", "Units": "s"},
    "duration": {"Description": "0: an event is an instant", "Units": "s"},
    "trial_type": {
        "Description": "What happened",
        "Levels": {
            "heel_strike": "The foot meets the ground",
            "toe_off": "The foot leaves the ground",
        },
    },
    "side": {"Description": "The foot", "Levels": {"left": "Left", "right": "Right"}},
    "step": {
        "Description": "Heel strike n closes step n; a toe-off belongs to the step in progress. "
        "A gap in the numbers is an event that was not detected"
    },
    "detected_at": {"Description": "Time of the sample that decided it", "Units": "s"},
    "uncertainty": {"Description": "Standard deviation of onset", "Units": "s"},
    "detector": {"Description": "What found the event"},
}
KINDS = {kind.name.lower(): kind for kind in EventKind}


@dataclass(frozen=True)
class DetectedEvent:
    """A detected event and its number."""

    detection: Detection
    event: GaitEvent
    detector: str


def detect(
    chosen: ChosenDetector, streams: Sequence[Stream]
) -> tuple[list[DetectedEvent], tuple[str, ...]]:
    """Return the events in recorded signals, in the order of detection, and any troubles."""
    found: list[Detection] = []
    troubles: list[str] = []
    times = [t for s in streams for t in s.times if math.isfinite(t)] or [0.0]
    for stream in streams:
        walk = [*zip(stream.times, stream.values, strict=True)]
        settings = chosen.detector.calibrated(chosen.settings, walk)
        detector = chosen.detector(stream.side, settings)
        for time, values in walk:
            found += detector.add(time, values)
        troubles += detector.troubles(max(times))
    if not (found or troubles):
        troubles.append(f"it lasts {max(times) - min(times):.3g} s")
    events, of_numbering = number(found, chosen.name)
    return events, (*troubles, *of_numbering)


def number(
    found: Iterable[Detection], detector: str, limits: GaitLimits | None = None
) -> tuple[list[DetectedEvent], tuple[str, ...]]:
    """Return numbered detections, in the order of detection, and any troubles."""
    numbering, before, events = Numbering(limits=limits), dict[Side, Detection](), []
    for detection in sorted(found, key=lambda d: (d.detected_at, d.time)):
        if (event := numbering.add(detection)) is not None:
            events.append(DetectedEvent(detection, event, detector))
        elif not events:
            before[detection.side] = detection  # the latest toe-off of a foot before strike 0
    earlier = [
        DetectedEvent(d, numbered(d, 0 if side is events[0].event.side else -1), detector)
        for side, d in before.items()
        if events
    ]
    return earlier + events, numbering.troubles()


def write_events(path: Path, events: Iterable[DetectedEvent]) -> None:
    """
    Write a table of events and the JSON file that describes it.

    Raises RecordingError if either exists: nothing is overwritten.
    """
    sidecar = path.with_suffix(".json")
    for file in (path, sidecar):
        if file.exists():
            raise RecordingError(f"{file}: is already there; choose another file with --out")
    rows = [
        (
            f"{e.event.stamp / NANOSECONDS_PER_SECOND:.9f}",
            "0",
            e.event.kind.name.lower(),
            e.event.side.name.lower(),
            e.event.step,
            f"{e.detection.detected_at:.9f}",
            f"{e.detection.uncertainty:.6f}",
            e.detector,
        )
        for e in sorted(events, key=lambda e: e.event.stamp)
    ]
    with path.open("x", encoding="utf-8", newline="") as table:
        writer = csv.writer(table, delimiter="\t", lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)
    sidecar.write_text(json.dumps(COLUMNS, indent=2) + "\n", encoding="utf-8")


def read_events(path: Path) -> list[GaitEvent]:
    """
    Return the events of a table: columns onset [s], trial_type, side, and step if it has steps.

    Without steps the events are numbered here, by the period. ``uncertainty`` is read if it is
    there. Raises RecordingError if a column is missing or a field is not allowed.
    """
    table = read_table(path)
    table.require("onset", "trial_type", "side")
    times = _finite(table, "onset")
    sides = {side.name.lower(): side for side in Side}
    kinds, feet = _words(table, "trial_type", KINDS), _words(table, "side", sides)
    uncertainties = [0.0] * len(times)
    if "uncertainty" in table.columns:
        uncertainties = _finite(table, "uncertainty", "0 to 1 s", lambda sd: 0.0 <= sd <= 1.0)
    detections = map(Detection, kinds, feet, times, times, uncertainties)
    if "step" in table.columns:
        steps = _finite(table, "step", "a whole number", float.is_integer)
        events = [numbered(d, int(step)) for d, step in zip(detections, steps, strict=True)]
    else:
        events = [e.event for e in number(detections, "")[0]]
    # A toe-off before strike 0 belongs to no stride.
    known = (e for e in events if e.step > 0 or e.kind is EventKind.HEEL_STRIKE)
    return sorted(known, key=lambda event: event.stamp)


def read_onsets(path: Path) -> list[int]:
    """Return the onsets of pulses [ns]: the column onset [s] of a table."""
    onsets = _finite(read_table(path), "onset")
    return sorted(round(onset * NANOSECONDS_PER_SECOND) for onset in onsets)


def _words(table: Table, name: str, allowed: Mapping[str, Any]) -> list[Any]:
    """Return what the words of a column mean."""
    meant = [allowed.get(text.strip().lower()) for text in table.columns[name][1]]
    if None in meant:
        raise table.refused(meant.index(None), name, ", ".join(allowed))
    return meant


def _finite(
    table: Table,
    name: str,
    allowed: str = "a finite number",
    fits: Callable[[float], bool] = math.isfinite,
) -> list[float]:
    """Return the numbers of a column, each of which must pass ``fits``."""
    numbers = table.numbers(name)
    for row, value in enumerate(numbers):
        if not (abs(value) < 1e10 and fits(value)):  # it may count from 1970
            raise table.refused(row, name, allowed)
    return numbers
