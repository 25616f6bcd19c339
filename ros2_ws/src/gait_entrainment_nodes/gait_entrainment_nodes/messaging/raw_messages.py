# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Messages as bytes: the same bytes for the same message, and many of them at once.

CDR aligns numbers, and Fast DDS leaves old memory contents in the gaps. `serialize` writes zeros
there, so that equal messages have equal bytes, in different runs too.

Building a message in Python and serializing it costs five times as much as writing its bytes.
All messages of a sampled topic have the same layout; only their numbers differ. So one message
is serialized by ROS itself with marked numbers, the marks are found in its bytes, and from then
on a whole stretch of samples becomes one array of bytes.
"""

import importlib
from collections.abc import Callable, Mapping
from functools import cache, reduce
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    Array,
    BasicType,
    NamespacedType,
)

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND

# A mark is a double that no real number and no text of a template contains.
_MARK = 0x4D61726B00000000


# Alignment counts from the end of the four bytes that name the encoding.
_ENCODING = 4
_SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}
# Clears the gaps of one value in the bytes, from a place on; returns the place after the value.
_Clear = Callable[[bytearray, int, Any], int]


def message_class(name: str) -> Any:
    """Return the Python class of a message type such as sensor_msgs/msg/JointState."""
    package, kind, message = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), message)


def serialize(message: Any) -> bytes:
    """Serialize a ROS message into CDR with zeros in the alignment gaps."""
    data = bytearray(serialize_message(message))
    # Bytes after the last field were only reserved: ROS counts a gap for an empty sequence.
    return bytes(data[: _clear_message(data, _ENCODING, message)])


def _clear_message(data: bytearray, place: int, message: Any) -> int:
    kind: type = type(message)
    fields = _clear_fields(kind)
    for name, clear in fields:
        place = clear(data, place, getattr(message, name))
    return place if fields else place + 1  # IDL has no empty structure: ROS puts an octet there


@cache
def _clear_fields(message_type: type) -> tuple[tuple[str, _Clear], ...]:
    described: Any = message_type
    names = described.get_fields_and_field_types()
    return tuple(
        (name, _clear_for(kind)) for name, kind in zip(names, described.SLOT_TYPES, strict=True)
    )


def _clear_for(kind: Any) -> _Clear:
    """Return what clears the gaps of a value of an IDL type."""
    if isinstance(kind, BasicType):
        size = _SIZES[kind.typename]
        return lambda data, place, _: _align(data, place, size) + size
    if isinstance(kind, AbstractString):
        return lambda data, place, text: _align(data, place, 4) + 4 + len(text.encode()) + 1
    if isinstance(kind, AbstractNestedType):
        return _clear_for_many(kind)
    assert isinstance(kind, NamespacedType)
    return _clear_message


def _clear_for_many(kind: AbstractNestedType) -> _Clear:
    count_size = 0 if isinstance(kind, Array) else 4
    clear_one = _clear_for(kind.value_type)
    basic = isinstance(kind.value_type, BasicType)
    size = _SIZES[kind.value_type.typename] if basic else 0

    def clear(data: bytearray, place: int, values: Any) -> int:
        if count_size:
            place = _align(data, place, count_size) + count_size
        if basic and len(values):
            return _align(data, place, size) + size * len(values)
        for value in values:
            place = clear_one(data, place, value)
        return place

    return clear


def _align(data: bytearray, place: int, size: int) -> int:
    gap = -(place - _ENCODING) % size
    if gap:
        data[place : place + gap] = bytes(gap)
    return place + gap


class MessageTemplate:
    """
    The bytes of one message with a header, ready to be filled with other numbers.

    ``fields`` has the names of the doubles that change, with dots for nested ones, and how many
    there are: the length of an array, or the number of adjacent doubles from that field on.
    """

    def __init__(self, message: Any, fields: Mapping[str, int]) -> None:
        for number, (name, length) in enumerate(fields.items()):
            mark = float(np.array(_MARK + number, np.uint64).view(np.float64))
            *parents, last = name.split(".")
            owner = reduce(getattr, parents, message)
            scalar = isinstance(getattr(owner, last), float)
            setattr(owner, last, mark if scalar else [mark, *[0.0] * (length - 1)])
        message.header.stamp.sec, message.header.stamp.nanosec = 0, 0
        content = serialize(message)
        self._bytes = np.frombuffer(content, np.uint8)
        places = [content.index((_MARK + i).to_bytes(8, "little")) for i in range(len(fields))]
        self._fields = list(fields)
        self._layout = np.dtype(
            {
                "names": ["sec", "nanosec", *fields],
                "formats": ["<i4", "<u4", *(f"({length},)<f8" for length in fields.values())],
                "offsets": [4, 8, *places],
                "itemsize": len(content),
            }
        )

    def fill(self, stamps: np.ndarray, *columns: np.ndarray) -> list[bytes]:
        """
        Return one serialized message per sample.

        ``stamps`` are times [ns since 1970], shape (n,), int64; each of ``columns`` has the
        values of a field, shape (n, number of its doubles).
        """
        table = np.tile(self._bytes, (len(stamps), 1))
        rows = table.view(self._layout)[:, 0]
        rows["sec"], rows["nanosec"] = np.divmod(stamps, NANOSECONDS_PER_SECOND)
        for name, values in zip(self._fields, columns, strict=True):
            rows[name] = values
        content, size = table.tobytes(), table.shape[1]
        return [content[begin : begin + size] for begin in range(0, len(content), size)]
