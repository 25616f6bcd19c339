# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Public gait recordings, which lie next to the repository and are not part of it."""

import csv
import itertools
import math
import random
from pathlib import Path

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import Detection
from gait_entrainment_sensors.recording import Stream

DATA = Path(__file__).parents[5] / "shared" / "data"
IMU_RATE = 204.8  # Hz, of the sample and of the indices of its reference


def needed(path):
    if not path.exists():
        pytest.skip(f"public data not found: {path}")
    return path


def foot_rates():
    """Return the rates of both feet of gaitmap's sample [rad/s], x, y, z."""
    with needed(DATA / "gaitmap" / "imu_sample.csv").open() as file:
        sensors, axes, *rows = csv.reader(file)
    streams = []
    for side in Side:
        sensor = f"{side.name.lower()}_sensor"
        columns = [
            column
            for axis in "xyz"
            for column, (s, a) in enumerate(zip(sensors, axes, strict=True))
            if (s, a) == (sensor, f"gyr_{axis}")
        ]
        times = [int(row[0]) / IMU_RATE for row in rows]
        values = [tuple(math.radians(float(row[c])) for c in columns) for row in rows]
        streams.append(Stream(side, times, values))
    return streams


def foot_reference():
    """Return the events of that walk in motion capture: (kind, side) -> times [s]."""
    with needed(DATA / "gaitmap" / "stride_events_sample.csv").open() as file:
        rows = list(csv.DictReader(file))
    kinds = {EventKind.HEEL_STRIKE: ("ic", "pre_ic"), EventKind.TOE_OFF: ("tc",)}
    return {
        (kind, side): sorted(
            {float(r[c]) / IMU_RATE for r in rows for c in columns if r["foot"] == leg}
        )
        for kind, columns in kinds.items()
        for side, leg in ((side, side.name.lower()) for side in Side)
    }


def belt():
    """Return times [s] and vertical force [N] of one belt, with 46 strikes."""
    path = needed(DATA / "gaitanalysistoolkit" / "example_vertical_grf.csv")
    with path.open() as file:
        return [(float(time), (float(force),)) for time, force in csv.reader(file)]


def children():
    """
    Return events of both feet from the stride periods of 50 children, with every tenth lost.

    The record holds one foot's strides. The other foot's strikes are placed halfway between its
    strikes, and toe-offs an eighth of a stride after the other foot's strike.
    """
    found = []
    for path in sorted(needed(DATA / "gait_maturation").glob("*-*.txt")):
        generator, events = random.Random(1), []
        strikes = [
            float(line.split()[0]) for line in path.read_text().splitlines() if line.strip()
        ]
        for start, end in itertools.pairwise(strikes):
            for kind, side, share in (
                (EventKind.HEEL_STRIKE, Side.RIGHT, 0.0),
                (EventKind.TOE_OFF, Side.LEFT, 0.125),
                (EventKind.HEEL_STRIKE, Side.LEFT, 0.5),
                (EventKind.TOE_OFF, Side.RIGHT, 0.625),
            ):
                time = start + share * (end - start)
                if len(events) < 12 or generator.random() > 0.1:
                    events.append(Detection(kind, side, time, time + 0.02, 0.0))
        found.append(events)
    return found
