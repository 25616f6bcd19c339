# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings of a motion laboratory: C3D files with force plates and markers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import ChosenDetector, Detection
from gait_entrainment_sensors.recording import RecordingError

Floats = NDArray[np.float64]

# Names of markers in the usual sets, by what they are here; the pelvis is the mean of those there.
MARKERS: dict[str, tuple[str, ...]] = {
    "left_heel": ("LHEE", "L_HEE", "LCAL", "L_FCC", "LFCC", "LHEEL"),
    "right_heel": ("RHEE", "R_HEE", "RCAL", "R_FCC", "RFCC", "RHEEL"),
    "left_toe": ("LTOE", "L_TOE", "LMT2", "LFM2", "L_FM2"),
    "right_toe": ("RTOE", "R_TOE", "RMT2", "RFM2", "R_FM2"),
    "pelvis": ("SACR", "SACRUM", "LPSI", "RPSI", "LPSIS", "RPSIS", "L_IPS", "R_IPS"),
}
# A foot whose middle is further from the centre of pressure does not press there [m].
_REACH = 0.25
# Standard deviation of events from markers: 94 % were within 16.7 ms (Zeni 2008) [s].
_MARKER_UNCERTAINTY = 0.009
# What a foot travels at least, relative to the pelvis, in a step [m]; and for how long [s].
_LEAST_TRAVEL, _LEAST_STRIDE = 0.1, 0.4
# How high a foot on the ground holds its markers above their lowest [m].
_LOW = 0.05


@dataclass(frozen=True)
class Plate:
    """A force plate: samples in the axes of the laboratory."""

    times: Floats  # (n,) [s]
    force: Floats  # (n,) vertical, upwards positive [N]
    pressure: Floats  # (n, 3) centre of pressure [m]
    low: Floats  # (3,) corner of the box that holds the plate [m]
    high: Floats  # (3,)


@dataclass(frozen=True)
class MotionCapture:
    """What a C3D file holds that tells gait events."""

    path: Path
    plates: tuple[Plate, ...]
    times: Floats  # (m,) of the markers [s]
    markers: dict[str, Floats]  # those of `MARKERS` that are there: (m, 3) [m]; NaN if hidden
    up: int  # the vertical axis


def read_c3d(
    path: Path, names: Mapping[str, str] | None = None, *, plates: bool = True
) -> MotionCapture:
    """
    Read a C3D file.

    ``names`` says which of its markers is left_heel, right_toe, ..., pelvis; ``plates`` whether
    its force plates are wanted.
    The sign of vertical forces is taken such that feet press the plates down.
    Raises RecordingError if it is none, or lacks a marker that is named.
    """
    import ezc3d  # for this alone: it takes a quarter of a second to load

    try:
        file = ezc3d.c3d(str(path), extract_forceplat_data=plates)
    except (OSError, RuntimeError, ValueError, IndexError) as error:
        reason = str(error).partition("\n")[0]
        raise RecordingError(f"{path}: cannot be read as C3D: {reason}") from None
    # Some systems put the subject's name and a colon before each.
    labels = [label.rpartition(":")[2] for label in file["parameters"]["POINT"]["LABELS"]["value"]]
    unit = _unit(path, file["parameters"]["POINT"].get("UNITS", {"value": ["mm"]})["value"])
    points = np.moveaxis(np.asarray(file["data"]["points"][:3], float), 0, -1) * unit
    rate = float(file["header"]["points"]["frame_rate"])
    markers = {}
    for what, usual in MARKERS.items():
        wanted = (names[what],) if names and what in names else usual
        found = [points[labels.index(name)] for name in wanted if name in labels]
        if found:
            markers[what] = np.mean(found, axis=0)
        elif names and what in names:
            raise RecordingError(
                f"{path}: has no marker {names[what]}, which is to be {what}; it has: "
                f"{', '.join(labels) or 'none'}"
            )
    platforms = file["data"].get("platform", [])
    up = _vertical(platforms)
    analog = float(file["header"]["analogs"]["frame_rate"])
    found_plates = tuple(_plate(path, platform, analog, up) for platform in platforms)
    return MotionCapture(path, found_plates, np.arange(points.shape[1]) / rate, markers, up)


def _unit(path: Path, units: Sequence[str]) -> float:
    """Return the length [m] of a unit."""
    known = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
    if (name := str(units[0] if units else "mm").strip().lower()) not in known:
        raise RecordingError(f"{path}: POINT:UNITS: {name!r}; allowed: {', '.join(known)}")
    return known[name]


def _vertical(platforms: Sequence[Mapping[str, Any]]) -> int:
    """Return the axis that plates lie across; z without plates."""
    for platform in platforms:
        sides = np.diff(platform["corners"], axis=1)
        normal = np.cross(sides[:, 0], sides[:, 1])
        if np.any(normal):
            return int(np.argmax(np.abs(normal)))
    return 2


def _plate(path: Path, platform: Mapping[str, Any], rate: float, up: int) -> Plate:
    """Return a plate whose force was sampled at a rate [Hz]."""
    force = np.asarray(platform["force"][up], float)
    loaded = force[np.abs(force) > 0.5 * np.max(np.abs(force), initial=0.0)]
    if loaded.size and np.median(loaded) < 0.0:
        force = -force
    unit = _unit(path, [str(platform.get("unit_position", "mm"))])
    corners = np.asarray(platform["corners"], float) * unit
    pressure = np.asarray(platform["center_of_pressure"], float).T * unit
    times = np.arange(force.size) / rate
    return Plate(times, force, pressure, corners.min(axis=1), corners.max(axis=1))


def events_on_plates(
    capture: MotionCapture, chosen: ChosenDetector, sides: Sequence[Side] | None = None
) -> tuple[list[Detection], tuple[str, ...]]:
    """
    Return the events on the plates, and what was wrong.

    A contact is the foot's whose middle, between heel and toe, is next to the centre of pressure;
    none's, and told, if both feet are on the plate or neither is near. ``sides`` says instead
    whose each plate is, as of a treadmill with two belts.
    Raises RecordingError if nothing tells whose the contacts are.
    """
    told: list[str] = []
    found: list[Detection] = []
    wanted = ("left_heel", "left_toe", "right_heel", "right_toe")
    missing = [name for name in wanted if name not in capture.markers]
    if sides is None and missing:
        raise RecordingError(
            f"{capture.path}: nothing tells whose foot is on which plate: it lacks markers "
            f"{', '.join(missing)}; name them with --marker, or the feet with --plates"
        )
    if sides is not None and len(sides) != len(capture.plates):
        raise RecordingError(
            f"{capture.path}: holds {len(capture.plates)} plates; --plates names {len(sides)}"
        )
    for index, plate in enumerate(capture.plates):
        detector = chosen.detector(Side.LEFT if sides is None else sides[index], chosen.settings)
        events: list[Detection] = []
        for time, force in zip(plate.times.tolist(), plate.force.tolist(), strict=True):
            events += detector.add(time, (force,))
        if sides is None:
            events, doubtful = _of_their_feet(capture, plate, events)
            if doubtful:
                told.append(f"plate {index + 1}: {doubtful} contacts of both feet or of neither")
        else:
            told += detector.troubles()
        found += events
    return found, tuple(told)


def _of_their_feet(
    capture: MotionCapture, plate: Plate, events: Sequence[Detection]
) -> tuple[list[Detection], int]:
    """Return a plate's events with the side of the foot, and how many contacts were nobody's."""
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
        found += [] if side is None else [replace(event, side=side) for event in contact]
    return found, doubtful


def _whose(capture: MotionCapture, plate: Plate, start: float, end: float) -> Side | None:
    """Return the foot that presses on a plate between two instants [s]; None if doubtful."""
    across = [axis for axis in range(3) if axis != capture.up]
    during = (capture.times >= start) & (capture.times <= end)
    middle = np.argmin(np.abs(plate.times - 0.5 * (start + end)))
    near: list[Side] = []
    for side in Side:
        leg = side.name.lower()
        heel, toe = capture.markers[f"{leg}_heel"], capture.markers[f"{leg}_toe"]
        centre = 0.5 * (heel + toe)
        at = np.argmin(np.abs(capture.times - plate.times[middle]))
        away = np.linalg.norm((centre[at] - plate.pressure[middle])[across])
        height = np.minimum(heel[:, capture.up], toe[:, capture.up])
        low = height < np.nanmin(height) + _LOW
        inside = np.all((centre > plate.low)[:, across] & (centre < plate.high)[:, across], axis=1)
        if (low[at] and away <= _REACH) or np.mean((low & inside)[during]) > 0.2:
            near.append(side)
    return near[0] if len(near) == 1 else None


def events_of_markers(capture: MotionCapture) -> list[Detection]:
    """
    Return events by the position of heel and toe relative to the pelvis, for the whole recording.

    Heel strike is where the heel is furthest ahead, toe-off where the toe is furthest behind
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
    foot = np.mean([seen[f"{s}_toe"] - seen[f"{s}_heel"] for s in ("left", "right")], axis=(0, 1))
    foot[capture.up] = 0.0
    forward = foot / max(np.linalg.norm(foot), 1e-9)
    end = float(capture.times[-1])
    step = float(capture.times[1])
    found = []
    for side in Side:
        leg = side.name.lower()
        for kind, marker, sign in (
            (EventKind.HEEL_STRIKE, "heel", 1.0),
            (EventKind.TOE_OFF, "toe", -1.0),
        ):
            ahead = sign * (seen[f"{leg}_{marker}"] - seen["pelvis"]) @ forward
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
