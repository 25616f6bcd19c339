# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Tables from a bag for spreadsheets and pandas: one per topic, a row per message."""

import json
import shutil
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from itertools import chain, islice
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import nanoseconds_of
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.definitions import BUILT_IN_TYPES, Field, fields_of, schema_parts
from gait_entrainment_bags.errors import BagError, BagWriteError, UnreadableBagError, make_folder
from gait_entrainment_bags.metadata import TopicInfo, first_line
from gait_entrainment_bags.reader import BagReader

FORMATS = ("csv", "parquet")
# Units of standard messages, whose definitions give them only in prose.
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
_INSTANTS = ("builtin_interfaces/Time", "builtin_interfaces/Duration")
_ROWS_AT_ONCE = 65536
_Get = Callable[[Any], Any]


class ExportError(BagError):
    """Some topics could not be exported; ``files`` are the tables of the others, by topic."""

    def __init__(self, files: dict[str, Path], refused: dict[str, str]) -> None:
        super().__init__("; ".join(refused.values()))
        self.files, self.refused = files, refused


@dataclass(frozen=True)
class Column:
    """A column of a table: its name, its unit, and how its cell is taken from a message."""

    name: str
    unit: str
    kind: str  # pyarrow's name: float64, int64, uint64, bool_ or string
    value: _Get
    is_list: bool = False


_TIMES = [Column(name, "ns", "uint64", attrgetter(name)) for name in ("log_time", "publish_time")]


def export(
    path: Path | str, out: Path | str, format_name: str, topics: Collection[str] | None = None
) -> dict[str, Path]:
    """
    Write one table per topic, named after it: ``/gait/strides`` becomes ``gait.strides.csv``.

    The first two columns are the log time and the publish time. Stamps are integer nanoseconds.
    Arrays of fixed length get a column per element. Arrays of a message that names its elements
    (JointState) get a column per name, ``position.l_hip``. Other arrays are lists, as JSON in CSV.
    Units are in the metadata of a Parquet column, and after the name in CSV: ``period [s]``.
    Floats in CSV have enough digits to read the same float back; NaN is an empty cell.

    The format is ``csv`` or ``parquet``, ``out`` a folder to create; by default all topics with
    messages are exported. Returns the files by topic. Raises BagExistsError if the folder exists,
    BagError if the format is unknown, a topic is not in the bag, or pyarrow is missing; and, once
    the other tables are written, ExportError for topics that cannot be decoded.
    """
    out = Path(out)
    if format_name not in FORMATS:
        raise BagError(f"format {format_name!r}; allowed: {', '.join(FORMATS)}")
    with BagReader(path) as reader:
        if topics is None:
            topics = [name for name, count in reader.counts.items() if count]
            if not topics:
                raise BagError(f"{path}: holds no messages to export")
        reader.require_topics(topics)
        if silent := [name for name in topics if not reader.counts[name]]:
            raise BagError(f"{path}: no messages on {', '.join(silent)}: leave it out of --topics")
        _import_pyarrow()
        make_folder(out)
        # A dot, which no ROS 2 topic has, is doubled so that no table overwrites another.
        plain = {name: name.strip("/").replace(".", "..").replace("/", ".") for name in topics}
        files = {name: out / f"{text}.{format_name}" for name, text in plain.items()}
        refused: dict[str, str] = {}
        try:
            for name, file in files.items():
                try:
                    _write_table(reader, reader.topics[name], file)
                except BagError as error:
                    file.unlink(missing_ok=True)  # a truncated table is worse than none
                    refused[name] = str(error)
        except BaseException as error:
            shutil.rmtree(out, ignore_errors=True)
            if isinstance(error, (OSError, ValueError)):
                raise BagWriteError(f"{file}: cannot be written: {first_line(error)}") from None
            raise
        files = {name: file for name, file in files.items() if name not in refused}
        if refused and not files:
            shutil.rmtree(out, ignore_errors=True)
        if refused:
            raise ExportError(files, refused)
        return files


def _write_table(reader: BagReader, topic: TopicInfo, file: Path) -> None:
    arrow, csv, parquet = _import_pyarrow()
    is_csv = file.name.endswith(".csv")
    decode = decoder_for(topic)
    messages = reader.messages([topic.name])
    first = next(messages)
    messages = chain([first], messages)
    try:
        columns = columns_of(topic, decode(first.data))
        if is_csv:
            columns = [_as_text(column) if column.is_list else column for column in columns]
        schema = arrow.schema([_arrow_field(arrow, column, is_csv) for column in _TIMES + columns])
        with (csv.CSVWriter if is_csv else parquet.ParquetWriter)(file, schema) as writer:
            while batch := list(islice(messages, _ROWS_AT_ONCE)):
                decoded = [decode(message.data) for message in batch]
                cells = [list(map(column.value, batch)) for column in _TIMES]
                cells += [list(map(column.value, decoded)) for column in columns]
                # A NaN is an empty cell in CSV, which is what `from_pandas` makes of it.
                arrays = [
                    arrow.array(column, field.type, from_pandas=is_csv)
                    for column, field in zip(cells, schema, strict=True)
                ]
                writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))
    except IndexError:  # the decoder returns a short byte array if the message ends early
        raise UnreadableBagError(
            f"{topic.name}: not a {topic.type} in CDR: an array of fixed length is too short"
        ) from None
    except _ChangedNamesError:
        raise BagError(
            f"{topic.name}: the names of its elements change, so a table with one column per name "
            "is impossible"
        ) from None


class _ChangedNamesError(Exception):
    """The elements of a message are named or ordered differently than in the first message."""


def _arrow_field(arrow: Any, column: Column, is_csv: bool) -> Any:
    """Return the Arrow field of a column, with its unit and type."""
    name, metadata, kind = column.name, None, getattr(arrow, column.kind)()
    if column.unit and is_csv:
        name = f"{name} [{column.unit}]"
    elif column.unit:
        metadata = {"unit": column.unit}
    return arrow.field(name, arrow.list_(kind) if column.is_list else kind, metadata=metadata)


def _as_text(column: Column) -> Column:
    """Turn a column of lists into one of JSON."""
    return replace(column, kind="string", value=_then(column.value, json.dumps), is_list=False)


def _import_pyarrow() -> list[Any]:
    # Imported only here, since rosdep has no key for it: recording and reading do not need it.
    try:
        return [import_module(name) for name in ("pyarrow", "pyarrow.csv", "pyarrow.parquet")]
    except ImportError:
        raise BagError("the export needs pyarrow: pip install pyarrow") from None


def columns_of(topic: TopicInfo, example: Any) -> list[Column]:
    """Lay out the columns of a topic whose messages name their elements as the example does."""
    parts = schema_parts(topic.type, topic.schema_text)
    return list(_columns(parts, next(iter(parts)), "", "", None, example))


def _columns(
    parts: dict[str, str], type_name: str, prefix: str, outer: str, get: _Get | None, example: Any
) -> Iterator[Column]:
    """Lay out a type's columns; `get` takes its value from a message (None: the message)."""
    fields = list(fields_of(parts[type_name], type_name.partition("/")[0]))
    names = _element_names(fields, example)
    for field in fields:
        path = prefix + field.name
        unit = STANDARD_UNITS.get((type_name, field.name), field.unit) or outer
        value = _then(get, attrgetter(field.name))
        found = getattr(example, field.name)
        if field.length == -1:
            if names and field.type == "float64" and len(found) == len(names):
                for number, name in enumerate(names):
                    item = _named_item(_then(get, attrgetter("name")), value, names, number)
                    yield Column(f"{path}.{name}", unit, "float64", item)
            elif not names or field.name != "name":
                yield _column(field, path, unit, value)
            continue
        elements = [(path, value, found)]
        if field.length is not None:
            elements = [
                (f"{path}.{number}", _then(value, itemgetter(number)), found[number])
                for number in range(field.length)
            ]
        for place, element, inner in elements:
            if field.type in BUILT_IN_TYPES or field.type in _INSTANTS:
                yield _column(field, place, unit, element)
            else:
                yield from _columns(parts, field.type, f"{place}.", unit, element, inner)


def _element_names(fields: list[Field], example: Any) -> list[str]:
    """Return the names of a message's elements, [] if its numbers have no names."""
    if not any((f.name, f.type, f.length) == ("name", "string", -1) for f in fields):
        return []
    arrays = [f.name for f in fields if (f.type, f.length) == ("float64", -1)]
    by_name = any(len(getattr(example, array)) == len(example.name) for array in arrays)
    return list(example.name) if by_name else []


def _column(field: Field, path: str, unit: str, value: _Get) -> Column:
    """Lay out one column, of values or, if the field is an array of any length, of lists."""
    is_list = field.length == -1
    if field.type in _INSTANTS:
        step = (lambda stamps: [*map(nanoseconds_of, stamps)]) if is_list else nanoseconds_of
        return Column(path, "ns", "int64", _then(value, step), is_list)
    kind = _kind(field.type) if field.type in BUILT_IN_TYPES else "string"
    if is_list and kind in ("string", "bool_"):
        return Column(path, "", "string", _then(value, lambda items: json.dumps(_plain(items))))
    unit = unit if kind == "float64" else ""
    return Column(path, unit, kind, _then(value, list) if is_list else value, is_list)


def _then(get: _Get | None, step: _Get) -> _Get:
    return step if get is None else lambda message: step(get(message))


def _named_item(get_names: _Get, value: _Get, names: list[str], number: int) -> _Get:
    def item(message: Any) -> Any:
        values = value(message)
        if get_names(message) != names or len(values) != len(names):
            raise _ChangedNamesError
        return values[number]

    return item


def _kind(type_name: str) -> str:
    """Return the kind of cell for a built-in type."""
    if type_name.startswith("float"):
        return "float64"
    if type_name.endswith("string"):
        return "string"
    if type_name == "uint64":
        return "uint64"
    return "bool_" if type_name == "bool" else "int64"


def _plain(value: Any) -> Any:
    """Turn a decoded message into maps, lists and numbers."""
    if isinstance(value, (list, tuple, bytes, bytearray)):
        return [_plain(item) for item in value]
    if hasattr(value, "__slots__") and not isinstance(value, (str, int, float)):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value
