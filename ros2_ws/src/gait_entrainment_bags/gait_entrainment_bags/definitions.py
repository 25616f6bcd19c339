# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Definitions of message types as installed: the text that makes a bag readable anywhere.

They are read from the ``share`` folders of a ROS 2 installation, without ROS itself: ``.msg``
files for messages, the ``.json`` type descriptions beside them for the type hashes, and for the
messages inside services and actions, which have no ``.msg`` file, for the text as well.
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

BUILT_IN_TYPES = frozenset(
    f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)
) | {"bool", "byte", "char", "float32", "float64", "string", "wstring"}

# type_description_interfaces/msg/FieldType: kinds of values, to which 48 is added for an array
# of fixed length, 96 for a bounded and 144 for an unbounded sequence.
_VALUE_TYPES = {
    2: "int8",
    3: "uint8",
    4: "int16",
    5: "uint16",
    6: "int32",
    7: "uint32",
    8: "int64",
    9: "uint64",
    10: "float32",
    11: "float64",
    13: "char",
    15: "bool",
    16: "byte",
    17: "string",
    18: "wstring",
    21: "string<={}",
    22: "wstring<={}",
}
_NESTED_TYPE = 1
_KINDS_OF_VALUES = 48

_TYPE_NAME = re.compile(r"([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)")
# What a nested name belongs to: Trigger_Event to Trigger, Walk_FeedbackMessage to Walk.
_PARENT_NAME = re.compile(r"[^_]+")


@dataclass(frozen=True)
class Definition:
    """Text of a message type with all that it depends on, and the hash that identifies it."""

    type: str
    schema_text: str
    type_hash: str


def find_definition(type_name: str, prefixes: Iterable[Path | str] | None = None) -> Definition:
    """
    Gather the definition of a message type.

    Parameters
    ----------
    type_name
        ``package/msg/Type``, or a message inside a service or an action such as
        ``package/action/Walk_FeedbackMessage``.
    prefixes
        Folders that hold ``share/``; those of AMENT_PREFIX_PATH if None.

    Raises
    ------
    DefinitionMissingError
        The type or one of those it is made of is not installed, or cannot be read.

    """
    if prefixes is None:
        prefixes = filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep))
    try:
        return _find_definition(type_name, tuple(Path(prefix) for prefix in prefixes))
    except (KeyError, TypeError):
        raise DefinitionMissingError(
            f"{type_name}: its type description is not of the form of ROS 2 Jazzy"
        ) from None


@cache
def _find_definition(type_name: str, prefixes: tuple[Path, ...]) -> Definition:
    parts = [_text_of(type_name, prefixes)]
    seen = {type_name}
    waiting = list(_dependencies(type_name, parts[0]))
    while waiting:
        dependency = waiting.pop(0)
        if dependency in seen:
            continue
        seen.add(dependency)
        text = _text_of(dependency, prefixes)
        parts.append(f"{SEPARATOR}\nMSG: {_short(dependency)}\n{text}")
        waiting += _dependencies(dependency, text)
    return Definition(type_name, "\n".join(parts), _hash_of(type_name, prefixes))


def _text_of(type_name: str, prefixes: tuple[Path, ...]) -> str:
    package, kind, name = _split(type_name)
    if kind == "msg":
        path = _find_file(f"share/{package}/msg/{name}.msg", type_name, prefixes)
        return _read(path, type_name)
    description = _description_of(type_name, prefixes)["type_description_msg"]
    for described in (
        description["type_description"],
        *description["referenced_type_descriptions"],
    ):
        if described["type_name"] == type_name:
            return "".join(_field_line(field) for field in described["fields"])
    raise DefinitionMissingError(f"{type_name}: not in the type description of {package}")


def _field_line(field: Mapping[str, Any]) -> str:
    described = field["type"]
    sequence, value = divmod(described["type_id"], _KINDS_OF_VALUES)
    if value == _NESTED_TYPE:
        text = _short(described["nested_type_name"])
    else:
        text = _VALUE_TYPES[value].format(described["string_capacity"])
    capacity = described["capacity"]
    return text + ("", f"[{capacity}]", f"[<={capacity}]", "[]")[sequence] + f" {field['name']}\n"


def _hash_of(type_name: str, prefixes: tuple[Path, ...]) -> str:
    for entry in _description_of(type_name, prefixes)["type_hashes"]:
        if entry["type_name"] == type_name:
            return str(entry["hash_string"])
    raise DefinitionMissingError(f"{type_name}: its type description gives no hash")


def _description_of(type_name: str, prefixes: tuple[Path, ...]) -> Any:
    package, kind, name = _split(type_name)
    if kind != "msg":
        parent = _PARENT_NAME.match(name)
        name = parent.group() if parent else name
    path = _find_file(f"share/{package}/{kind}/{name}.json", type_name, prefixes)
    try:
        return json.loads(_read(path, type_name))
    except ValueError:
        raise DefinitionMissingError(f"{type_name}: {path} is not valid JSON") from None


def _dependencies(type_name: str, text: str) -> Iterator[str]:
    """Give the full names of the message types that a definition names, in its order."""
    package, kind, _ = _split(type_name)
    for line in text.splitlines():
        words = line.split("#", 1)[0].split()
        # A constant (uint8 LEFT=0) has a built-in type as well, so nothing is taken for a type.
        if len(words) < 2:
            continue
        base = words[0].split("[", 1)[0].split("<", 1)[0]
        if base in BUILT_IN_TYPES:
            continue
        owner, _, name = base.rpartition("/")
        # In a text made from a type description names with an underscore are those of the same
        # service or action.
        nested = kind if "_" in name else "msg"
        yield f"{owner or package}/{nested}/{name}"


def schema_parts(type_name: str, schema_text: str) -> dict[str, str]:
    """Take the text of a schema apart: definitions by ``package/Type``, the root one first."""
    root, *others = schema_text.split(f"{SEPARATOR}\nMSG: ")
    parts = {_short(type_name): root}
    for other in others:
        name, _, text = other.partition("\n")
        parts[name.strip().replace("/msg/", "/")] = text
    return parts


def definition_lines(schema_text: str) -> list[list[str]]:
    """Return the words of a definition: what is left without comments and empty lines."""
    lines = (line.partition("#")[0].split() for line in schema_text.splitlines())
    return [words for words in lines if words]


def missing_definitions(type_name: str, schema_text: str) -> list[str]:
    """List the types (``package/Type``) that the text of a schema names but does not define."""
    needed = set()
    try:
        parts = schema_parts(type_name, schema_text)
        for name, text in parts.items():
            full = name.replace("/", "/msg/", 1)
            needed |= {_short(dependency) for dependency in _dependencies(full, text)}
    except DefinitionMissingError as error:
        return [str(error)]
    return sorted(needed - parts.keys())


def is_type_name(name: str) -> bool:
    """Tell whether a name reads ``package/msg/Type``, or the same of a service or an action."""
    return _TYPE_NAME.fullmatch(name) is not None


def _short(type_name: str) -> str:
    package, _, name = _split(type_name)
    return f"{package}/{name}"


def _split(type_name: str) -> tuple[str, str, str]:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise DefinitionMissingError(f"{type_name!r}: a type name reads package/msg/Type")
    return match.group(1), match.group(2), match.group(3)


def _find_file(relative: str, type_name: str, prefixes: tuple[Path, ...]) -> Path:
    for prefix in prefixes:
        if (path := prefix / relative).is_file():
            return path
    where = ", ".join(str(prefix) for prefix in prefixes) or "AMENT_PREFIX_PATH, which is empty"
    raise DefinitionMissingError(f"{type_name}: no {relative} in {where}")


def _read(path: Path, type_name: str) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise DefinitionMissingError(f"{type_name}: {path} cannot be read: {error}") from None
