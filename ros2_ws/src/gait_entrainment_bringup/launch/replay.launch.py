# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Play a bag to the gait analyzer, at the pace of the record or as fast as possible.

The launch ends once the bag has been played and the analyzer has published all its results.
"""

import math
from pathlib import Path

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from launch.events import Shutdown
from std_srvs.srv import Trigger

from gait_entrainment.settings import Setting
from gait_entrainment_bringup import launch_nodes as shared
from gait_entrainment_bringup.node_list import REPLAY_NODES, replay_parameters
from gait_entrainment_nodes.messaging.client import Client

RATE = Setting("seconds of the bag per second", least=0)


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes once the arguments are known: their parameters depend on the bag."""
    chosen = shared.value(context, "namespace")
    into = shared.full_namespace(context, chosen) if chosen else None
    namespace, given = replay_parameters(Path(shared.value(context, "bag")), into)
    if rate := shared.value(context, "rate"):
        given["bag_player"]["rate"] = RATE.parse("rate", rate)
    place = namespace or "/"
    made = [shared.make_node(context, name, place, given[name]) for name in REPLAY_NODES]

    def finish(client: Client) -> None:
        """Let the analyzer publish its last results, then end the launch."""
        client.call(Trigger, f"{namespace}/gait_analyzer/finish", timeout=math.inf)
        over = Shutdown(reason="the bag is played and analyzed")
        context.asyncio_loop.call_soon_threadsafe(context.emit_event_sync, over)

    finishing = OpaqueFunction(function=shared.in_background, args=[finish])
    ending = shared.ended_by(made, {"bag_player"}, [finishing])
    seen = [*shared.rviz(context, place, given), *shared.page(context, place, given)]
    return [*ending, *seen, *made]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments, then make the nodes."""
    return shared.description(
        nodes,
        ("bag", None, "bag to play: a folder or an .mcap file"),
        ("rate", "", "seconds of the bag per second; 0: as fast as possible; empty: 1"),
        ("namespace", "", "to play into; empty: the recorded one"),
        shared.PARAMETERS_FILE,
        shared.RVIZ,
        shared.SHOW_PAGE,
    )
