# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Motion capture recordings: C3D files with force plates and markers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import ChosenDetector, Detection
from gait_entrainment_sensors.recording import RecordingError

Floats = NDArray[np.float64]

# Names of markers in the usual sets, in capitals and without separators, by their name here; if
# there are several, their mean is used.
_HEEL = ("HEE", "HEEL", "CAL", "CALC", "FCC")
_TOE = ("TOE", "MT1", "MT2", "MT5", "MTH2", "FM1", "FM2", "FM5")
_PELVIS = ("SACR", "SACRUM", "VSAC", "LPSI", "RPSI", "LPSIS", "RPSIS", "LIPS", "RIPS")
MARKERS: dict[str, tuple[str, ...]] = {
    f"{side.name.lower()}_{what}": tuple(side.name[0] + name for name in names)
    for side in Side
    for what, names in (("heel", _HEEL), ("toe", _TOE))
} | {"pelvis": _PELVIS}
# A foot whose middle is further from the centre of pressure does not press there [m].
_REACH = 0.25
# A swinging foot is faster than this, even in slow walking [m/s].
_STANDING = 0.3
# Standard deviation of events from markers: 94 % were within 16.7 ms (Zeni 2008) [s].
_MARKER_UNCERTAINTY = 0.009
# Least travel of a foot relative to the pelvis in a step [m], and least stride period [s].
_LEAST_TRAVEL, _LEAST_STRIDE = 0.1, 0.4


@dataclass(frozen=True)
class Plate:
    """A force plate: samples in the axes of the laboratory."""

    times: Floats  # (n,) [s]
    force: Floats  # (n,) vertical, upwards positive [N]
    pressure: Floats  # (n, 3) centre of pressure [m]
    low: Floats  # (3,) corner of the plate's bounding box [m]
    high: Floats  # (3,)


@dataclass(frozen=True)
class MotionCapture:
    """The contents of a C3D file from which gait events follow."""

    path: Path
    plates: tuple[Plate, ...]
    times: Floats  # (m,) of the markers [s]
    markers: dict[str, Floats]  # those of `MARKERS` that are there: (m, 3) [m]; NaN if hidden
    up: int  # the vertical axis


def read_c3d(
    path: Path, names: Mapping[str, str] | None = None, *, plates: bool = True
) -> MotionCapture:
    """
    Read a C3D file; times count from the first frame in it.

    ``names`` maps left_heel, right_toe, ..., pelvis to markers of the file; ``plates`` is whether
    to read its force plates. Raises RecordingError if it is not a C3D file, is empty, or lacks a
    marker in ``names``.
    """
    import ezc3d  # not at the top: it takes a quarter of a second to load

    try:
        file = ezc3d.c3d(str(path), extract_forceplat_data=plates)
    except (OSError, RuntimeError, ValueError, IndexError) as error:
        reason = str(error).partition("\n")[0].partition(", please")[0]  # without ezc3d's request
        raise RecordingError(f"{path}: cannot be read as C3D: {reason}") from None
    # Some systems prefix each with the subject's name and a colon.
    labels = [label.rpartition(":")[2] for label in file["parameters"]["POINT"]["LABELS"]["value"]]
    plain = [re.sub(r"[\W_]|(?<=^L)EFT|(?<=^R)IGHT", "", label.upper()) for label in labels]
    unit = _unit(path, file["parameters"]["POINT"].get("UNITS", {"value": ["mm"]})["value"])
    points = np.moveaxis(np.asarray(file["data"]["points"][:3], float), 0, -1) * unit
    points[~points.any(axis=-1)] = np.nan  # hidden, as some systems write it
    seen = np.any(np.isfinite(points).all(axis=-1), axis=-1).tolist()
    rate = float(file["header"]["points"]["frame_rate"])
    if not rate:
        raise RecordingError(f"{path}: has no frames")
    markers = {}
    for what, usual in MARKERS.items():
        wanted, known = usual, plain
        if names and what in names:
            wanted, known = (names[what],), labels
        found = [known.index(name) for name in wanted if name in known]
        if found := [place for place in found if seen[place]]:
            markers[what] = np.mean(points[found], axis=0)
        elif names and what in names:
            raise RecordingError(
                f"{path}: has no marker {names[what]} to use as {what}; it has: "
                f"{', '.join(labels) or 'none'}"
            )
    # Plates may be without samples, as in a file of a standing trial.
    platforms = [p for p in file["data"].get("platform", []) if np.size(p["force"])]
    up = _vertical(platforms)
    analog = float(file["header"]["analogs"]["frame_rate"])
    found_plates = tuple(_plate(path, platform, analog, up) for platform in platforms)
    return MotionCapture(path, found_plates, np.arange(points.shape[1]) / rate, markers, up)


def _unit(path: Path, units: Sequence[str]) -> float:
    """Return the length [m] of a unit."""
    known = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
    name = str(units[0] if units else "mm").strip().lower() or "mm"
    if name.startswith("met"):  # ezc3d keeps four letters
        name = "m"
    if name not in known:
        raise RecordingError(f"{path}: POINT:UNITS: {name!r}; allowed: {', '.join(known)}")
    return known[name]


def _vertical(platforms: Sequence[Mapping[str, Any]]) -> int:
    """Return the axis normal to the plates; z without plates."""
    for platform in platforms:
        sides = np.diff(platform["corners"], axis=1)
        normal = np.cross(sides[:, 0], sides[:, 1])
        if np.any(normal):
            return int(np.argmax(np.abs(normal)))
    return 2


def _plate(path: Path, platform: Mapping[str, Any], rate: float, up: int) -> Plate:
    """Return a plate whose force was sampled at a rate [Hz]."""
    force = np.asarray(platform["force"][up], float)
    unit = _unit(path, [str(platform.get("unit_position", "mm"))])
    corners = np.asarray(platform["corners"], float) * unit
    pressure = np.asarray(platform["center_of_pressure"], float).T * unit
    times = np.arange(force.size) / rate
    return Plate(times, force, pressure, corners.min(axis=1), corners.max(axis=1))


def events_on_plates(
    capture: MotionCapture, chosen: ChosenDetector, sides: Sequence[Side] | None = None
) -> tuple[list[Detection], tuple[str, ...]]:
    """
    Return the events on the plates, and any troubles.

    A contact belongs to the foot whose middle, between heel and toe, is next to the centre of
    pressure. If both feet are on the plate or neither is near, it belongs to no foot and is
    reported. ``sides`` instead gives the foot of each plate, as for a treadmill with two belts.
    Raises RecordingError if the feet cannot be determined.
    """
    troubles: list[str] = []
    found: list[Detection] = []
    feet = [_markers_of(capture, side) for side in Side]
    if sides is None and not all(feet):
        missing = [name for name in MARKERS if name not in capture.markers and name != "pelvis"]
        raise RecordingError(
            f"{capture.path}: which foot is on which plate is unknown: it lacks markers "
            f"{', '.join(missing)}; name them with --marker, or the feet with --plates"
        )
    if sides is not None and len(sides) != len(capture.plates):
        raise RecordingError(
            f"{capture.path}: holds {len(capture.plates)} plates; --plates names {len(sides)}"
        )
    contacts: list[list[Detection]] = []
    for index, plate in enumerate(capture.plates):
        if not np.any(plate.high - plate.low):
            raise RecordingError(
                f"{capture.path}: FORCE_PLATFORM:CORNERS of plate {index + 1} are one point: its "
                "axes, and so its vertical force, are unknown; enter its corners"
            )
        samples = [*zip(plate.times.tolist(), plate.force[:, np.newaxis].tolist(), strict=True)]
        settings = chosen.detector.calibrated(chosen.settings, samples)
        detector = chosen.detector(Side.LEFT if sides is None else sides[index], settings)
        events = [event for t, v in samples for event in detector.add(t, v)]
        if sides is not None:
            found += events
            troubles += detector.troubles()
            continue
        ours, doubtful = _of_their_feet(capture, plate, events)
        contacts += ours
        if doubtful:
            troubles.append(f"plate {index + 1}: {doubtful} contacts of both feet or of neither")
        if not events:
            low, high = float(np.min(plate.force)), float(np.max(plate.force))
            troubles.append(f"plate {index + 1}: no contact: forces of {low:.0f} to {high:.0f} N")
    return found + _merged(contacts), tuple(troubles)


def _of_their_feet(
    capture: MotionCapture, plate: Plate, events: Sequence[Detection]
) -> tuple[list[list[Detection]], int]:
    """Return a plate's contacts with their sides, and how many belong to no foot."""
    contacts: list[list[Detection]] = []
    for event in events:
        if event.kind is EventKind.HEEL_STRIKE or not contacts:
            contacts.append([event])
        else:
            contacts[-1].append(event)
    found, doubtful = [], 0
    for contact in contacts:
        start, end = contact[0].time, contact[-1].time
        if contact[0].kind is EventKind.TOE_OFF:
            start = max(end - 0.3, 0.0)
        elif len(contact) == 1:
            end = min(start + 0.3, float(plate.times[-1]))
        side = _whose(capture, plate, start, end)
        doubtful += side is None
        found += [] if side is None else [[replace(event, side=side) for event in contact]]
    return found, doubtful


def _merged(contacts: Sequence[Sequence[Detection]]) -> list[Detection]:
    """Return the events of contacts; for a foot on two plates at once, the first and last."""
    found: list[Detection] = []
    for side in Side:
        own = sorted((list(c) for c in contacts if c[0].side is side), key=lambda c: c[0].time)
        for before, after in pairwise(own):
            if after[0].time < before[-1].time:  # on both plates at once
                after[:] = [before[0], max(before[-1], after[-1], key=lambda e: e.time)]
                before.clear()
        found += [event for contact in own for event in contact]
    return found


def _markers_of(capture: MotionCapture, side: Side) -> list[Floats]:
    """Return the available markers of a foot, (m, 3) [m] each."""
    names = (f"{side.name.lower()}_{what}" for what in ("heel", "toe"))
    return [capture.markers[name] for name in names if name in capture.markers]


def _whose(capture: MotionCapture, plate: Plate, start: float, end: float) -> Side | None:
    """Return the foot that presses on a plate between two times [s]; None if doubtful."""
    across = [axis for axis in range(3) if axis != capture.up]
    during = (capture.times >= start) & (capture.times <= end)
    if not during.any():
        return None
    times = capture.times[during]
    pressure = np.stack([np.interp(times, plate.times, p) for p in plate.pressure.T[across]], 1)
    away, stands = [], []
    for side in Side:
        foot = np.array(_markers_of(capture, side))  # (markers, m, 3)
        speed = np.linalg.norm(np.gradient(foot, capture.times, axis=1), axis=-1)[:, during]
        points = foot[:, during][..., across]
        inside = (points > plate.low[across]) & (points < plate.high[across])
        # A marker that is hidden neither stands nor is near.
        stands.append(np.mean(np.any((speed < _STANDING) & inside.all(axis=-1), axis=0)))
        distance = np.linalg.norm(points - pressure, axis=-1)
        distance = distance[np.isfinite(distance)]
        away.append(float(np.median(distance)) if distance.size else np.inf)
    side = Side(int(np.argmin(away)))
    both = stands[side.other] > 0.2
    return None if both or away[side] > _REACH else side


def events_of_markers(capture: MotionCapture) -> list[Detection]:
    """
    Return events from the positions of heel and toe relative to the pelvis, for a whole recording.

    Heel strike is when the heel is furthest ahead, toe-off when the toe is furthest behind
    (Zeni, Richards and Higginson, Gait Posture 27, 710, 2008): within 16.7 ms in 94 % of
    strides. Not causal. Hidden markers are interpolated.
    Raises RecordingError if a marker is missing.
    """
    from scipy.signal import find_peaks

    if missing := [name for name in MARKERS if name not in capture.markers]:
        raise RecordingError(
            f"{capture.path}: lacks markers {', '.join(missing)}; name them with --marker"
        )
    seen = {name: _without_gaps(points) for name, points in capture.markers.items()}
    # The direction of the feet at each time: people turn round.
    feet = np.mean([seen[f"{s}_toe"] - seen[f"{s}_heel"] for s in ("left", "right")], axis=0)
    feet[:, capture.up] = 0.0
    forward = feet / np.maximum(np.linalg.norm(feet, axis=1, keepdims=True), 1e-9)
    end = float(capture.times[-1])
    step = end / max(len(capture.times) - 1, 1) or 1.0
    found = []
    for side in Side:
        leg = side.name.lower()
        for kind, marker, sign in (
            (EventKind.HEEL_STRIKE, "heel", 1.0),
            (EventKind.TOE_OFF, "toe", -1.0),
        ):
            away = seen[f"{leg}_{marker}"] - seen["pelvis"]
            ahead = sign * np.sum(away * forward, axis=1)
            peaks, _ = find_peaks(
                ahead, prominence=_LEAST_TRAVEL, distance=max(_LEAST_STRIDE / step, 1)
            )
            times = capture.times[peaks].tolist()
            found += [Detection(kind, side, t, end, _MARKER_UNCERTAINTY) for t in times]
    return found


def _without_gaps(points: Floats) -> Floats:
    """Interpolate (m, 3) positions where the marker is hidden."""
    there = np.isfinite(points).all(axis=1)
    if not there.any():
        return np.zeros_like(points)
    number = np.arange(len(points))
    columns = [np.interp(number, number[there], column[there]) for column in points.T]
    return np.stack(columns, axis=1)
