# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.


"""
Perturbator and gait analyzer, for a real walker with real sensors.

The sensors publish `gait_events`; pulses are asked for by `perturbator/deliver_pulse_train` and
promised by `experiment/horizon`, see docs/launch.md. The launch file brings the perturbator up,
and ends with exit code 1 where that fails or one of the nodes ends.
"""

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessStart
from launch.events import matches_action
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition

from gait_entrainment_nodes.launch_nodes import (
    NAMESPACE,
    PARAMETERS_FILE,
    LaunchError,
    declared,
    ended_by,
    is_true,
    make_node,
    value,
)


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes, and what brings the perturbator up."""
    namespace, side = value(context, "namespace"), value(context, "side")
    perturbator = make_node(
        context,
        "perturbator",
        namespace,
        {"side": side, "driver": value(context, "driver"), "armed": is_true(context, "arm")},
        LifecycleNode,
    )
    analyzer = make_node(context, "gait_analyzer", namespace, {"side": side})

    def change(transition: int) -> EmitEvent:
        this = matches_action(perturbator)
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=this, transition_id=transition))

    def go_on(context: LaunchContext) -> list[Action]:
        start, goal = context.locals.event.start_state, context.locals.event.goal_state
        if (start, goal) == ("configuring", "inactive"):
            return [change(Transition.TRANSITION_ACTIVATE)]
        if start in ("configuring", "activating") and goal != "active":
            raise LaunchError(f"perturbator is {goal} again, not active; its log says why")
        return []

    configure = [change(Transition.TRANSITION_CONFIGURE)]
    return [
        *ended_by([perturbator, analyzer], set(), []),
        RegisterEventHandler(OnProcessStart(target_action=perturbator, on_start=configure)),
        RegisterEventHandler(
            OnStateTransition(
                target_lifecycle_node=perturbator, entities=[OpaqueFunction(function=go_on)]
            )
        ),
        perturbator,
        analyzer,
    ]


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
