# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from the settings of a dataclass, and back."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import fields
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from gait_entrainment.conventions import Side
from gait_entrainment.settings import SettingError, setting, settings_of
from gait_entrainment_nodes.nodes.rclpy_internals import given_parameters


def side_setting(meaning: str) -> Any:
    """Return a field of a dataclass that names a leg; ``side_of`` reads it."""
    return setting("right", meaning, choices=("left", "right"))


def side_of(name: str) -> Side:
    """Return the side that a setting names."""
    return Side[name.upper()]


def declare_settings(
    node: Node, dataclass_type: Any, prefix: str = "", fixed: Collection[str] = ()
) -> None:
    """
    Declare each field of a dataclass as a parameter, with its meaning, unit and range.

    Those that are ``fixed`` are read-only.

    Raises
    ------
    SettingError
        if a value that the node was started with is not allowed.

    """
    for field in fields(dataclass_type):
        told, name = field.metadata["setting"], prefix + field.name
        descriptor = ParameterDescriptor(
            description=f"{told.meaning} [{told.unit}]" if told.unit else told.meaning,
            additional_constraints=", ".join(told.choices),
            read_only=field.name in fixed,
        )
        if told.kind is int:
            descriptor.integer_range = [
                IntegerRange(from_value=int(told.least), to_value=int(told.most))
            ]
        elif told.kind is float:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(told.least), to_value=float(told.most))
            ]
        try:
            node.declare_parameter(name, field.default, descriptor)
        except (InvalidParameterValueException, InvalidParameterTypeException):
            given = given_parameters(node)[name]
            told.check(name, given)
            # Whole numbers do for real ones everywhere but in ROS.
            raise SettingError(
                f"{name}: {given!r}; allowed: a number with a decimal point, such as "
                f"{float(given)!r}"
            ) from None


def declare_texts(
    node: Node, name: str, meaning: str, default: Sequence[str] = ()
) -> tuple[str, ...]:
    """Declare a read-only parameter that holds texts and return its value; "" is left out."""
    # ROS cannot tell the type of an empty list.
    default = list(default) or [""]
    try:
        descriptor = ParameterDescriptor(description=meaning, read_only=True)
        texts = node.declare_parameter(name, default, descriptor).value
    except InvalidParameterTypeException:
        given = given_parameters(node)[name]
        raise SettingError(f"{name}: {given!r}; allowed: a list of texts") from None
    return tuple(text for text in texts if text)


def read_settings(value: Callable[[str], Any], dataclass_type: Any, prefix: str = "") -> Any:
    """
    Return an instance of a dataclass from the values of its parameters, by their names.

    Raises
    ------
    ValueError
        if a value is not allowed, or they do not fit each other.

    """
    return dataclass_type(
        **{
            name: told.check(prefix + name, value(prefix + name))
            for name, told in settings_of(dataclass_type).items()
        }
    )


def refuse_unknown_parameters(node: Node) -> None:
    """Raise SettingError if the node was started with a parameter that it does not have."""
    for name in given_parameters(node):
        if not node.has_parameter(name) and not name.startswith("qos_overrides."):
            known = ", ".join(sorted(node.list_parameters([], 0).names))
            raise SettingError(f"{name}: unknown parameter; allowed: {known}")
