# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Write type stubs of the ROS messages, services and actions that the project imports.

    make_message_stubs.py [FOLDER]

The Python classes that ROS 2 Jazzy generates carry no annotations, but each carries its definition
(`SLOT_TYPES`), from which its stub is made. A field has the type that it reads as and, if more
is accepted, a setter with the type that may be assigned; what is assigned is what the classes
accept when they check their fields (ROS_PYTHON_CHECK_FIELDS=1). rclpy is linked next to the stubs:
mypy does not search the folders of a sourced ROS 2.
"""

import ast
import importlib.util
import inspect
import shutil
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import rclpy
from ament_index_python.resources import get_resources
from rosidl_generator_py.generate_py_impl import SPECIAL_NESTED_BASIC_TYPES
from rosidl_parser.definition import (
    AbstractGenericString,
    AbstractNestedType,
    AbstractType,
    Array,
    BasicType,
    NamespacedType,
)

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "ros2_ws/src"
STUBS = ROOT / "ros2_ws/install/stubs"
KINDS = ("msg", "srv", "action")
PARTS = ("Request", "Response", "Goal", "Result", "Feedback")
# Fields may be named like built-in types, in lower case, but not like anything imported here.
HEAD = """\
import builtins
from array import array as Array
from collections.abc import Sequence, Set
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray
"""


def imported_packages() -> set[str]:
    """Return the interface packages that the sources import."""
    names = set()
    for file in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                names.add(node.module.partition(".")[0])
    return names & get_resources("rosidl_interfaces").keys()


def single(kind: AbstractType) -> str:
    """Return the annotation of a single value."""
    if isinstance(kind, NamespacedType):
        return ".".join(kind.namespaced_name())
    if isinstance(kind, AbstractGenericString):
        return "builtins.str"
    assert isinstance(kind, BasicType)
    by_name = {"boolean": "bool", "octet": "bytes", "float": "float", "double": "float"}
    return f"builtins.{by_name.get(kind.typename, 'int')}"


def read_and_assigned(kind: AbstractType) -> tuple[str, str]:
    """Return the annotations of a field: what it reads as, and what may be assigned to it."""
    if not isinstance(kind, AbstractNestedType):
        return single(kind), single(kind)
    value = single(kind.value_type)
    many = f"Sequence[{value}] | Set[{value}]"
    special = SPECIAL_NESTED_BASIC_TYPES.get(getattr(kind.value_type, "typename", None))
    if special is None:
        return f"Sequence[{value}]", many
    if isinstance(kind, Array):
        array = f"NDArray[{special['dtype'].replace('numpy', 'np')}]"
    else:
        array = f"Array[{value}]"
    return array, f"{array} | {many}"


def message_stub(message: Any, name: str) -> Iterator[str]:
    """Yield the lines of the stub of one message class."""
    fields = dict(
        zip(
            message.get_fields_and_field_types(),
            map(read_and_assigned, message.SLOT_TYPES),
            strict=True,
        )
    )
    yield f"class {name}:"
    constants = vars(type(message))[f"_{type(message).__name__}__constants"]
    for constant, value in constants.items():
        yield f"    {constant}: Final = {value!r}"
    yield "    SLOT_TYPES: ClassVar[builtins.tuple[Any, ...]]"
    yield "    @builtins.classmethod"
    names_type = "builtins.dict[builtins.str, builtins.str]"
    yield f"    def get_fields_and_field_types(cls) -> {names_type}: ..."
    yield "    def __init__("
    yield "        self,"
    yield "        *,"
    for field, (_, assigned) in fields.items():
        yield f"        {field}: {assigned} = ...,"
    yield "        check_fields: builtins.bool = ...,"
    yield "    ) -> None: ..."
    for field, (read, assigned) in fields.items():
        if read == assigned:
            yield f"    {field}: {read}"
        else:
            yield "    @builtins.property"
            yield f"    def {field}(self) -> {read}: ..."
            yield f"    @{field}.setter"
            yield f"    def {field}(self, value: {assigned}) -> None: ..."


def interface_stub(interface: Any, name: str) -> Iterator[str]:
    """Yield the lines of the stub of a message, a service or an action."""
    parts = [part for part in PARTS if hasattr(interface, part)]
    if not parts:
        yield from message_stub(interface, name)
        return
    yield f"class {name}:"
    for part in parts:
        for line in message_stub(getattr(interface, part), part):
            yield f"    {line}"


def named_packages(interface: Any) -> Iterator[str]:
    """Yield the packages of the messages that an interface contains."""
    for message in [getattr(interface, part, interface) for part in PARTS]:
        for kind in getattr(message, "SLOT_TYPES", ()):
            value = getattr(kind, "value_type", kind)
            if isinstance(value, NamespacedType):
                yield value.namespaces[0]


def write_module(stubs: Path, package: str, kind: str) -> set[str]:
    """Write the stub of one module, such as std_msgs.msg; return the packages that it needs."""
    module = importlib.import_module(f"{package}.{kind}")
    # A name with an underscore is a part of a service or an action.
    interfaces = [(n, c) for n, c in inspect.getmembers(module, inspect.isclass) if "_" not in n]
    needed = {name for _, interface in interfaces for name in named_packages(interface)}
    lines = [HEAD, *(f"import {name}.msg" for name in sorted(needed))]
    lines += [line for name, interface in interfaces for line in interface_stub(interface, name)]
    folder = stubs / package / kind
    folder.mkdir(parents=True)
    (folder / "__init__.pyi").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return needed


def write_packages(stubs: Path, packages: Iterable[str]) -> None:
    """Write the stubs of packages and of those whose messages they contain."""
    waiting, done = set(packages), set[str]()
    while waiting:
        package = waiting.pop()
        done.add(package)
        for kind in KINDS:
            if importlib.util.find_spec(f"{package}.{kind}"):
                waiting |= write_module(stubs, package, kind) - done
        (stubs / package / "__init__.pyi").touch()


def main(stubs: Path = STUBS) -> None:
    """Rewrite all stubs."""
    shutil.rmtree(stubs, ignore_errors=True)
    write_packages(stubs, imported_packages())
    (stubs / "rclpy").symlink_to(Path(rclpy.__file__).parent)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
