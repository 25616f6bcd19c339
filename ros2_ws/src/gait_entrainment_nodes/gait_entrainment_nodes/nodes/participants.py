# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The nodes that take part in an experiment: whether all of them run and hear each other."""

from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.nodes.experiment_run import RECORDER, ExperimentError
from gait_entrainment_nodes.nodes.waiting import Waiting

# A participant that has not answered is asked again after this long [s].
ASK_AGAIN = 0.5


class Participants:
    """
    The participants of an experiment before a run.

    Parameters
    ----------
    node
        The experiment, whose other clients have been made: discovery announces clients in the
        order in which they were made, so a participant that answers here knows all of them.
    names
        Of the participants, in the experiment's namespace: any nodes that offer ``~/ready``.
    waiting
        What the experiment's coroutines wait with.

    """

    def __init__(self, node: Node, names: Sequence[str], waiting: Waiting) -> None:
        self.names = tuple(names)
        self._node, self._waiting = node, waiting
        self._clients = {name: node.create_client(Ready, f"{name}/ready") for name in names}

    async def check(self) -> None:
        """Raise ExperimentError if a participant is not ready: who, and what it waits for."""
        here = self._node.get_namespace()
        nodes = self._node.get_node_names_and_namespaces()
        for name, client in self._clients.items():
            if not client.service_is_ready():
                raise ExperimentError(f"{name} does not answer", name)
            if nodes.count((name, here)) > 1:
                raise ExperimentError(
                    f"there are two {name} in {here}: another experiment runs here; choose "
                    "another namespace or ROS_DOMAIN_ID",
                    name,
                )
        if RECORDER in self.names:
            for topic in self.not_recorded():
                raise ExperimentError(f"{RECORDER} has not subscribed to {topic}", RECORDER)
        for name, client in self._clients.items():
            # An answer may be lost, as long as the participant does not know who asked.
            answer = client.call_async(Ready.Request())
            silence = ExperimentError(f"{name} does not answer", name)
            await self._waiting.until(answer.done, ASK_AGAIN, silence)
            state = answer.result()
            if not state.ready:
                raise ExperimentError(f"{name} waits for {state.waiting_for}", name)
            # Discovery may have told this node of more subscriptions than that one.
            for topic, matched in zip(state.topics, state.matched, strict=True):
                if matched < self._node.count_subscribers(topic):
                    raise ExperimentError(f"{name} waits for subscriptions of {topic}", name)

    def not_recorded(self) -> list[str]:
        """Return the topics of participants that the recorder has not subscribed to."""
        here = self._node.get_namespace()
        beneath = here.rstrip("/") + "/"
        recorder = (here, RECORDER)
        publishers = {(here, name) for name in (*self.names, self._node.get_name())} - {recorder}

        def nodes(ends: Sequence[Any]) -> set[tuple[str, str]]:
            return {(end.node_namespace, end.node_name) for end in ends}

        return [
            name
            for name, _ in self._node.get_topic_names_and_types()
            if name.startswith(beneath)
            and "/_" not in name
            and publishers & nodes(self._node.get_publishers_info_by_topic(name))
            and recorder not in nodes(self._node.get_subscriptions_info_by_topic(name))
        ]
