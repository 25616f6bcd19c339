# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Signals that were recorded elsewhere: a table with named columns.

A column is named by side and signal, in SI units: ``left_force_z``, ``right_foot_gyro_y``. One in
degrees, or degrees per second, says so: ``right_foot_gyro_y_deg``.
"""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gait_entrainment.conventions import Side
from gait_entrainment.errors import UsageError
from gait_entrainment_sensors.detection import ChosenDetector
from gait_entrainment_sensors.sources import source_of

IN_DEGREES = "_deg"


class RecordingError(UsageError):
    """What of a recording cannot be read: one line that names file and column or field."""


@dataclass(frozen=True)
class Stream:
    """The samples of one sensor on one foot."""

    side: Side
    times: list[float]  # [s]
    values: list[tuple[float, ...]]  # in the order of the detector's signals


def read_table(path: Path) -> dict[str, list[str]]:
    """
    Return the columns of a table, texts by their names; tab, semicolon or comma separates.

    Raises RecordingError if it cannot be read, is empty, or a row has too many or too few fields.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is no text"
        raise RecordingError(f"{path}: cannot be read: {reason}") from None
    head = text.partition("\n")[0]
    separator = max("\t;,", key=head.count)
    rows = [row for row in csv.reader(text.splitlines(), delimiter=separator) if row]
    if len(rows) < 2:
        raise RecordingError(f"{path}: holds no row; expected: names of columns, then rows")
    names = [name.strip() for name in rows[0]]
    if twice := [name for name in names if names.count(name) > 1]:
        raise RecordingError(f"{path}: column {twice[0]} appears twice; keep one")
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            raise RecordingError(
                f"{path}: row {number} has {len(row)} fields; expected: {len(names)}"
            )
    return dict(zip(names, map(list, zip(*rows[1:], strict=True)), strict=True))


def column_numbers(path: Path, name: str, texts: Sequence[str]) -> list[float]:
    """Return a column's numbers; NaN where a field is empty, ``n/a`` or says so."""
    numbers = []
    for row, text in enumerate(texts, 2):
        try:
            numbers.append(float(text) if text.strip() not in ("", "n/a") else math.nan)
        except ValueError:
            raise RecordingError(
                f"{path}: row {row}, column {name}: {text!r}; allowed: a number, or nothing where "
                "a sample is missing"
            ) from None
    return numbers


def read_streams(
    path: Path,
    detectors: Iterable[ChosenDetector],
    columns: Mapping[str, str] | None = None,
    rate: float | None = None,
) -> tuple[ChosenDetector, list[Stream]]:
    """
    Return the first of some detectors that fits a table, and what it reads of each foot.

    ``columns`` says which column of the file is meant by a name; ``rate`` [Hz] stands for a
    column ``time`` [s].
    Raises RecordingError if the file cannot be read or columns are missing.
    """
    table = read_table(path)
    for name, column in (columns or {}).items():
        if column not in table:
            raise RecordingError(
                f"{path}: has no column {column}, which is to be {name}; it has: "
                f"{', '.join(table)}"
            )
        table[name] = table[column]
    times = _times(path, table, rate)
    needed = []
    for chosen in detectors:
        signals = chosen.detector.signals
        names = [source_of(chosen.name, signals).column + signal for signal in signals]
        streams = [
            Stream(side, times, values)
            for side in Side
            if (values := _values(path, table, side, names)) is not None
        ]
        if streams:
            return chosen, streams
        needed.append(" and ".join(f"SIDE_{name}" for name in names))
    raise RecordingError(
        f"{path}: lacks columns {' or '.join(needed)}, or --column; it has: {', '.join(table)}"
    )


def _times(path: Path, table: Mapping[str, list[str]], rate: float | None) -> list[float]:
    if rate is not None:
        count = len(next(iter(table.values())))
        return [number / rate for number in range(count)]
    if "time" not in table:
        raise RecordingError(
            f"{path}: lacks the column time [s]: name it with --column time=NAME, or say --rate; "
            f"it has: {', '.join(table)}"
        )
    return column_numbers(path, "time", table["time"])


def _values(
    path: Path, table: Mapping[str, list[str]], side: Side, signals: Sequence[str]
) -> list[tuple[float, ...]] | None:
    """Return the samples of one foot; None if nothing of it is there."""
    leg = side.name.lower()
    found, missing = [], []
    for signal in signals:
        name = f"{leg}_{signal}"
        if name in table:
            found.append(column_numbers(path, name, table[name]))
        elif (name := name + IN_DEGREES) in table:
            found.append([math.radians(v) for v in column_numbers(path, name, table[name])])
        elif signal == "ankle_torque" and found:  # nobody wore a robot
            found.append([0.0] * len(found[0]))
        else:
            missing.append(f"{leg}_{signal}")
    if missing and found:
        raise RecordingError(f"{path}: lacks column {', '.join(missing)}")
    return None if missing else list(zip(*found, strict=True))
