# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Tidy tables of runs, for statistics software: one row per event, stride, pulse or block.

Each row starts with person, session and block. A table is written as TSV with a JSON sidecar of
each column's meaning and unit, as in BIDS, or as Parquet with these in the columns' metadata.
"""

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.gait import Stride, Verdict
from gait_entrainment.robot import PulseTiming
from gait_entrainment_bags import BagError
from gait_entrainment_commands.timing import late_ms
from gait_entrainment_sessions.findings import Findings
from gait_entrainment_sessions.runs import PlacedRun

FORMATS = ("tsv", "parquet")
Row = tuple[Any, ...]  # one cell per column; NaN and None are n/a


@dataclass(frozen=True)
class Column:
    """A column: its name, meaning and unit, and the words that it may hold."""

    name: str
    meaning: str
    unit: str = ""
    words: Sequence[str] = ()


_SIDES = tuple(side.name.lower() for side in Side)
_PLACE = (
    Column("person", "code of the person"),
    Column("session", "label of the session"),
    Column("block", "number of the block in the session, from 1"),
    Column("name", "name of the block; only its number while the session is blinded"),
)
_BLOCK = Column("part", "block of the protocol, if it has several")
_FROM_START = "since the first heel strike of the perturbed leg"
TABLES: dict[str, tuple[Column, ...]] = {
    "events": (
        Column("onset", f"time {_FROM_START}", "s"),
        Column("duration", "duration of the event", "s"),
        Column("trial_type", "kind of event", words=("heel_strike", "toe_off", "pulse")),
        Column("side", "leg", words=_SIDES),
        Column("number", "step of a gait event, or number of a pulse"),
    ),
    "strides": (
        Column("stride", "number of the stride of the perturbed leg, from 1"),
        Column("part", "part of its block", words=("baseline", "pulses", "washout", "rest")),
        Column("side", "the perturbed leg", words=_SIDES),
        Column("start", f"heel strike that starts it, {_FROM_START}", "s"),
        Column("period", "stride period", "s"),
        Column("first_step", "its first step, to the other leg's heel strike", "s"),
        Column("second_step", "its second step", "s"),
        Column("pulses", "number of pulses that began in it"),
    ),
    "pulses": (
        _BLOCK,
        Column("pulse", "number of the pulse in the run, or in such a block, from 1"),
        Column("stride", "stride in which it began"),
        Column("side", "the perturbed leg", words=_SIDES),
        Column("onset", f"commanded onset {_FROM_START}", "s"),
        Column("torque", "height requested; 0 for a sham and for a catch pulse", "N m"),
        Column("phase", "phase of the onset in its stride, from 0 to below 1", "1"),
        Column(
            "phase_lag", "onset minus the nearest toe-off (heel strike if none was detected)", "s"
        ),
        Column("unwrapped_lag", "the same, followed across its wraps", "s"),
        Column("sent_late", "sent onset minus the commanded one", "s"),
        Column("measured_late", "measured onset minus the commanded one", "s"),
    ),
    "blocks": (
        _BLOCK,
        Column("verdict", "verdict at the end", words=[v.name.lower() for v in Verdict]),
        Column("stride_period", "mean stride period before the pulses", "s"),
        Column("pulse_period", "planned pulse period", "s"),
        Column("offset", "pulse period minus stride period, over the stride period", "percent"),
        Column("variation", "coefficient of variation of the stride before the pulses", "percent"),
        Column("slope", "slope of the lag over the last 10 pulses", "s"),
        Column("slope_low", "lower end of its 95 % interval", "s"),
        Column("slope_high", "upper end", "s"),
        Column("phase", "mean direction of the last 20 pulses, in strides", "1"),
        Column("resultant", "their mean resultant length", "1"),
        Column("kappa", "their concentration (von Mises)", "1"),
        Column("time_constant", "that of the lag's exponential approach, in pulses", "1"),
        Column("time_constant_low", "lower end of its 95 % interval", "1"),
        Column("time_constant_high", "upper end", "1"),
        Column("locked", "share of the pulses within 5 % of the stride of most of them", "1"),
        Column("mean_run", "mean length of the spans of such pulses", "1"),
        Column("holes", "number of holes in the record"),
    ),
}

_TELLING = ("pulses", "blocks")  # tables that reveal the condition of a run


def rows_of(placed: PlacedRun, kind: str) -> Iterator[Row]:
    """
    Yield the rows of a run in one of TABLES, without person, session and block.

    For a sealed run they contain no pulse, and nothing that is derived from pulses.
    """
    run, start, sealed = placed.run, placed.start, placed.place.sealed

    def seconds(stamp: int) -> float:
        return (stamp - start) / NANOSECONDS_PER_SECOND

    if sealed and kind in _TELLING:
        return
    if kind == "events":
        events = [
            (e.stamp, 0.0, EventKind(e.kind).name.lower(), Side(e.side).name.lower(), e.step)
            for e in run.events
        ]
        pulses = [
            (timing.commanded, timing.duration, "pulse", side.name.lower(), number)
            for side in Side
            for number, timing in enumerate((t for s, t in run.delivered if s is side), start=1)
            if not sealed
        ]
        for stamp, *rest in sorted([*events, *pulses]):
            yield seconds(stamp), *rest
    elif kind == "strides":
        for s, part, count in _strides_of(placed):
            revealing = (None, None) if sealed else (part, count)
            cells = s.side.name.lower(), seconds(s.start), s.period, *s.step_periods
            yield s.number, revealing[0], *cells, revealing[1]
    elif kind == "pulses":
        for block, p in ((part, p) for part in placed.parts for p in part.analysis.pulses):
            timing = placed.timings[p.onset]
            yield (
                block.name or None,
                p.number,
                p.stride,
                block.side.name.lower(),
                seconds(p.onset),
                timing.torque,
                p.phase,
                p.phase_lag,
                p.unwrapped_lag,
                *(_seconds_late(timing, kind) for kind in ("sent", "measured")),
            )
    else:
        yield from (findings.row for findings in Findings.of(placed))


def _strides_of(placed: PlacedRun) -> list[tuple[Stride, str, int]]:
    """Return the strides in order, each with its part and its number of pulses."""
    found = []
    blocks = list[tuple[float, float]]()  # [ns]
    for block in placed.parts:
        strides = [s for s in block.analysis.strides if s.end <= block.end]
        blocks += [(strides[0].start, strides[-1].end)] if strides else []
        given = Counter(pulse.stride for pulse in block.analysis.pulses)
        first, last = min(given, default=math.inf), max(given, default=math.inf)
        for s in strides:
            part = "pulses" if first <= s.number <= last else "washout"
            found.append((s, "baseline" if s.number < first else part, given[s.number]))
    between = (s for s in placed.run.strides if all(s.end <= a or b <= s.start for a, b in blocks))
    return sorted([*found, *((s, "rest", 0) for s in between)], key=lambda row: row[0].start)


def _seconds_late(timing: PulseTiming, kind: str) -> float:
    late = late_ms(timing, kind)
    return math.nan if late is None else late / 1e3


def write_tables(runs: Iterable[PlacedRun], out: Path, format_name: str = "tsv") -> list[Path]:
    """
    Write each of TABLES over all runs into a folder, replacing existing files.

    Returns the paths. Raises BagError if pyarrow is missing for Parquet.
    """
    rows: dict[str, list[Row]] = {name: [] for name in TABLES}
    for placed in runs:
        place = placed.place
        head = (place.person or None, place.session or None, place.block, place.name)
        for name, found in rows.items():
            found += ((*head, *row) for row in rows_of(placed, name))
    out.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, columns in TABLES.items():
        path = out / f"{name}.{format_name}"
        if format_name == "parquet":
            _write_parquet(path, (*_PLACE, *columns), rows[name])
        else:
            write_tsv(path, (*_PLACE, *columns), rows[name])
            write_sidecar(path.with_suffix(".json"), (*_PLACE, *columns))
        paths.append(path)
    return paths


def write_tsv(path: Path, columns: Sequence[Column], rows: Iterable[Row]) -> None:
    """Write a table as in BIDS: a header line, tabs, n/a for unknown values."""
    with path.open("w", encoding="utf-8") as file:
        file.write("\t".join(column.name for column in columns) + "\n")
        for row in rows:
            file.write("\t".join(map(_text, row)) + "\n")


def write_sidecar(path: Path, columns: Sequence[Column]) -> None:
    """Write the meanings of a table's columns."""
    path.write_text(json.dumps({c.name: _about(c) for c in columns}, indent=1) + "\n")


def _about(column: Column) -> dict[str, Any]:
    about: dict[str, Any] = {"Description": column.meaning}
    if column.unit:
        about["Units"] = column.unit
    if column.words:
        about["Levels"] = {word: word.replace("_", " ") for word in column.words}
    return about


def _text(value: Any) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "n/a"
    return repr(value) if isinstance(value, float) else str(value)


def _write_parquet(path: Path, columns: Sequence[Column], rows: Sequence[Row]) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise BagError("Parquet needs pyarrow: pip install pyarrow") from None
    cells = zip(*rows, strict=True) if rows else [[] for _ in columns]
    arrays = [
        pyarrow.array([None if _text(c) == "n/a" else c for c in column]) for column in cells
    ]
    fields = []
    for column, array in zip(columns, arrays, strict=True):
        about = {"description": column.meaning} | ({"unit": column.unit} if column.unit else {})
        fields.append(pyarrow.field(column.name, array.type, metadata=about))
    parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields)), path)
