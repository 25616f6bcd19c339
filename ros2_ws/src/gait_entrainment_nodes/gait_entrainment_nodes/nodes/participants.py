# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The nodes that take part in an experiment: whether all of them run, and hear each other."""

import json
from collections.abc import Sequence

from rclpy.node import Node
from std_srvs.srv import Trigger

from gait_entrainment_nodes.nodes.waiting import OverdueError, Waiting

# After so long [s] a participant is asked anew whether it is ready.
ASK_AGAIN = 0.5
RECORDER = "bag_recorder"


class Participants:
    """
    Looks after the participants of an experiment before a run.

    Parameters
    ----------
    node
        The experiment, behind whose other clients this makes its own: who has answered here knows
        all of them, since discovery goes in the order in which they were made.
    names
        Of the participants, in the experiment's namespace: any nodes that offer ``~/ready``.
    waiting
        What the experiment's coroutines wait with.

    """

    def __init__(self, node: Node, names: Sequence[str], waiting: Waiting) -> None:
        self.names = tuple(names)
        self._node, self._waiting = node, waiting
        self._clients = {name: node.create_client(Trigger, f"{name}/ready") for name in names}

    async def not_ready(self) -> str:
        """Return who is waited for, and for what; an empty text once all are ready."""
        here = self._node.get_namespace()
        nodes = self._node.get_node_names_and_namespaces()
        for name, client in self._clients.items():
            if not client.service_is_ready():
                return f"{name} does not answer"
            if nodes.count((name, here)) > 1:
                return (
                    f"there are two {name} in {here}: another experiment runs here; choose "
                    "another namespace or ROS_DOMAIN_ID"
                )
        if RECORDER in self.names:
            for topic in self.not_recorded():
                return f"{RECORDER} has not subscribed to {topic}"
        for name, client in self._clients.items():
            # An answer may be lost, as long as the participant does not know who asked.
            try:
                response = await self._waiting.within(
                    client.call_async(Trigger.Request()), f"{name} does not answer", ASK_AGAIN
                )
            except OverdueError as silence:
                return str(silence)
            if not response.success:
                return f"{name} waits for {response.message}"
            for topic in self.reaching_too_few(response.message):
                return f"{name} waits for subscriptions of {topic}"
        return ""

    def not_recorded(self) -> list[str]:
        """Return the topics of participants that the recorder has not subscribed to."""
        here = self._node.get_namespace()
        beneath = here.rstrip("/") + "/"
        recorder = (here, RECORDER)
        publishers = {(here, name) for name in (*self.names, self._node.get_name())} - {recorder}
        missing = []
        for name, _ in self._node.get_topic_names_and_types():
            if not name.startswith(beneath) or "/_" in name:
                continue
            offers = self._node.get_publishers_info_by_topic(name)
            readers = self._node.get_subscriptions_info_by_topic(name)
            if publishers & {(offer.node_namespace, offer.node_name) for offer in offers} and (
                recorder not in {(reader.node_namespace, reader.node_name) for reader in readers}
            ):
                missing.append(name)
        return missing

    def reaching_too_few(self, matched: str) -> list[str]:
        """
        Return the topics on which a participant reaches fewer subscriptions than exist.

        It says itself how many it reaches, if it is one of ours. How many there are is known
        here: every participant has been seen whole.
        """
        try:
            counts = json.loads(matched)
        except ValueError:
            return []
        return [
            topic for topic, count in counts.items() if count < self._node.count_subscribers(topic)
        ]
