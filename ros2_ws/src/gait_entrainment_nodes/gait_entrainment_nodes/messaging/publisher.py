# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Publishers that count what they send and lose none of it."""

import math
import time
from collections.abc import Callable, Iterable
from typing import Any

import rclpy
from rclpy.duration import Duration

from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.topics import (
    EVERY_MESSAGE,
    EVERY_MESSAGE_IN_REAL_TIME,
    Topic,
)

# How often a full writer tries again while the slowest reader catches up [s].
RETRY_PERIOD = 0.002
# How long to wait at a time before checking whether the node must stop [s].
TIMEOUT = 0.1
# How often a writer that waits for a reader logs a warning [s].
LAG_REPORT_PERIOD = 1.0


class StopRequestedError(Exception):
    """The node must end while a publisher waits for a slow reader."""


class CountedPublisher:
    """
    A publisher that counts, and that waits for a slow reader rather than lose a message.

    Its node, a Participant, has an attribute ``stopping``, which ends the wait, and an attribute
    ``real_time``; if that is set, it does not wait.
    """

    def __init__(self, node: Any, topic: Topic, *, counted: bool = True) -> None:
        self._node, self.counted = node, counted
        qos = topic.qos
        if qos is EVERY_MESSAGE and node.real_time:
            qos = EVERY_MESSAGE_IN_REAL_TIME
        name = node.name_of(topic)
        self._publisher = node.create_publisher(
            topic.type, name, **node.quality_of(name, "publisher", qos)
        )
        self.count = 0

    @property
    def topic_name(self) -> str:
        """Fully qualified name of the topic."""
        return str(self._publisher.topic_name)

    @property
    def matched(self) -> int:
        """Number of subscriptions that will receive what is published from now on."""
        return int(self._publisher.get_subscription_count())

    @property
    def unmatched(self) -> int:
        """Number of known subscriptions that are not matched yet."""
        return max(int(self._node.count_subscribers(self.topic_name)) - self.matched, 0)

    def publish(self, message: Any) -> None:
        """
        Publish a message, or its serialized bytes; wait while the history is full.

        Raises StopRequestedError if the node must stop in the meantime.
        """
        data = message if isinstance(message, bytes) else serialize(message)
        self._repeat(lambda: self._published(data))
        self.count += 1

    def publish_all(self, messages: Iterable[bytes]) -> None:
        """Publish serialized messages as ``publish`` does, with half the work for each."""
        handle = self._publisher.handle
        with handle:
            publish = handle.publish_raw
            for message in messages:
                try:
                    publish(message)
                except RuntimeError:  # the history is full
                    self.publish(message)
                else:
                    self.count += 1

    def wait_until_received(self, timeout: float) -> bool:
        """Wait up to a time [s]; return whether every reader has received what was published."""
        return bool(self._publisher.wait_for_all_acked(Duration(seconds=timeout)))

    def wait_for_readers(self, timeout: float = math.inf) -> bool:
        """
        Wait as ``wait_until_received`` does, and report a reader that does not keep up.

        Raises StopRequestedError if the node must stop in the meantime.
        """
        return self._repeat(lambda: self.wait_until_received(TIMEOUT), timeout)

    def _published(self, data: bytes) -> bool:
        try:
            self._publisher.publish(data)
        except RuntimeError:  # rclpy's RCLError: the history is full
            time.sleep(RETRY_PERIOD)
            return False
        return True

    def _repeat(self, attempt: Callable[[], bool], timeout: float = math.inf) -> bool:
        """Repeat an attempt until it succeeds; False if it does not within a time [s]."""
        give_up = time.monotonic() + timeout
        report_at = time.monotonic() + LAG_REPORT_PERIOD
        while not attempt():
            if self._node.stopping or not rclpy.ok():
                raise StopRequestedError
            if time.monotonic() > give_up:
                return False
            if time.monotonic() > report_at:
                report_at += LAG_REPORT_PERIOD
                readers = self._node.get_subscriptions_info_by_topic(self.topic_name)
                names = ", ".join(sorted({reader.node_name for reader in readers}))
                self._node.get_logger().warning(
                    f"{self.topic_name} waits: one of its readers does not keep up ({names})"
                )
        return True
