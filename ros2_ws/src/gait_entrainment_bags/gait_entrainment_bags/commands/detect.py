# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain detect: gait events from the signals of a recording."""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.errors import UsageError
from gait_entrainment.robot.drivers import split_options
from gait_entrainment_bags.recorded_signals import read_signals
from gait_entrainment_commands import cli
from gait_entrainment_sensors.detection import ChosenDetector, find_detector
from gait_entrainment_sensors.motion_capture import (
    MARKERS,
    events_of_markers,
    events_on_plates,
    read_c3d,
)
from gait_entrainment_sensors.offline import DetectedEvent, detect, number, write_events
from gait_entrainment_sensors.recording import RecordingError, read_streams

DESCRIPTION = "Find heel strikes and toe-offs in recorded signals; write an events.tsv (BIDS)."
EXAMPLES = """examples:
  entrain detect walk.csv                       columns time, left_force_z, right_force_z
  entrain detect walk.csv --rate 204.8 --column left_foot_gyro_y_deg=gyr_y ...
  entrain detect walk.csv --detector foot_gyroscope:axis_y=1,toe_off_bias=0.004
  entrain detect trial.c3d                      force plates; markers tell the feet apart
  entrain detect bags/mine --detector vertical_force
  entrain detect trial.c3d --detector markers --marker left_heel=L_FCC ...
columns: docs/sensors.md
"""
# Detectors, in the order in which a file is searched for their signals.
TRIED = ("vertical_force", "foot_switch", "foot_gyroscope", "shank_gyroscope", "ankle_encoder")
# Not a detector: it needs the whole recording.
BY_MARKERS = "markers"
Found = tuple[list[DetectedEvent], tuple[str, ...]]  # the events, and what is wrong with them


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="table (.csv, .tsv), C3D file or bag"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="default: FILE_events.tsv")
    parser.add_argument(
        "--detector",
        metavar="NAME[:OPTION=VALUE,...]",
        help="default: the first whose columns are found; markers: by position, for C3D",
    )
    parser.add_argument("--rate", type=float, metavar="HZ", help="replaces a column time [s]")
    for word, meaning in (
        ("column", "a column's name in the file"),
        ("marker", f"name in the file of one of {', '.join(MARKERS)}"),
    ):
        parser.add_argument(
            f"--{word}", action="append", default=[], metavar="NAME=NAME_IN_FILE", help=meaning
        )
    parser.add_argument(
        "--plates", metavar="SIDE,SIDE", help="which foot is on each plate (two belts)"
    )
    cli.add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Detect, write and print."""
    path: Path = options.file
    if options.rate is not None and not 0.0 < options.rate < 1e6:
        raise UsageError(f"--rate: {options.rate:g} Hz; allowed: above 0 and below 1e6")
    out = options.out or path.with_name(f"{path.stem}_events.tsv")
    if not path.exists():
        raise RecordingError(f"{path}: there is no such file")
    kind = ".mcap" if path.is_dir() else path.suffix.lower()
    read = {".c3d": _of_c3d, ".mcap": _of_bag}.get(kind, _of_table)
    taken = {_of_c3d: ("marker", "plates"), _of_table: ("column", "rate")}.get(read, ())
    for name in ("column", "rate", "marker", "plates"):
        if getattr(options, name) and name not in taken:
            raise UsageError(f"--{name}: does not apply to {path}")
    events, troubles = read(path, options)
    if not events:
        reason = f": {'; '.join(troubles)}" if troubles else ""
        raise RecordingError(f"{path}: holds no gait event that could be detected{reason}")
    write_events(out, events)
    counts = {
        f"{side.name.lower()}_{kind.name.lower()}": sum(
            (e.event.side, e.event.kind) == (side, kind) for e in events
        )
        for side in Side
        for kind in EventKind
    }
    detector = events[0].detector
    if options.json:
        result = {"events": str(out), "detector": detector, "counts": counts, "troubles": troubles}
        print(json.dumps(result))
        return 0
    print(f"detector  {detector}")
    print(f"events    {', '.join(f'{n} {what}' for what, n in counts.items())}".replace("_", " "))
    if path.suffix.lower() != ".c3d" and not find_detector(detector).detector.tells_sides:
        print("sides     as named: these signals cannot tell a left foot from a right one")
    for trouble in troubles:
        print(f"trouble   {trouble}")
    print(f"written   {out}")
    return 0


def _chosen(options: argparse.Namespace) -> Iterator[ChosenDetector]:
    """Yield the chosen detector, or those to try in order."""
    return map(find_detector, [options.detector] if options.detector else TRIED)


def _of_table(path: Path, options: argparse.Namespace) -> Found:
    columns = _pairs("column", options.column)
    return detect(*read_streams(path, _chosen(options), columns, options.rate))


def _of_bag(path: Path, options: argparse.Namespace) -> Found:
    return detect(*read_signals(path, _chosen(options)))


def _of_c3d(path: Path, options: argparse.Namespace) -> Found:
    names = _pairs("marker", options.marker)
    if unknown := [name for name in names if name not in MARKERS]:
        raise UsageError(f"--marker: {unknown[0]!r}; allowed: {', '.join(MARKERS)}")
    capture = read_c3d(path, names, plates=options.detector != BY_MARKERS)
    if options.detector == BY_MARKERS or not (capture.plates or options.detector):
        return number(events_of_markers(capture), BY_MARKERS)
    if not capture.plates:
        raise RecordingError(f"{path}: holds no force plate; allowed: --detector {BY_MARKERS}")
    chosen: ChosenDetector = find_detector(options.detector or "vertical_force")
    if chosen.detector.signals != ("force_z",):
        raise UsageError(
            f"--detector: {chosen.name} reads no force plate; allowed: vertical_force, "
            f"{BY_MARKERS}"
        )
    sides = None if options.plates is None else _sides(options.plates)
    found, plate_troubles = events_on_plates(capture, chosen, sides)
    events, troubles = number(found, chosen.name)
    return events, (*plate_troubles, *troubles)


def _sides(text: str) -> list[Side]:
    known = {side.name.lower(): side for side in Side}
    words = text.split(",")
    if unknown := [word for word in words if word not in known]:
        raise UsageError(f"--plates: {unknown[0]!r}; allowed: left, right, separated by commas")
    return [known[word] for word in words]


def _pairs(option: str, given: Sequence[str]) -> dict[str, str]:
    """Return NAME=NAME_IN_FILE of an option as a mapping."""
    pairs = {}
    for text in given:
        for part in split_options(text):
            name, equals, in_file = part.partition("=")
            if not (name and equals and in_file):
                raise UsageError(f"--{option}: {part!r}; allowed: NAME=NAME_IN_FILE")
            pairs[name] = in_file
    return pairs
