# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from the settings of a dataclass, and back."""

from collections.abc import Callable, Collection, Sequence
from enum import Enum
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from gait_entrainment.settings import Setting, SettingError, settings_of
from gait_entrainment_nodes.nodes.rclpy_internals import given_parameters


def declare_settings(
    node: Node, dataclass_type: Any, prefix: str = "", fixed: Collection[str] = ()
) -> None:
    """
    Declare each setting of a dataclass as a parameter, read-only if it is ``fixed``.

    Raises SettingError if a value that the node was started with is not allowed.
    """
    for name, told in settings_of(dataclass_type).items():
        default = getattr(dataclass_type, name)
        if isinstance(default, Enum):
            default = default.name.lower()
        descriptor = ParameterDescriptor(
            description=f"{told.meaning} [{told.unit}]" if told.unit else told.meaning,
            additional_constraints=told.allowed if isinstance(default, str) else "",
            read_only=name in fixed,
        )
        if told.kind is int:
            whole = IntegerRange(from_value=int(told.least), to_value=int(told.most))
            descriptor.integer_range = [whole]
        elif told.kind is float:
            real = FloatingPointRange(from_value=float(told.least), to_value=float(told.most))
            descriptor.floating_point_range = [real]
        _declare(node, prefix + name, default, descriptor, told)


def declare_texts(
    node: Node, name: str, meaning: str, default: Sequence[str] = ()
) -> tuple[str, ...]:
    """Declare a read-only parameter that holds texts and return its value; "" is left out."""
    descriptor = ParameterDescriptor(description=meaning, read_only=True)
    # ROS cannot tell the type of an empty list.
    _declare(node, name, list(default) or [""], descriptor, None)
    return tuple(text for text in node.get_parameter(name).value if text)


def read_settings(value: Callable[[str], Any], dataclass_type: Any, prefix: str = "") -> Any:
    """
    Return an instance of a dataclass from the values of its parameters, by their names.

    Raises ValueError if a value is not allowed, or they do not fit each other.
    """
    values = {}
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


def _declare(
    node: Node, name: str, default: Any, descriptor: ParameterDescriptor, told: Setting | None
) -> None:
    try:
        node.declare_parameter(name, default, descriptor)
    except (InvalidParameterValueException, InvalidParameterTypeException):
        given = given_parameters(node)[name]
        if told is None:
            allowed = "a list of texts"
        else:
            told.check(name, given)
            # Whole numbers do for real ones everywhere but in ROS.
            allowed = f"a number with a decimal point, such as {float(given)!r}"
        raise SettingError(f"{name}: {given!r}; allowed: {allowed}") from None
