# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0


"""What the launch files share: arguments, nodes in a namespace, and how a launch ends."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from launch import Action, LaunchContext
from launch.actions import DeclareLaunchArgument, RegisterEventHandler, SetEnvironmentVariable
from launch.event_handlers import OnProcessExit
from launch.events.process import ProcessExited
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.utilities import make_namespace_absolute, prefix_namespace

from gait_entrainment_bringup.node_list import DISPLAY, MOVED, settings_file
from gait_entrainment_nodes.messaging.environment import PACKAGE, fastdds_profiles, shared_file

# Argument of a launch file: name, default (None where it must be given), what --show-args tells.
Argument = tuple[str, str | None, str]
NAMESPACE: Argument = ("namespace", "", "of all nodes and topics, for several side by side")
PARAMETERS_FILE: Argument = (
    "params_file",
    str(settings_file()),
    "what may be set of the nodes (YAML)",
)
RVIZ: Argument = ("rviz", "false", "show the walker in RViz: true or false")

# How often a service is asked again [s].
ASKING_PERIOD = 0.25


class LaunchError(Exception):
    """The launch ends with exit code 1; the message says why."""


def declared(*arguments: Argument) -> list[Action]:
    """
    Declare arguments of a launch file.

    Fast DDS gets the shared memory that a lock-step run needs, unless the user has a profile.
    """
    profile = "FASTRTPS_DEFAULT_PROFILES_FILE"
    own = str(fastdds_profiles())
    return [
        *(
            DeclareLaunchArgument(name, default_value=default, description=text)
            for name, default, text in arguments
        ),
        SetEnvironmentVariable(profile, EnvironmentVariable(profile, default_value=own)),
    ]


def value(context: LaunchContext, name: str) -> str:
    """Return the value of an argument."""
    return str(LaunchConfiguration(name).perform(context))


def is_true(context: LaunchContext, name: str) -> bool:
    """Return the value of an argument; LaunchError where it is neither true nor false."""
    text = value(context, name).lower()
    if text not in ("true", "false"):
        raise LaunchError(f"{name}: {text!r}; allowed: true, false")
    return text == "true"


def full_namespace(context: LaunchContext, namespace: str) -> str:
    """Return a namespace from the root on, as launch files that include this one push it."""
    pushed = context.launch_configurations.get("ros_namespace")
    return str(make_namespace_absolute(prefix_namespace(pushed, namespace)) or "/")


def make_node(
    context: LaunchContext,
    name: str,
    namespace: str,
    given: dict[str, Any],
    **options: Any,
) -> Node:
    """
    Return the action that runs a node; what is given wins over the file of parameters.

    Raises LaunchError where that file is not there: launch_ros would go on without it.
    """
    file = value(context, "params_file")
    if not Path(file).is_file():
        raise LaunchError(f"params_file: {file}: no such file")
    # Text stays text, also where it reads like YAML, as a protocol does.
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


def rviz(context: LaunchContext, namespace: str, given: dict[str, Any]) -> list[Action]:
    """
    Return RViz, where it is wanted, and the node that draws the walker.

    ``given`` holds parameters by node name; without those of the display, something else draws.
    """
    if not is_true(context, "rviz"):
        return []
    picture = shared_file("gait_entrainment_bringup", "rviz/walker.rviz")
    viewer = make_node(
        context,
        "rviz",
        namespace,
        {"use_sim_time": given["gait_analyzer"]["use_sim_time"]},
        package="rviz2",
        executable="rviz2",
        arguments=["-d", str(picture)],
    )
    if DISPLAY not in given:
        return [viewer]
    return [make_node(context, DISPLAY, namespace, given[DISPLAY]), viewer]


def in_background(context: LaunchContext, work: Callable[[], None]) -> None:
    """Do work in a thread; an exception in it ends the launch with exit code 1."""
    context.add_completion_future(context.asyncio_loop.run_in_executor(None, work))


def answer_of(context: LaunchContext, client: Any, request: Any, *, again: bool) -> Any:
    """
    Wait for the answer of a service; None where the launch ends before it comes.

    ``again``: ask again and again, since an answer is lost where the node does not know the client
    yet. Whoever has answered once knows all clients that were made before that one.
    """
    answered: threading.Event | None = None
    while not context.is_shutdown:
        if answered is None or again:
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _, answered=answered: answered.set())
        if answered.wait(ASKING_PERIOD):
            return future.result()
    return None


def ended_by(nodes: list[Node], last: set[str], over: list[Action]) -> list[Action]:
    """
    Return the handlers that end the launch with its nodes.

    Parameters
    ----------
    nodes
        None of them may end with another exit code than 0: the launch then ends with 1, and so it
        does where one ends that should stay.
    last
        Names of the nodes that end by themselves.
    over
        What to do once all of these have ended well.

    """
    waited_for = set(last)

    def on_exit(event: ProcessExited, context: LaunchContext) -> list[Action]:
        if context.is_shutdown:
            return []
        name = event.process_name.rpartition("-")[0]
        if event.returncode != 0 or name not in last:
            # launch has no other way to an exit code than an exception, which it tells in a line.
            raise LaunchError(f"{name} ended with exit code {event.returncode}")
        waited_for.discard(name)
        return [] if waited_for else over

    return [
        RegisterEventHandler(OnProcessExit(target_action=node, on_exit=on_exit)) for node in nodes
    ]
