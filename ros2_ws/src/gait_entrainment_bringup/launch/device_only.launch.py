# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Perturbator and gait analyzer, for a real walker with real sensors.

The sensors publish `gait_events`; pulses are requested through `perturbator/deliver_pulse_train`
and promised by `experiment/horizon`, see docs/launch.md. The launch file brings up the
perturbator, and ends with exit code 1 if that fails or if one of the nodes ends.
"""

import math
from functools import partial

from launch import Action, LaunchContext, LaunchDescription
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from gait_entrainment.robot import find_driver
from gait_entrainment_bringup import launch_nodes as shared
from gait_entrainment_nodes.messaging.client import Client

TRANSITIONS = {
    "be configured": Transition.TRANSITION_CONFIGURE,
    "be activated": Transition.TRANSITION_ACTIVATE,
}


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes, and bring up the perturbator in the background."""
    namespace, driver = (shared.value(context, name) for name in ("namespace", "driver"))
    side = shared.choice(context, "side", "left", "right")
    find_driver(driver)  # an unknown driver is reported before a node is started
    arming = {"armed": "arm", "unproved": "unproved"}
    given = {"side": side, "driver": driver}
    given |= {name: shared.is_true(context, argument) for name, argument in arming.items()}
    made = [
        shared.make_node(context, "perturbator", namespace, given),
        shared.make_node(context, "gait_analyzer", namespace, {"side": side}),
    ]
    perturbator = f"{shared.full_namespace(context, namespace).rstrip('/')}/perturbator"
    shared.in_background(context, partial(bring_up, perturbator))
    return [*shared.ended_by(made, set(), []), *made]


def bring_up(perturbator: str, client: Client) -> None:
    """Configure and activate the perturbator; LaunchError if it refuses."""
    service = f"{perturbator}/change_state"
    client.service(ChangeState, service)
    client.wait_to_be_known(perturbator, math.inf)
    for name, number in TRANSITIONS.items():
        request = ChangeState.Request(transition=Transition(id=number))
        answer = client.call(ChangeState, service, request, period=math.inf, timeout=math.inf)
        if not answer.success:
            raise shared.LaunchError(f"perturbator refused to {name}; its log says why")


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments, then make the nodes."""
    return shared.description(
        nodes,
        ("driver", None, "ankle robot: NAME or NAME:OPTION=VALUE,... (entrain driver list)"),
        ("side", "right", "ankle on which the robot sits: left or right"),
        ("arm", "false", "let a real ankle robot deliver torque right away: see safety.md"),
        ("unproved", "false", "even if its own watchdog was not proved on this computer"),
        shared.NAMESPACE,
        shared.PARAMETERS_FILE,
    )
