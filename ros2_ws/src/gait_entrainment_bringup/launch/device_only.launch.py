# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0


"""
Perturbator and gait analyzer, for a real walker with real sensors.

The sensors publish `gait_events`; pulses are asked for by `perturbator/deliver_pulse_train` and
promised by `experiment/horizon`, see docs/launch.md. The launch file brings the perturbator up,
and ends with exit code 1 where that fails or one of the nodes ends.
"""

from functools import partial
from typing import Any

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from launch_ros.ros_adapters import get_ros_node
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState

from gait_entrainment_bringup.launch_nodes import (
    NAMESPACE,
    PARAMETERS_FILE,
    LaunchError,
    answer_of,
    declared,
    ended_by,
    full_namespace,
    in_background,
    is_true,
    make_node,
    value,
)

TRANSITIONS = {
    "be configured": Transition.TRANSITION_CONFIGURE,
    "be activated": Transition.TRANSITION_ACTIVATE,
}


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes, and bring the perturbator up meanwhile."""
    namespace, side = value(context, "namespace"), value(context, "side")
    given = {"side": side, "driver": value(context, "driver"), "armed": is_true(context, "arm")}
    made = [
        make_node(context, "perturbator", namespace, given),
        make_node(context, "gait_analyzer", namespace, {"side": side}),
    ]
    perturbator = f"{full_namespace(context, namespace).rstrip('/')}/perturbator"
    node = get_ros_node(context)
    change = node.create_client(ChangeState, f"{perturbator}/change_state")
    state = node.create_client(GetState, f"{perturbator}/get_state")
    in_background(context, partial(bring_up, context, change, state))
    return [*ended_by(made, set(), []), *made]


def bring_up(context: LaunchContext, change: Any, state: Any) -> None:
    """Configure and activate the perturbator; LaunchError where it refuses."""
    answer_of(context, state, GetState.Request(), again=True)
    for name, number in TRANSITIONS.items():
        request = ChangeState.Request(transition=Transition(id=number))
        answer = answer_of(context, change, request, again=False)
        if answer is None:
            return
        if not answer.success:
            raise LaunchError(f"perturbator refused to {name}; its log says why")


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments, then make the nodes."""
    return LaunchDescription(
        [
            *declared(
                (
                    "driver",
                    None,
                    "ankle robot: NAME or NAME:OPTION=VALUE,... (entrain driver list)",
                ),
                ("side", "right", "ankle on which the robot sits: left or right"),
                ("arm", "false", "let a real ankle robot deliver torque at once: see safety.md"),
                NAMESPACE,
                PARAMETERS_FILE,
            ),
            OpaqueFunction(function=nodes),
        ]
    )
