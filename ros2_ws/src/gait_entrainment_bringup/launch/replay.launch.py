# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Play a bag to the gait analyzer, at the pace of the record or as fast as it goes.

The launch ends once the bag is played and the analyzer has published all that it makes of it.
"""

import math
from pathlib import Path

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from launch.events import Shutdown
from std_srvs.srv import Trigger

from gait_entrainment_bringup.launch_nodes import (
    PARAMETERS_FILE,
    RVIZ,
    declared,
    ended_by,
    full_namespace,
    in_background,
    make_node,
    rviz,
    value,
)
from gait_entrainment_bringup.node_list import REPLAY_NODES, replay_parameters
from gait_entrainment_nodes.messaging.client import Client


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes once the arguments are known: the bag says what they are given."""
    chosen = value(context, "namespace")
    namespace, given = replay_parameters(
        Path(value(context, "bag")), full_namespace(context, chosen) if chosen else None
    )
    if value(context, "rate"):
        given["bag_player"]["rate"] = float(value(context, "rate"))
    made = [make_node(context, name, namespace or "/", given[name]) for name in REPLAY_NODES]

    def finish(client: Client) -> None:
        """Let the analyzer publish its last word, then end the launch."""
        client.call(Trigger, f"{namespace}/gait_analyzer/finish", patience=math.inf)
        over = Shutdown(reason="the bag is played and analyzed")
        context.asyncio_loop.call_soon_threadsafe(context.emit_event_sync, over)

    last_word = OpaqueFunction(function=in_background, args=[finish])

    return [
        *ended_by(made, {"bag_player"}, [last_word]),
        *rviz(context, namespace or "/", given),
        *made,
    ]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments, then make the nodes."""
    return LaunchDescription(
        [
            *declared(
                ("bag", None, "bag to play: a folder or an .mcap file"),
                ("rate", "", "seconds of the bag per second; 0: as fast as it goes; empty: 1"),
                ("namespace", "", "to play into; empty: the one that was recorded"),
                PARAMETERS_FILE,
                RVIZ,
            ),
            OpaqueFunction(function=nodes),
        ]
    )
