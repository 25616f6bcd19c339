# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters from the settings of a dataclass, and back; and what a user says of them."""

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
    """The node was asked what it is and takes: that is the message."""


@dataclass(frozen=True)
class _Texts(Setting):
    """Texts, of which empty ones are left out."""

    kind: type = list
    choices: tuple[str, ...] = ()

    def check(self, name: str, value: Any) -> Any:
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise SettingError(f"{name}: {value!r}; allowed: a list of texts")
        return tuple(text for text in value if text)


def texts(meaning: str, *default: str) -> Any:
    """Return a field of a settings dataclass that holds texts; its parameter cannot change."""
    return field(default=default, metadata={"setting": _Texts(meaning)})


def declare_settings(
    node: Node, dataclass_type: Any, prefix: str = "", fixed: Collection[str] = ()
) -> None:
    """
    Declare each setting of a dataclass as a parameter, read-only if it is ``fixed``.

    Raises SettingError if a value that the node was started with is not allowed.
    """
    for name, told in settings_of(dataclass_type).items():
        default, constraints = getattr(dataclass_type, name), ""
        if isinstance(told, _Texts):
            default = list(default) or [""]  # ROS cannot tell the type of an empty list
        elif isinstance(default, Enum | str):
            default = default if isinstance(default, str) else default.name.lower()
            constraints = told.allowed
        descriptor = ParameterDescriptor(
            description=f"{told.meaning} [{told.unit}]" if told.unit else told.meaning,
            additional_constraints=constraints,
            read_only=name in fixed or isinstance(told, _Texts),
        )
        if told.kind is int:
            whole = IntegerRange(from_value=int(told.least), to_value=int(told.most))
            descriptor.integer_range = [whole]
        elif told.kind is float:
            real = FloatingPointRange(from_value=float(told.least), to_value=float(told.most))
            descriptor.floating_point_range = [real]
        _declare(node, prefix + name, default, descriptor, told)


def read_settings(value: Callable[[str], Any], dataclass_type: Any, prefix: str = "") -> Any:
    """
    Return an instance of a dataclass from the values of its parameters, by their names.

    Raises EntrainmentError if a value is not allowed, or they do not fit each other.
    """
    values = {}
    for name, told in settings_of(dataclass_type).items():
        given = value(prefix + name)
        check = told.parse if isinstance(given, str) else told.check
        values[name] = check(prefix + name, given)
    return dataclass_type(**values)


def warn_of_unknown_parameters(node: Node) -> None:
    """
    Warn of parameters that the node was started with and does not have: files are often shared.

    Raises SettingError for one in a section that is the node's own, such as ``limits``: it can be
    meant for no other, and whoever mistypes a limit is not to go without.
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
        told = ", ".join(name + _alike(name, known) for name in unknown)
        logger.warning(f"unknown parameters are ignored: {told}")


def of_rclpy(name: str) -> bool:
    """Return whether a parameter is one that rclpy makes: a chosen quality of service."""
    return name.startswith(_QUALITY)


def answer_help(node: Node, groups: Iterable[tuple[Any, str]]) -> None:
    """Raise HelpRequestedError if asked to; a group is a settings dataclass and a prefix."""
    if not set(HELP) & set(sys.argv[1:]):
        return
    text = [
        f"usage: {node.get_name()} [--ros-args -p PARAMETER:=VALUE ... --params-file FILE ...]",
        str(sys.modules[type(node).__module__].__doc__).rstrip(),
        "\nparameters:",
    ]
    for dataclass_type, prefix in groups:
        for name, told in settings_of(dataclass_type).items():
            default = getattr(dataclass_type, name)
            default = default.name.lower() if isinstance(default, Enum) else default
            allowed = "a list of texts" if isinstance(told, _Texts) else told.allowed
            text.append(f"  {prefix}{name}: {told.meaning}")
            text.append(f"      {allowed}; default {json.dumps(default)}")
    raise HelpRequestedError("\n".join(text))


def chosen_quality(node: Node, topic: str, end: str, qos: QoSProfile) -> dict[str, Any]:
    """
    Return the quality of one end of a topic, "publisher" or "subscription", for ROS to make it.

    A user chooses by ``qos_overrides.<topic>.<end>.<policy>``. Raises SettingError, or later while
    the end is made, if a run does not allow it: what it depends on, or is judged by, is not to get
    lost.
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
    """Warn of chosen qualities that no end of a topic has taken, once all have been made."""
    given = [name for name in given_parameters(node) if of_rclpy(name)]
    if unused := [name for name in given if not node.has_parameter(name)]:
        logger: Any = node.get_logger()
        logger.warning(
            f"qualities of service that this node does not take: {', '.join(unused)}; it takes "
            f"{_QUALITY}<full name of a topic>.publisher or .subscription, then .history, .depth "
            "or .reliability"
        )


def _alike(name: str, known: list[str]) -> str:
    """Return the parameter that may have been meant, as a question behind the name."""
    import difflib  # here, since few need it

    alike = difflib.get_close_matches(name, known, n=1)
    return f" ({alike[0]}?)" if alike else ""


def _declare(
    node: Node, name: str, default: Any, descriptor: ParameterDescriptor, told: Setting
) -> None:
    given = given_parameters(node).get(name, default)
    # A whole number does for a real one everywhere, but not to ROS.
    whole = told.kind is float and isinstance(given, int) and not isinstance(given, bool)
    if whole:
        default = told.check(name, given)
    try:
        node.declare_parameter(name, default, descriptor, ignore_override=whole)
    except (InvalidParameterValueException, InvalidParameterTypeException):
        told.check(name, given)
        raise
