# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Definitions of message types: as installed, and as the text that makes a bag readable anywhere.

They are read from the ``share`` folders of a ROS 2 installation, without ROS itself. The text of
a message comes from its ``.msg`` file and its hash from the ``.json`` type description next to
it. Messages inside services and actions have no ``.msg`` file: both come from the description.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gait_entrainment_bags.errors import DefinitionMissingError

SEPARATOR = "=" * 80

# type_description_interfaces/msg/FieldType: types of values. 48 is added for an array of fixed
# length, 96 for a bounded and 144 for an unbounded sequence.
_VALUE_TYPES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64",
    9: "uint64", 10: "float32", 11: "float64", 13: "char", 15: "bool", 16: "byte", 17: "string",
    18: "wstring", 21: "string<={}", 22: "wstring<={}",
}  # fmt: skip
_NESTED_TYPE = 1
_KINDS_OF_VALUES = 48
BUILT_IN_TYPES = frozenset(name for name in _VALUE_TYPES.values() if "<" not in name)

_TYPE_NAME = re.compile(r"([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)")
# Type, bound of a string, brackets of an array and their content, name; not a constant.
_FIELD = re.compile(r"\s*([\w/]+)(?:<=\d+)?(\[(<?=?\d*)\])?\s+(\w+)\b(?!\s*=)")
_UNIT = re.compile(r"\[([A-Za-z][^\[\]]*)\]")


@dataclass(frozen=True)
class Definition:
    """Text of a message type with all its dependencies, and the hash that identifies it."""

    type: str
    schema_text: str
    type_hash: str


def find_definition(type_name: str, prefixes: Iterable[Path | str] | None = None) -> Definition:
    """
    Find the definition of ``package/msg/Type``, or of a message inside a service or an action.

    The prefixes are folders that hold ``share/``; those of AMENT_PREFIX_PATH if None. Raises
    DefinitionMissingError if the type or one of its dependencies is not installed, or cannot be
    read. The name of a message inside an action is ``package/action/Walk_FeedbackMessage``.
    """
    if prefixes is None:
        prefixes = filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep))
    try:
        return _find_definition(type_name, tuple(Path(prefix) for prefix in prefixes))
    except (KeyError, TypeError):
        raise DefinitionMissingError(
            f"{type_name}: its type description does not have the form of ROS 2 Jazzy"
        ) from None


@cache
def _find_definition(type_name: str, prefixes: tuple[Path, ...]) -> Definition:
    parts: dict[str, str] = {}
    waiting = [type_name]
    while waiting:
        name = waiting.pop(0)
        if name not in parts:
            text = _text_of(name, prefixes)
            parts[name] = f"{SEPARATOR}\nMSG: {short_name(name)}\n{text}" if parts else text
            waiting += _dependencies(name, text)
    for entry in _description_of(type_name, prefixes)["type_hashes"]:
        if entry["type_name"] == type_name:
            return Definition(type_name, "\n".join(parts.values()), entry["hash_string"])
    raise DefinitionMissingError(f"{type_name}: its type description gives no hash")


def _text_of(type_name: str, prefixes: tuple[Path, ...]) -> str:
    package, kind, name = _split(type_name)
    if kind == "msg":
        return _read(f"share/{package}/msg/{name}.msg", type_name, prefixes)
    found = _description_of(type_name, prefixes)["type_description_msg"]
    for described in (found["type_description"], *found["referenced_type_descriptions"]):
        if described["type_name"] == type_name:
            return "".join(_field_line(field) for field in described["fields"])
    raise DefinitionMissingError(f"{type_name}: not in the type description of {package}")


def _field_line(field: Mapping[str, Any]) -> str:
    described = field["type"]
    sequence, value = divmod(described["type_id"], _KINDS_OF_VALUES)
    if value == _NESTED_TYPE:
        text = short_name(described["nested_type_name"])
    else:
        text = _VALUE_TYPES[value].format(described["string_capacity"])
    capacity = described["capacity"]
    return text + ("", f"[{capacity}]", f"[<={capacity}]", "[]")[sequence] + f" {field['name']}\n"


def _description_of(type_name: str, prefixes: tuple[Path, ...]) -> Any:
    package, kind, name = _split(type_name)
    # In a service or an action, Trigger_Event belongs to Trigger, Walk_FeedbackMessage to Walk.
    file = f"share/{package}/{kind}/{name if kind == 'msg' else name.partition('_')[0]}.json"
    try:
        return json.loads(_read(file, type_name, prefixes))
    except ValueError:
        raise DefinitionMissingError(f"{type_name}: {file} is not valid JSON") from None


def _read(relative: str, type_name: str, prefixes: tuple[Path, ...]) -> str:
    """Read a file from the first prefix that has it."""
    path = next((prefix / relative for prefix in prefixes if (prefix / relative).is_file()), None)
    if path is None:
        where = ", ".join(map(str, prefixes)) or "AMENT_PREFIX_PATH, which is empty"
        raise DefinitionMissingError(f"{type_name}: no {relative} in {where}")
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise DefinitionMissingError(f"{type_name}: {path} cannot be read: {error}") from None


@dataclass(frozen=True)
class Field:
    """A field of a definition; its type is built in or ``package/Type``, without bounds."""

    name: str
    type: str
    length: int | None  # of an array; -1: any length; None: not an array
    unit: str


def fields_of(text: str, package: str) -> Iterator[Field]:
    """
    Yield the fields of a definition, without constants, with the units in their comments.

    A unit is in brackets, ``[N m]``. A unit in the comment at the head of the definition applies
    to every field that has none itself.
    """
    head_unit, in_head = "", True
    for line in text.splitlines():
        code, _, comment = line.partition("#")
        found = _UNIT.search(comment)
        unit = found.group(1) if found else ""
        in_head = in_head and not code.strip()
        if in_head:
            head_unit = head_unit or unit
        if field := _FIELD.match(code):
            type_name, array, size, name = field.groups()
            if type_name not in BUILT_IN_TYPES and "/" not in type_name:
                type_name = f"{package}/{type_name}"
            length = None if array is None else int(size) if size.isdecimal() else -1
            yield Field(name, type_name, length, unit or head_unit)


def _dependencies(type_name: str, text: str) -> Iterator[str]:
    """Yield the full names of the message types that a definition uses, in its order."""
    package, kind, _ = _split(type_name)
    for field in fields_of(text, package):
        if field.type not in BUILT_IN_TYPES:
            owner, _, name = field.type.rpartition("/")
            # In text made from a type description, names with an underscore belong to the same
            # service or action.
            yield f"{owner}/{kind if '_' in name else 'msg'}/{name}"


def schema_parts(type_name: str, schema_text: str) -> dict[str, str]:
    """Split the text of a schema into definitions by ``package/Type``, the root first."""
    root, *others = schema_text.split(f"{SEPARATOR}\nMSG: ")
    parts = {short_name(type_name): root}
    for other in others:
        name, _, text = other.partition("\n")
        parts[name.strip().replace("/msg/", "/")] = text
    return parts


def definition_lines(schema_text: str) -> list[list[str]]:
    """Return the words of each line of a definition, without comments and empty lines."""
    return [w for line in schema_text.splitlines() if (w := line.partition("#")[0].split())]


def missing_definitions(type_name: str, schema_text: str) -> list[str]:
    """List the types (``package/Type``) that the text of a schema uses but does not define."""
    needed = set()
    try:
        parts = schema_parts(type_name, schema_text)
        for name, text in parts.items():
            full = name.replace("/", "/msg/", 1)
            needed |= {short_name(dependency) for dependency in _dependencies(full, text)}
    except DefinitionMissingError as error:
        return [str(error)]
    return sorted(needed - parts.keys())


def is_type_name(name: str) -> bool:
    """Return whether a name reads ``package/msg/Type``, or has ``srv`` or ``action`` instead."""
    return _TYPE_NAME.fullmatch(name) is not None


def short_name(type_name: str) -> str:
    """Return ``package/Type`` for ``package/msg/Type``."""
    package, _, name = _split(type_name)
    return f"{package}/{name}"


def _split(type_name: str) -> tuple[str, str, str]:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise DefinitionMissingError(f"{type_name!r}: a type name reads package/msg/Type")
    return match.group(1), match.group(2), match.group(3)
