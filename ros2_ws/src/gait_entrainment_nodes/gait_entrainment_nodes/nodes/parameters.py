# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from the settings of a dataclass and back, with help and warnings for users."""

import copy
import json
import sys
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from gait_entrainment.settings import Setting, SettingError, settings_of
from gait_entrainment_nodes.messaging.topics import HEARTBEAT, VIEWED
from gait_entrainment_nodes.nodes.rclpy_internals import given_parameters

HELP = ("-h", "--help")
_QUALITY = "qos_overrides."


class HelpRequestedError(Exception):
    """Help was requested; the message is the help text."""


@dataclass(frozen=True)
class _Texts(Setting):
    """A list of strings, of which empty ones are dropped."""

    kind: type = list
    choices: tuple[str, ...] = ()

    def check(self, name: str, value: Any) -> Any:
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise SettingError(f"{name}: {value!r}; allowed: a list of strings")
        return tuple(text for text in value if text)


def texts(meaning: str, *default: str) -> Any:
    """Return a field of a settings dataclass for strings; its parameter is read-only."""
    return field(default=default, metadata={"setting": _Texts(meaning)})


def declare_settings(
    node: Node, dataclass_type: Any, prefix: str = "", fixed: Collection[str] = ()
) -> None:
    """
    Declare each setting of a dataclass as a parameter, read-only if it is ``fixed``.

    Raises SettingError if a value that the node was started with is not allowed.
    """
    for name, setting in settings_of(dataclass_type).items():
        default, constraints = getattr(dataclass_type, name), ""
        if isinstance(setting, _Texts):
            default = list(default) or [""]  # ROS cannot tell the type of an empty list
        elif isinstance(default, Enum | str):
            default = default if isinstance(default, str) else default.name.lower()
            constraints = setting.allowed
        descriptor = ParameterDescriptor(
            description=setting.meaning + (f" [{setting.unit}]" if setting.unit else ""),
            additional_constraints=constraints,
            read_only=name in fixed or isinstance(setting, _Texts),
        )
        least, most = setting.least, setting.most
        if setting.kind is int:
            integers = IntegerRange(from_value=int(least), to_value=int(most))
            descriptor.integer_range = [integers]
        elif setting.kind is float:
            floats = FloatingPointRange(from_value=float(least), to_value=float(most))
            descriptor.floating_point_range = [floats]
        _declare(node, prefix + name, default, descriptor, setting)


def read_settings(value: Callable[[str], Any], dataclass_type: Any, prefix: str = "") -> Any:
    """
    Return an instance of a settings dataclass from the values of its parameters.

    Raises EntrainmentError if a value is not allowed, or if the values are inconsistent.
    """
    values = {}
    for name, setting in settings_of(dataclass_type).items():
        given = value(prefix + name)
        check = setting.parse if isinstance(given, str) else setting.check
        values[name] = check(prefix + name, given)
    return dataclass_type(**values)


def warn_of_unknown_parameters(node: Node) -> None:
    """
    Warn about given parameters that the node does not have: parameter files are often shared.

    Raises SettingError for one in a section that is the node's own, such as ``limits``: it cannot
    be meant for another node, and a mistyped limit must not go unnoticed.
    """
    known = [name for name in node.list_parameters([], 0).names if not of_rclpy(name)]
    sections = {name.rpartition(".")[0] for name in known} - {""}
    given = (name for name in given_parameters(node) if not of_rclpy(name))
    unknown = [name for name in given if not node.has_parameter(name)]
    for name in unknown:
        if (section := name.rpartition(".")[0]) in sections:
            allowed = ", ".join(sorted(n for n in known if n.startswith(f"{section}.")))
            raise SettingError(f"{name}: unknown parameter; allowed: {allowed}")
    if unknown:
        logger: Any = node.get_logger()
        names = ", ".join(name + _alike(name, known) for name in unknown)
        logger.warning(f"unknown parameters are ignored: {names}")


def of_rclpy(name: str) -> bool:
    """Return whether rclpy declares a parameter itself: an override of a quality of service."""
    return name.startswith(_QUALITY)


def answer_help(node: Node, groups: Iterable[tuple[Any, str]]) -> None:
    """Raise HelpRequestedError if requested; a group is a settings dataclass and a prefix."""
    if not set(HELP) & set(sys.argv[1:]):
        return
    text = [
        f"usage: {node.get_name()} [--ros-args -p PARAMETER:=VALUE ... --params-file FILE ...]",
        str(sys.modules[type(node).__module__].__doc__).rstrip(),
        "\nparameters:",
    ]
    for dataclass_type, prefix in groups:
        for name, setting in settings_of(dataclass_type).items():
            default = getattr(dataclass_type, name)
            default = default.name.lower() if isinstance(default, Enum) else default
            allowed = "a list of strings" if isinstance(setting, _Texts) else setting.allowed
            text.append(f"  {prefix}{name}: {setting.meaning}")
            text.append(f"      {allowed}; default {json.dumps(default)}")
    raise HelpRequestedError("\n".join(text))


def chosen_quality(node: Node, topic: str, end: str, qos: QoSProfile) -> dict[str, Any]:
    """
    Return the arguments that give one end of a topic, "publisher" or "subscription", its quality.

    Users override it with ``qos_overrides.<topic>.<end>.<policy>``. Creating the end then raises
    SettingError if a run does not allow that: what it depends on or is judged by must not be lost.
    """
    prefix = f"{_QUALITY}{node.resolve_topic_name(topic)}.{end}"
    if not any(name.startswith(f"{prefix}.") for name in given_parameters(node)):
        return {"qos_profile": qos}

    def check(chosen: QoSProfile) -> SetParametersResult:
        kept = chosen.history == qos.history and chosen.reliability == qos.reliability
        if qos not in (VIEWED, HEARTBEAT) and not (kept and chosen.depth >= qos.depth):
            history, reliability = qos.history.name.lower(), qos.reliability.name.lower()
            raise SettingError(
                f"{prefix}: is refused: a run depends on this topic or is judged by it; allowed: "
                f"history {history}, reliability {reliability}, depth at least {qos.depth}"
            )
        return SetParametersResult(successful=True)

    options = QoSOverridingOptions.with_default_policies(callback=check)
    return {"qos_profile": copy.copy(qos), "qos_overriding_options": options}


def warn_of_unused_quality(node: Node) -> None:
    """Warn about overridden qualities of no publisher or subscription; call when all exist."""
    given = [name for name in given_parameters(node) if of_rclpy(name)]
    if unused := [name for name in given if not node.has_parameter(name)]:
        logger: Any = node.get_logger()
        logger.warning(
            f"quality of service that this node does not take: {', '.join(unused)}; it takes "
            f"{_QUALITY}<full topic name>.publisher or .subscription, then .history, .depth or "
            ".reliability"
        )


def _alike(name: str, known: list[str]) -> str:
    """Return a suggestion of the parameter that may have been meant, to append to the name."""
    import difflib  # here, because it is rarely needed

    alike = difflib.get_close_matches(name, known, n=1)
    return f" ({alike[0]}?)" if alike else ""


def _declare(
    node: Node, name: str, default: Any, descriptor: ParameterDescriptor, setting: Setting
) -> None:
    given = given_parameters(node).get(name, default)
    # An integer is accepted for a float everywhere except in ROS.
    as_float = setting.kind is float and isinstance(given, int) and not isinstance(given, bool)
    if as_float:
        default = setting.check(name, given)
    try:
        node.declare_parameter(name, default, descriptor, ignore_override=as_float)
    except (InvalidParameterValueException, InvalidParameterTypeException):
        setting.check(name, given)
        raise
