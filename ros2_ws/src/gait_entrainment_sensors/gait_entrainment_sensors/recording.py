# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Signals recorded elsewhere: a table with named columns.

A column is named by side and signal, in SI units: ``left_force_z``, ``right_foot_gyro_y``. Another
unit is part of the name: ``right_foot_gyro_y_deg``, ``time [ms]``, ``Left_Force_Z (kN)``.
"""

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from gait_entrainment.conventions import Side
from gait_entrainment.errors import UsageError
from gait_entrainment_sensors.detection import ChosenDetector
from gait_entrainment_sensors.sources import source_of

# Factors to SI units, by the unit of a column: in brackets or at the end of its name, or in a row
# of units.
_UNITS = dict.fromkeys(("", "1", "s", "n", "n m", "nm", "rad", "rad/s"), 1.0)
_UNITS |= {"ms": 1e-3, "us": 1e-6, "\u03bcs": 1e-6, "ns": 1e-9, "kn": 1e3}
_UNITS |= dict.fromkeys(("deg", "deg/s", "\u00b0", "\u00b0/s", "dps"), math.pi / 180)
_MISSING = ("", "n/a", "na", "nan", "null", "none")


class RecordingError(UsageError):
    """A recording cannot be read: one line that names the file and the column or field."""


@dataclass(frozen=True)
class Stream:
    """The samples of one sensor on one foot."""

    side: Side
    times: list[float]  # [s]
    values: list[tuple[float, ...]]  # in the order of the detector's signals


@dataclass(frozen=True)
class Table:
    """The columns of a file."""

    path: Path
    # By name, in lower case and without the unit: the factor to SI units, and the texts.
    columns: dict[str, tuple[float, list[str]]]
    first: int  # row of the file with the first texts

    def require(self, *names: str) -> None:
        """Raise RecordingError if a column is missing."""
        if missing := [name for name in names if name not in self.columns]:
            there = ", ".join(self.columns)
            raise RecordingError(
                f"{self.path}: lacks column {', '.join(missing)}; it has: {there}"
            )

    def refused(self, row: int, name: str, allowed: str) -> RecordingError:
        """Return the error for a text in a column, counted from the first one."""
        text = self.columns[name][1][row]
        return RecordingError(
            f"{self.path}: row {self.first + row}, column {name}: {text!r}; allowed: {allowed}"
        )

    def numbers(self, name: str) -> list[float]:
        """Return a column in SI units; NaN if a field is empty, ``n/a`` or the like."""
        self.require(name)
        factor, texts = self.columns[name]
        numbers = []
        for row, text in enumerate(texts):
            if (number := _number(text)) is None:
                raise self.refused(row, name, "a number, or nothing if a sample is missing")
            numbers.append(factor * number)
        return numbers


def _number(text: str) -> float | None:
    """Return the number in a field, with a point or a comma; NaN if missing, None if invalid."""
    if text.strip().lower() in _MISSING:
        return math.nan
    try:
        return float(text if "." in text else text.replace(",", ".", 1))
    except ValueError:
        return None


def _plain(name: str, unit: str = "") -> tuple[str, float]:
    """Return the name of a column as in `Table`, and the factor of its unit."""
    name = name.strip("# \t").casefold()
    for pattern in (r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", r"(.*)_([a-z]+)"):
        found = re.fullmatch(pattern, name)
        if found and found[2] in _UNITS:
            name, unit = found[1], unit or found[2]
    return name, _UNITS[unit]


def _names(head: list[list[str]]) -> list[tuple[str, float]]:
    """Return names and factors from the header rows: names, perhaps with units below."""
    *above, names = head
    units = [field.strip("[() ]").casefold() for field in names]
    if above and _UNITS.keys() >= {*units}:
        *above, names = above
    else:
        units = [""] * len(names)
    while above and len({*names}) < len(names):  # such as axes below the names of sensors
        names = [f"{a} {b}".strip() for a, b in zip(above.pop(), names, strict=True)]
    return [*map(_plain, names, units)]


def read_table(path: Path, separators: str = "\t;,") -> Table:
    """
    Return the columns of a table that is separated by tabs, semicolons or commas.

    The names may take several rows, and the units one row below; anything before is skipped.
    Raises RecordingError if it cannot be read, is empty, or a row has too many or too few fields.
    """
    try:
        data = path.read_bytes()
        wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
        text = data.decode("utf-16" if wide else "utf-8-sig")
        lines = text.rstrip("\r\n ").splitlines()
        # The comma comes last: it may be a decimal comma.
        separator = max(separators, key=lambda sign: sum(sign in line for line in lines))
        rows = [*enumerate(csv.reader(lines, delimiter=separator), 1)]
    except csv.Error as error:  # such as an enormous cell
        raise RecordingError(f"{path}: cannot be read: {error}") from None
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise RecordingError(f"{path}: cannot be read: {reason}") from None
    width = Counter(len(row) or 1 for _, row in rows).most_common(1)[0][0] if rows else 0
    # In a table of one column an empty line is an empty field.
    rows = [(number, row or [""]) for number, row in rows if row or width == 1]
    if len(rows) < 2:
        raise RecordingError(f"{path}: has no rows; expected: names of columns, then rows")
    begin = next((i for i, (_, row) in enumerate(rows) if _is_data(row, width)), 1)
    head = begin
    while head > 0 and len(rows[head - 1][1]) == width:
        head -= 1
    if head == begin and separator == ",":  # it is a decimal comma
        return read_table(path, "\t;")
    if head == begin:
        raise RecordingError(f"{path}: row {rows[begin][0]} has no names above it")
    plain = _names([row for _, row in rows[head:begin]])
    names = [name for name, _ in plain]
    if twice := [name for name in names if names.count(name) > 1]:
        raise RecordingError(f"{path}: column {twice[0]} appears twice; keep one")
    for number, row in rows[begin:]:
        if len(row) != len(names):
            raise RecordingError(
                f"{path}: row {number} has {len(row)} fields; expected: {len(names)}"
            )
    texts = zip(*(row for _, row in rows[begin:]), strict=True)
    columns = {n: (factor, [*column]) for (n, factor), column in zip(plain, texts, strict=True)}
    return Table(path, columns, rows[begin][0])


def _is_data(row: Sequence[str], width: int) -> bool:
    """Whether a row contains numbers, and as many fields as the others."""
    return len(row) == width and any(f.strip() and _number(f) is not None for f in row)


def read_streams(
    path: Path,
    detectors: Iterable[ChosenDetector],
    columns: Mapping[str, str] | None = None,
    rate: float | None = None,
) -> tuple[ChosenDetector, list[Stream]]:
    """
    Return the first detector that fits a table, and the stream of each foot.

    ``columns`` maps names to columns of the file; ``rate`` [Hz] replaces a column ``time`` [s].
    Raises RecordingError if the file cannot be read or columns are missing.
    """
    table = read_table(path)
    there = ", ".join(table.columns)
    for name, column in (columns or {}).items():
        if (found := table.columns.get(_plain(column)[0])) is None:
            raise RecordingError(
                f"{path}: has no column {column} to use as {name}; it has: {there}"
            )
        meant, factor = _plain(name)
        table.columns[meant] = (factor * found[0], found[1])
    times = _times(table, rate)
    needed = []
    for chosen in detectors:
        signals = chosen.detector.signals
        names = [source_of(chosen.name, signals).column + signal for signal in signals]
        streams = [
            Stream(side, times, values)
            for side in Side
            if (values := _values(table, side, names)) is not None
        ]
        if streams:
            _check_steps(path, times, chosen.settings.longest_gap)
            return chosen, streams
        needed.append(" and ".join(f"SIDE_{name}" for name in names))
    raise RecordingError(
        f"{path}: lacks columns {' or '.join(needed)} (see --column); it has: {there}"
    )


def _times(table: Table, rate: float | None) -> list[float]:
    if rate is not None:
        count = len(next(iter(table.columns.values()))[1])
        return [number / rate for number in range(count)]
    if "time" not in table.columns:
        raise RecordingError(
            f"{table.path}: lacks the column time [s]: name it with --column time=NAME, or give "
            f"--rate; it has: {', '.join(table.columns)}"
        )
    return table.numbers("time")


def _check_steps(path: Path, times: Sequence[float], longest: float) -> None:
    """Raise RecordingError if times are further apart [s] than samples of a walk may be."""
    steps = sorted(b - a for a, b in pairwise(times) if b > a)
    if steps and (usual := steps[len(steps) // 2]) > 0.99 * longest:
        raise RecordingError(
            f"{path}: column time, or --rate: samples are {usual:g} s apart; allowed: less than "
            f"longest_gap, {longest:g} s; name a column in another unit, as in time_ms"
        )


def _values(table: Table, side: Side, signals: Sequence[str]) -> list[tuple[float, ...]] | None:
    """Return the samples of one foot; None if it has no columns."""
    names = [f"{side.name.lower()}_{signal}" for signal in signals]
    found = [name for name in names if name in table.columns]
    if not found:
        return None
    # Without a robot there is no torque.
    table.require(*(name for name in names if not name.endswith("ankle_torque")))
    columns = [table.numbers(name) for name in found]
    return list(zip(*columns, *[[0.0] * len(columns[0])] * (len(names) - len(found)), strict=True))
