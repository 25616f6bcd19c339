# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from the settings of a dataclass, and back."""

from collections.abc import Callable, Collection
from dataclasses import field, fields
from enum import Enum
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from gait_entrainment.settings import Setting, SettingError, settings_of
from gait_entrainment_nodes.nodes.rclpy_internals import given_parameters

_REFUSED = (InvalidParameterValueException, InvalidParameterTypeException)


def texts(meaning: str, *default: str) -> Any:
    """Return a field of a settings dataclass that holds texts; as a parameter it is read-only."""
    return field(default=default, metadata={"texts": meaning})


def declare_settings(
    node: Node, dataclass_type: Any, prefix: str = "", fixed: Collection[str] = ()
) -> None:
    """
    Declare each setting of a dataclass as a parameter, read-only if it is ``fixed``.

    Raises SettingError if a value that the node was started with is not allowed.
    """
    for texts_field in _texts_of(dataclass_type):
        _declare_texts(node, prefix + texts_field.name, texts_field)
    for name, told in settings_of(dataclass_type).items():
        _declare(node, prefix + name, getattr(dataclass_type, name), told, name in fixed)


def read_settings(value: Callable[[str], Any], dataclass_type: Any, prefix: str = "") -> Any:
    """
    Return an instance of a dataclass from the values of its parameters, by their names.

    Raises EntrainmentError if a value is not allowed, or they do not fit each other.
    """
    values: dict[str, Any] = {
        f.name: tuple(text for text in value(prefix + f.name) if text)
        for f in _texts_of(dataclass_type)
    }
    for name, told in settings_of(dataclass_type).items():
        given = value(prefix + name)
        check = told.parse if isinstance(given, str) else told.check
        values[name] = check(prefix + name, given)
    return dataclass_type(**values)


def refuse_unknown_parameters(node: Node) -> None:
    """Raise SettingError if the node was started with a parameter that it does not have."""
    for name in given_parameters(node):
        if not node.has_parameter(name) and not name.startswith("qos_overrides."):
            known = ", ".join(sorted(node.list_parameters([], 0).names))
            raise SettingError(f"{name}: unknown parameter; allowed: {known}")


def _declare(node: Node, name: str, default: Any, told: Setting, fixed: bool) -> None:
    if isinstance(default, Enum):
        default = default.name.lower()
    descriptor = ParameterDescriptor(
        description=f"{told.meaning} [{told.unit}]" if told.unit else told.meaning,
        additional_constraints=told.allowed if isinstance(default, str) else "",
        read_only=fixed,
    )
    if told.kind is int:
        whole = IntegerRange(from_value=int(told.least), to_value=int(told.most))
        descriptor.integer_range = [whole]
    elif told.kind is float:
        real = FloatingPointRange(from_value=float(told.least), to_value=float(told.most))
        descriptor.floating_point_range = [real]
    try:
        node.declare_parameter(name, default, descriptor)
    except _REFUSED:
        given = given_parameters(node)[name]
        told.check(name, given)
        # Whole numbers do for real ones everywhere but in ROS.
        number = f"a number with a decimal point, such as {float(given)!r}"
        raise SettingError(f"{name}: {given!r}; allowed: {number}") from None


def _texts_of(dataclass_type: Any) -> list[Any]:
    return [f for f in fields(dataclass_type) if "texts" in f.metadata]


def _declare_texts(node: Node, name: str, told: Any) -> None:
    descriptor = ParameterDescriptor(description=told.metadata["texts"], read_only=True)
    try:
        # ROS cannot tell the type of an empty list: it holds an empty text, which is left out.
        node.declare_parameter(name, list(told.default) or [""], descriptor)
    except _REFUSED:
        given = given_parameters(node)[name]
        raise SettingError(f"{name}: {given!r}; allowed: a list of texts") from None
