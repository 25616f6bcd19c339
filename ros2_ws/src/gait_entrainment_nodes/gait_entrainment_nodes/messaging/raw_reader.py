# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Subscriptions that are asked for their messages, and give them as bytes."""

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type


class RawReader:
    """
    A subscription whose messages wait until they are taken.

    It is for a node that takes many messages and need not know of each at once: taking them costs
    a third of what the executor needs to hand each of them on, and nobody is woken for it.
    """

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        check_is_valid_msg_type(message_type)
        with node.handle:
            self._subscription = rclpy_implementation.Subscription(
                node.handle, message_type, topic, qos.get_c_qos_profile()
            )
        self._type = message_type

    def take(self, most: int) -> list[tuple[int, bytes]]:
        """Return up to so many messages, each with the wall time [ns] at which it came."""
        take, message_type = self._subscription.take_message, self._type
        taken: list[tuple[int, bytes]] = []
        while len(taken) < most and (message := take(message_type, True)) is not None:
            data, info = message
            taken.append((info["received_timestamp"], data))
        return taken

    def destroy(self) -> None:
        """End the subscription."""
        self._subscription.destroy_when_not_in_use()
