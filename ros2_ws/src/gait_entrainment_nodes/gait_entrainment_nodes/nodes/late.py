# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Readers and clients of a node that receive late, for tests (messaging/delays.py)."""

import time
from collections import deque
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_nodes.messaging.delays import Delay, delay_between, delays_wanted
from gait_entrainment_nodes.nodes.rclpy_internals import RawReader

# How often to check for late messages that are due [s].
PERIOD = 0.01


class LateReader(RawReader):
    """A reader that loses messages from before its sender was matched and delays the rest."""

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        super().__init__(node, message_type, topic, qos)
        self._node, self._topic = node, node.resolve_topic_name(topic)
        self._kept: deque[tuple[int, bytes]] = deque()

    def take(self, most: int) -> list[tuple[int, bytes]]:
        """See `RawReader.take`."""
        self._kept += super().take(most)
        if not self._kept:
            return []
        delay = self._delay()
        late = round(delay.of_topic(self._topic) * NANOSECONDS_PER_SECOND)
        taken: list[tuple[int, bytes]] = []
        while self._kept and self._kept[0][0] + late <= time.time_ns() and len(taken) < most:
            received, data = self._kept.popleft()
            if received >= delay.matched * NANOSECONDS_PER_SECOND:
                taken.append((received, data))
        return taken

    def _delay(self) -> Delay:
        """Return the publisher's delay; with several the matching of the sender is unknown."""
        here = self._node.get_name()
        infos = self._node.get_publishers_info_by_topic(self._topic)
        delays = [delay_between(name, here) for name in {info.node_name for info in infos}]
        if len(delays) == 1:
            return delays[0]
        return Delay(delivery=max((delay.delivery for delay in delays), default=0.0))


def raw_reader(node: Node, message_type: Any, topic: str, qos: QoSProfile) -> RawReader:
    """Return a reader of a topic, a late one if tests ask for it."""
    return (LateReader if delays_wanted() else RawReader)(node, message_type, topic, qos)


class LateClient:
    """A client whose answers are late, or lost if the server had not matched it when it asked."""

    def __init__(self, client: Any, delay: Delay) -> None:
        self._client, self._delay = client, delay
        self._answers: deque[tuple[float, Future, Any]] = deque()  # (due time, future, answer)
        self.service_is_ready = client.service_is_ready

    def call_async(self, request: Any) -> Future:
        """Send a request, whose answer ``deliver`` sets."""
        late = Future()
        known = time.time() >= self._delay.matched

        def keep(answer: Future) -> None:
            if known:
                self._answers.append((time.time() + self._delay.delivery, late, answer.result()))

        self._client.call_async(request).add_done_callback(keep)
        return late

    def deliver(self) -> None:
        """Set the answers that are due."""
        while self._answers and self._answers[0][0] <= time.time():
            _, late, answer = self._answers.popleft()
            late.set_result(answer)
