# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Perturbator and gait analyzer, for a real walker with real sensors.

The sensors publish `gait_events`; pulses are asked for by `perturbator/deliver_pulse_train` and
promised by `experiment/horizon`, see docs/launch.md. The launch file brings the perturbator up,
and ends with exit code 1 if that fails or one of the nodes ends.
"""

import math
from functools import partial

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from gait_entrainment_bringup.launch_nodes import (
    NAMESPACE,
    PARAMETERS_FILE,
    LaunchError,
    declared,
    ended_by,
    full_namespace,
    in_background,
    is_true,
    make_node,
    value,
)
from gait_entrainment_nodes.messaging.client import Client

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
    in_background(context, partial(bring_up, perturbator))
    return [*ended_by(made, set(), []), *made]


def bring_up(perturbator: str, client: Client) -> None:
    """Configure and activate the perturbator; LaunchError if it refuses."""
    service = f"{perturbator}/change_state"
    client.service(ChangeState, service)
    client.wait_to_be_known(perturbator, math.inf)
    for name, number in TRANSITIONS.items():
        request = ChangeState.Request(transition=Transition(id=number))
        answer = client.call(ChangeState, service, request, period=math.inf, patience=math.inf)
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
