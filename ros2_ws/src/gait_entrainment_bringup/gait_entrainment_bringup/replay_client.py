# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The replay's own place in the ROS graph: starts the player, hears the analyzer out."""

import time
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger
from tqdm import tqdm

from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.topics import (
    ENTRAINMENT,
    PUBLISHED_COUNTS,
    PULSE_PHASES,
    STRIDES,
)

RESULTS = (STRIDES, PULSE_PHASES, ENTRAINMENT)
# How long a node may take to appear, and to do what it was asked for [s].
PATIENCE = 60.0
# How often a node is asked again: an answer is lost where the node does not know us yet [s].
ASKING_PERIOD = 0.25
# How often it is seen, while a bag is played, that nobody hangs [s].
LOOKING_PERIOD = 1.0


class ReplayError(Exception):
    """The replay has failed; the message says why."""


class ReplayClient:
    """
    Lets a bag be played to a gait analyzer, and takes what the analyzer makes of it.

    Parameters
    ----------
    supervisor
        The processes to watch meanwhile.
    namespace
        Of the experiment that was recorded, without a slash at its end; "" for the root.
    listeners
        Subscriptions that each topic of the analyzer must have before the start, ours included.

    Attributes
    ----------
    results
        Serialized messages by relative topic name, in the order in which they were published.

    """

    def __init__(self, supervisor: Supervisor, namespace: str, listeners: int) -> None:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self._supervisor = supervisor
        self._listeners = listeners
        self._node = Node("entrain_replay", namespace=namespace or None)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self.results: dict[str, list[bytes]] = {topic.name: [] for topic in RESULTS}
        self._topic_names = {
            self._node.resolve_topic_name(topic.name): topic.name for topic in RESULTS
        }
        self._counts_topic = self._node.resolve_topic_name(PUBLISHED_COUNTS.name)
        self._counts: dict[str, int] | None = None  # what the analyzer says that it published
        for topic in RESULTS:
            self._node.create_subscription(
                topic.type, topic.name, self.results[topic.name].append, topic.qos, raw=True
            )
        self._node.create_subscription(
            PUBLISHED_COUNTS.type, PUBLISHED_COUNTS.name, self._on_counts, PUBLISHED_COUNTS.qos
        )
        self._clients = {
            service: self._node.create_client(kind, service)
            for service, kind in (
                ("gait_analyzer/ready", Ready),
                ("gait_analyzer/finish", Trigger),
                ("bag_player/ready", Ready),
                ("bag_player/resume", srv.Resume),
            )
        }

    def play(self, quiet: bool) -> None:
        """
        Play the bag to its end and wait for everything that the analyzer makes of it.

        Raises
        ------
        ReplayError
            Why it failed, with the last lines of the log of whoever is to blame.

        """
        self._ask("gait_analyzer/ready", self._all_listen)
        self._ask("bag_player/ready", self._all_recorded)
        self._ask("bag_player/resume")
        with tqdm(
            desc="replay", unit="stride", disable=True if quiet else None, leave=False
        ) as bar:
            ask_at = time.monotonic()
            while not self._played():
                self._spin()
                bar.update(len(self.results[STRIDES.name]) - bar.n)
                if time.monotonic() > ask_at:  # who hangs holds up the player without an end
                    for node in ("gait_analyzer", "bag_player"):
                        self._ask(f"{node}/ready", lambda _: True, self._played)
                    ask_at = time.monotonic() + LOOKING_PERIOD
        self._ask("gait_analyzer/finish")
        self._wait_until(self._complete, "the analyzer's last results", "gait_analyzer")

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def _played(self) -> bool:
        """Whether the player has ended."""
        return "bag_player" in self._supervisor.ended()

    def _all_listen(self, answer: Ready.Response) -> bool:
        """Whether everyone who is to hear the analyzer's results will hear them."""
        matched = dict(zip(answer.topics, answer.matched, strict=True))
        if not answer.ready:
            return False
        names = (*self._topic_names, self._counts_topic)
        return all(matched.get(name, 0) >= self._listeners for name in names)

    def _all_recorded(self, answer: Ready.Response) -> bool:
        """Whether a recorder, if there is one, hears all of its namespace, hidden topics apart."""
        if not answer.ready:
            return False
        heard = dict(zip(answer.topics, answer.matched, strict=True))
        if self._listeners == 1:
            return True
        beneath = self._node.get_namespace().rstrip("/") + "/"
        recorded = [name for name in heard if name.startswith(beneath) and "/_" not in name]
        # The final counts are heard here too.
        return heard[self._counts_topic] >= self._listeners and all(map(heard.get, recorded))

    def _complete(self) -> bool:
        """Whether everything that the analyzer says it has published is here."""
        return self._counts is not None and all(
            len(self.results[name]) >= self._counts[full]
            for full, name in self._topic_names.items()
        )

    def _on_counts(self, message: PublishedCounts) -> None:
        if message.node.rpartition("/")[2] == "gait_analyzer":
            self._counts = dict(zip(message.topics, message.counts, strict=True))

    def _ask(
        self,
        service: str,
        good: Any = lambda _: True,
        needless: Any = lambda: False,
    ) -> None:
        """Ask a node, again and again, until it gives a good answer, or that is needless."""
        client = self._clients[service]
        answers: list[Any] = []
        asked_at = 0.0

        def answered() -> bool:
            nonlocal asked_at
            if needless() or any(a.done() and good(a.result()) for a in answers):
                return True
            if time.monotonic() - asked_at > ASKING_PERIOD and client.service_is_ready():
                asked_at = time.monotonic()
                answers.append(client.call_async(client.srv_type.Request()))
            return False

        self._wait_until(answered, service, service.partition("/")[0])

    def _wait_until(self, condition: Any, what: str, blamed: str) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self._spin()
            if time.monotonic() > deadline:
                raise self._error(f"no answer of {what} within {PATIENCE:g} s", blamed)

    def _spin(self) -> None:
        """Serve ROS for a moment; raise ReplayError where a process has ended before its time."""
        self._executor.spin_once(timeout_sec=0.02)
        for node, code in self._supervisor.ended().items():
            # Player and recorder end by themselves once everything was played and recorded.
            if node == "gait_analyzer" or code != 0:
                raise self._error(f"{node} ended unexpectedly with exit code {code}", node)

    def _error(self, text: str, blamed: str) -> ReplayError:
        lines = self._supervisor.last_lines(blamed)
        return ReplayError(f"{text}\n{lines}" if lines else text)
