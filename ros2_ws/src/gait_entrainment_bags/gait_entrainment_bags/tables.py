# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Tables out of a bag for spreadsheets and pandas: one per topic, a row per message."""

import csv
import json
import math
import re
import shutil
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

from gait_entrainment.conventions import stamp_nanoseconds
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.definitions import BUILT_IN_TYPES, schema_parts
from gait_entrainment_bags.errors import (
    BagError,
    BagExistsError,
    BagWriteError,
    UnreadableBagError,
)
from gait_entrainment_bags.metadata import TopicInfo, first_line
from gait_entrainment_bags.reader import BagReader

FORMATS = ("csv", "parquet")

# Units of the standard messages, whose definitions name them in prose only.
STANDARD_UNITS = {
    ("sensor_msgs/JointState", "position"): "rad",
    ("sensor_msgs/JointState", "velocity"): "rad/s",
    ("sensor_msgs/JointState", "effort"): "N m",
    ("geometry_msgs/Wrench", "force"): "N",
    ("geometry_msgs/Wrench", "torque"): "N m",
    ("geometry_msgs/Point", "x"): "m",
    ("geometry_msgs/Point", "y"): "m",
    ("geometry_msgs/Point", "z"): "m",
}
_UNIT = re.compile(r"\[([A-Za-z][^\[\]]*)\]")
_INSTANTS = ("builtin_interfaces/Time", "builtin_interfaces/Duration")
_ROWS_AT_ONCE = 65536


@dataclass(frozen=True)
class Column:
    """A column of a table: what it is called, its unit, and how a message fills it."""

    name: str
    unit: str
    kind: str
    """``float``, ``int``, ``uint`` (64 bits), ``bool``, ``text``; ``floats`` and so on: lists."""
    value: Callable[[Any], Any]


def export(
    path: Path | str, out: Path | str, format_name: str, topics: Collection[str] | None = None
) -> dict[str, Path]:
    """
    Write one table per topic, named after it: ``/gait/strides`` becomes ``gait.strides.csv``.

    The first two columns are the log time and the publish time. Stamps are integer nanoseconds.
    Arrays of fixed length take a column per element; those of a message that names its elements
    (JointState) a column per name, ``position.l_hip``; other arrays are lists, in CSV as JSON.
    Units stand in the metadata of a Parquet column, and in CSV behind the name: ``period [s]``.

    Parameters
    ----------
    path
        Folder or ``.mcap`` file.
    out
        Folder to make.
    format_name
        ``csv`` or ``parquet``; the latter needs pyarrow.
    topics
        Names of topics, or None for all that have messages.

    Returns
    -------
    Files written, by topic.

    Raises
    ------
    BagExistsError
        The folder is already there.
    BagError
        The format is unknown, a topic is not in the bag or cannot be decoded, or pyarrow is
        missing.
    UnreadableBagError
        The bag is damaged.

    """
    out = Path(out)
    if format_name not in FORMATS:
        raise BagError(f"format {format_name!r}: one of {', '.join(FORMATS)}")
    with BagReader(path) as reader:
        if topics is None:
            topics = [name for name, count in reader.counts.items() if count]
        if missing := set(topics) - reader.topics.keys():
            raise BagError(f"{path}: no topic {', '.join(sorted(missing))} in the bag")
        if silent := [name for name in topics if not reader.counts[name]]:
            raise BagError(f"{path}: no messages on {', '.join(silent)}: leave it out of --topics")
        if format_name == "parquet":
            _require_pyarrow()
        try:
            out.mkdir(parents=True)
        except FileExistsError:
            raise BagExistsError(f"{out}: is already there; choose another folder") from None
        except OSError as error:
            raise BagWriteError(f"{out}: cannot be made: {error.strerror}") from None
        written = {}
        try:
            for name in topics:
                file = out / f"{name.strip('/').replace('/', '.')}.{format_name}"
                _write_table(reader, reader.topics[name], file)
                written[name] = file
        except BaseException as error:
            shutil.rmtree(out, ignore_errors=True)  # tables that break off are worse than none
            if isinstance(error, (OSError, ValueError)):
                raise BagWriteError(f"{file}: cannot be written: {first_line(error)}") from None
            raise
        return written


def _write_table(reader: BagReader, topic: TopicInfo, file: Path) -> None:
    decode = decoder_for(topic)
    messages = reader.messages([topic.name])
    table: _Table | None = None
    columns: list[Column] = []
    while batch := list(islice(messages, _ROWS_AT_ONCE)):
        decoded = [decode(message.data) for message in batch]
        values = [
            [message.log_time for message in batch],
            [message.publish_time for message in batch],
        ]
        try:
            if table is None:
                columns = columns_of(topic, decoded[0])
                table = (_CsvTable if file.suffix == ".csv" else _ParquetTable)(file, columns)
            values += [[column.value(message) for message in decoded] for column in columns]
        except IndexError:  # the decoder gives fewer bytes than an array has where a message ends
            raise UnreadableBagError(
                f"{topic.name}: not a {topic.type} in CDR: an array of fixed length is too short"
            ) from None
        except _ChangedNamesError:
            raise BagError(
                f"{topic.name}: the names of its elements change, so that no table of one column "
                "per name can be made"
            ) from None
        table.append(values)
    if table is not None:
        table.close()


class _ChangedNamesError(Exception):
    """The elements of a message have other names, or another order, than in the first one."""


def columns_of(topic: TopicInfo, example: Any) -> list[Column]:
    """Lay out the columns of a topic; an example of a message may name those of its elements."""
    parts = schema_parts(topic.type, topic.schema_text)
    return list(_columns(parts, _short_name(topic.type), "", "", lambda message: message, example))


@dataclass(frozen=True)
class _Field:
    name: str
    type: str
    length: int | None  # None: not an array; -1: any length
    unit: str


def _columns(
    parts: dict[str, str],
    type_name: str,
    prefix: str,
    inherited_unit: str,
    get: Callable[[Any], Any],
    example: Any,
) -> Iterator[Column]:
    fields = list(_fields(parts[type_name], type_name))
    names: list[str] = []
    if any(
        field.name == "name" and field.type == "string" and field.length == -1 for field in fields
    ):
        names = list(example.name)

    def has_column_per_name(field: _Field) -> bool:
        return (
            field.length == -1
            and field.type == "float64"
            and bool(names)
            and len(getattr(example, field.name)) == len(names)
        )

    named = any(map(has_column_per_name, fields))
    for field in fields:
        unit = field.unit or inherited_unit
        path = f"{prefix}{field.name}"

        def value(message: Any, field: _Field = field) -> Any:
            return getattr(get(message), field.name)

        inner = getattr(example, field.name)
        if field.length is None:
            yield from _element_columns(parts, field.type, path, unit, value, inner)
        elif field.length >= 0:
            for number in range(field.length):
                yield from _element_columns(
                    parts,
                    field.type,
                    f"{path}.{number}",
                    unit,
                    _item(value, number),
                    inner[number],
                )
        elif has_column_per_name(field):
            for number, name in enumerate(names):
                yield Column(
                    f"{path}.{name}", unit, "float", _named_item(get, value, names, number)
                )
        elif not (named and field.name == "name"):
            yield _list_column(field.type, path, unit, value)


def _item(value: Callable[[Any], Any], number: int) -> Callable[[Any], Any]:
    return lambda message: value(message)[number]


def _named_item(
    get: Callable[[Any], Any], value: Callable[[Any], Any], names: list[str], number: int
) -> Callable[[Any], Any]:
    def item(message: Any) -> Any:
        values = value(message)
        if get(message).name != names or len(values) != len(names):
            raise _ChangedNamesError
        return values[number]

    return item


def _element_columns(
    parts: dict[str, str],
    type_name: str,
    path: str,
    unit: str,
    value: Callable[[Any], Any],
    example: Any,
) -> Iterator[Column]:
    if type_name in _INSTANTS:
        yield Column(path, "ns", "int", lambda message: stamp_nanoseconds(value(message)))
    elif type_name in BUILT_IN_TYPES:
        kind = _kind(type_name)
        yield Column(path, unit if kind == "float" else "", kind, value)
    else:
        yield from _columns(parts, type_name, f"{path}.", unit, value, example)


def _list_column(type_name: str, path: str, unit: str, value: Callable[[Any], Any]) -> Column:
    if type_name in _INSTANTS:
        return Column(
            path,
            "ns",
            "ints",
            lambda message: [stamp_nanoseconds(item) for item in value(message)],
        )
    kind = _kind(type_name) if type_name in BUILT_IN_TYPES else "text"
    if kind in ("float", "int", "uint"):
        return Column(
            path, unit if kind == "float" else "", f"{kind}s", lambda message: list(value(message))
        )
    return Column(path, "", "text", lambda message: json.dumps(_plain(value(message))))


def _kind(type_name: str) -> str:
    if type_name.startswith("float"):
        return "float"
    if type_name.endswith("string"):
        return "text"
    if type_name == "uint64":
        return "uint"
    return "bool" if type_name == "bool" else "int"


def _plain(value: Any) -> Any:
    """Turn a decoded message into maps, lists and numbers."""
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "__slots__") and not isinstance(value, (str, bytes, int, float)):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return list(value) if isinstance(value, (bytes, bytearray)) else value


def _fields(text: str, type_name: str) -> Iterator[_Field]:
    """
    Read the fields of a definition, constants left out, with the units in their comments.

    A unit stands in brackets, ``[N m]``. One in the comment at the head of the definition holds
    for every field that has none of its own.
    """
    package = type_name.split("/")[0]
    head_unit, in_head = "", True
    for line in text.splitlines():
        code, _, comment = line.partition("#")
        unit_match = _UNIT.search(comment)
        unit = unit_match.group(1) if unit_match else ""
        words = code.split()
        if len(words) < 2 or "=" in words[1] or (len(words) > 2 and words[2].startswith("=")):
            in_head = in_head and not words
            head_unit = head_unit or (unit if in_head else "")
            continue
        in_head = False
        base, bracket, length = words[0].partition("[")
        base = base.split("<")[0]
        if base not in BUILT_IN_TYPES and "/" not in base:
            base = f"{package}/{base}"
        size: int | None = None
        if bracket:
            digits = length.rstrip("]")
            size = int(digits) if digits.isdecimal() else -1
        unit = STANDARD_UNITS.get((type_name, words[1]), unit or head_unit)
        yield _Field(words[1], base, size, unit)


def _short_name(type_name: str) -> str:
    package, _, name = type_name.split("/")
    return f"{package}/{name}"


class _Table(Protocol):
    def append(self, values: list[list[Any]]) -> None: ...

    def close(self) -> None: ...


_TIMES = [("log_time", "ns", "uint"), ("publish_time", "ns", "uint")]


class _CsvTable:
    """A CSV file; NaN and infinities are written as pandas writes them, lists as JSON."""

    def __init__(self, file: Path, columns: list[Column]) -> None:
        self._file = file.open("x", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        titles = [(name, unit) for name, unit, _ in _TIMES]
        titles += [(column.name, column.unit) for column in columns]
        self._writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in titles])

    def append(self, values: list[list[Any]]) -> None:
        """Add rows, given by column."""
        self._writer.writerows(
            [[self._cell(value) for value in row] for row in zip(*values, strict=True)]
        )

    @staticmethod
    def _cell(value: Any) -> Any:
        if isinstance(value, list):
            return json.dumps(value)
        return "" if isinstance(value, float) and math.isnan(value) else value

    def close(self) -> None:
        """Finish the file."""
        self._file.close()


class _ParquetTable:
    """A Parquet file with the unit of each column in the metadata of its field."""

    def __init__(self, file: Path, columns: list[Column]) -> None:
        arrow, parquet = _require_pyarrow()
        types = {
            "float": arrow.float64(),
            "int": arrow.int64(),
            "uint": arrow.uint64(),
            "bool": arrow.bool_(),
            "text": arrow.string(),
            "floats": arrow.list_(arrow.float64()),
            "ints": arrow.list_(arrow.int64()),
            "uints": arrow.list_(arrow.uint64()),
        }
        layout = _TIMES + [(column.name, column.unit, column.kind) for column in columns]
        self._schema = arrow.schema(
            [
                arrow.field(name, types[kind], metadata={"unit": unit} if unit else None)
                for name, unit, kind in layout
            ]
        )
        self._arrow = arrow
        self._writer = parquet.ParquetWriter(file, self._schema)

    def append(self, values: list[list[Any]]) -> None:
        """Add rows, given by column."""
        arrays = [
            self._arrow.array(column, field.type)
            for column, field in zip(values, self._schema, strict=True)
        ]
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()


def _require_pyarrow() -> tuple[Any, Any]:
    # Imported by name: it is large, and whoever exports to CSV need not have it.
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise BagError("Parquet needs pyarrow: pip install pyarrow; CSV needs nothing") from None
