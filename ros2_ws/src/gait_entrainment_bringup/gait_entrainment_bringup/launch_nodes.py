# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the launch files share: arguments, nodes in a namespace, and how a launch ends."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
)
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.utilities import make_namespace_absolute, prefix_namespace

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_bringup.node_list import DISPLAY, MOVED, PAGE, Parameters, settings_file
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.environment import PACKAGE, dds_variables, shared_file

# Argument of a launch file: name, default (None if it must be given), what --show-args shows.
Argument = tuple[str, str | None, str]
NAMESPACE: Argument = ("namespace", "", "of all nodes and topics, to run several side by side")
PARAMETERS_FILE: Argument = ("params_file", str(settings_file()), "values for the nodes (YAML)")
SHOW_PAGE: Argument = ("page", "false", "serve the operator's page: true or false")
RVIZ: Argument = ("rviz", "false", "show the walker in RViz: true or false")


class LaunchError(EntrainmentError):
    """The launch ends with exit code 1; the message says why."""


class _OverError(Exception):
    """The launch has already ended."""


def description(
    nodes: Callable[[LaunchContext], list[Action]], *arguments: Argument
) -> LaunchDescription:
    """
    Describe a launch that makes nodes once the arguments are known.

    A launch file without the argument ``real_time`` runs in real time.
    """

    def make(context: LaunchContext) -> list[Action]:
        real_time = context.launch_configurations.get("real_time", "true").lower() == "true"
        chosen = dds_variables(real_time=real_time).items()
        return [*(SetEnvironmentVariable(*pair) for pair in chosen), *nodes(context)]

    declared = (DeclareLaunchArgument(n, default_value=d, description=t) for n, d, t in arguments)
    return LaunchDescription([*declared, OpaqueFunction(function=make)])


def value(context: LaunchContext, name: str) -> str:
    """Return the value of an argument."""
    return str(LaunchConfiguration(name).perform(context))


def choice(context: LaunchContext, name: str, *allowed: str) -> str:
    """Return the value of an argument; LaunchError if it is not one of those allowed."""
    if (text := value(context, name).lower()) not in allowed:
        raise LaunchError(f"{name}: {text!r}; allowed: {', '.join(allowed)}")
    return text


def is_true(context: LaunchContext, name: str) -> bool:
    """Return the value of an argument; LaunchError if it is neither true nor false."""
    return choice(context, name, "true", "false") == "true"


def full_namespace(context: LaunchContext, namespace: str) -> str:
    """Return the absolute namespace, below those that including launch files push."""
    pushed = context.launch_configurations.get("ros_namespace")
    return str(make_namespace_absolute(prefix_namespace(pushed, namespace)) or "/")


def make_node(
    context: LaunchContext, name: str, namespace: str, given: dict[str, Any], **options: Any
) -> Node:
    """Return the action that runs a node; ``given`` wins over the parameter file."""
    file = value(context, "params_file")
    if not Path(file).is_file():  # launch_ros would ignore that
        raise LaunchError(f"params_file: {file}: no such file")
    # A string stays a string even if it looks like YAML, as a protocol does.
    typed = {
        key: ParameterValue(item, value_type=str) if isinstance(item, str) else item
        for key, item in given.items()
    }
    rooted = full_namespace(context, namespace) == "/"
    return Node(
        **{"package": PACKAGE, "executable": name, "output": "screen"} | options,
        name=name,
        namespace=namespace,
        parameters=[file, typed],
        remappings=[] if rooted else [(topic, topic[1:]) for topic in MOVED],
    )


def rviz(context: LaunchContext, namespace: str, given: Parameters) -> list[Action]:
    """Return RViz, if requested, and the node that draws the walker, if it has parameters."""
    if not is_true(context, "rviz"):
        return []
    picture = shared_file("gait_entrainment_bringup", "rviz/walker.rviz")
    program = {"package": "rviz2", "executable": "rviz2", "arguments": ["-d", str(picture)]}
    time = {"use_sim_time": given["gait_analyzer"]["use_sim_time"]}
    drawing = [DISPLAY] if DISPLAY in given else []
    return [
        *(make_node(context, name, namespace, given[name]) for name in drawing),
        make_node(context, "rviz", namespace, time, **program),
    ]


def page(context: LaunchContext, namespace: str, given: Parameters) -> list[Action]:
    """Return the operator's page, if requested; the launch does not end with it."""
    if not is_true(context, "page"):
        return []
    package = {"package": "gait_entrainment_page"}
    return [make_node(context, PAGE, namespace, given[PAGE], **package)]


def in_background(context: LaunchContext, work: Callable[[Client], None]) -> None:
    """Run ``work`` in a thread while the launch lasts; an exception ends it with exit code 1."""

    def go_on() -> None:
        if context.is_shutdown:
            raise _OverError

    def do() -> None:
        with suppress(_OverError), Client("launch_client", each_round=go_on) as client:
            work(client)

    context.add_completion_future(context.asyncio_loop.run_in_executor(None, do))


def ended_by(
    nodes: list[Node], last: set[str], over: list[Action], bag: Path | None = None
) -> list[Action]:
    """
    Return the handlers that end the launch with its nodes.

    Nodes in ``last`` end by themselves; once all of them have exited with 0, ``over`` is executed.
    If any other node ends, or a node exits with another code, the launch ends with exit code 1.
    If it ends early, it prints the path of the ``bag`` that was being recorded, if any.
    """
    waited_for = set(last)

    def on_exit(event: ProcessExited, context: LaunchContext) -> list[Action]:
        if context.is_shutdown:
            return []
        name = event.process_name.rpartition("-")[0]
        if event.returncode != 0 or name not in last:
            # Only an exception sets the exit code of launch, which prints it in one line.
            raise LaunchError(f"{name} ended with exit code {event.returncode}")
        waited_for.discard(name)
        return [] if waited_for else over

    def on_shutdown(*_: Any) -> Action | None:
        kept = bag is not None and bag.exists() and waited_for
        return LogInfo(msg=f"the bag of the run so far is {bag}") if kept else None

    exits = [OnProcessExit(target_action=node, on_exit=on_exit) for node in nodes]
    return [*map(RegisterEventHandler, (*exits, OnShutdown(on_shutdown=on_shutdown)))]
