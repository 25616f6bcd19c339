# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What the nodes need and rclpy does not offer, written for rclpy 7.1 of ROS 2 Jazzy.

Three things: the parameters that a node was started with, a lifecycle node that survives a request
for a transition that its current state does not have, and subscriptions without an executor.
"""

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type

_CHANGE_STATE = "_LifecycleNodeMixin__on_change_state"
_OVERRIDES = "_parameter_overrides"
_FITS = "this is not rclpy 7.1 of ROS 2 Jazzy: it has no {}; see nodes/rclpy_internals.py"


def given_parameters(node: Node) -> dict[str, Any]:
    """Return the values of the parameters that a node was started with, by name."""
    overrides = getattr(node, _OVERRIDES, None)
    if overrides is None:
        raise NotImplementedError(_FITS.format(_OVERRIDES))
    return {name: parameter.value for name, parameter in overrides.items()}


class TolerantLifecycleNode(LifecycleNode):
    """
    A lifecycle node that refuses a transition that its current state does not have.

    In rclpy 7.1 such a request raises an exception, which would end the node.
    """

    if not hasattr(LifecycleNode, _CHANGE_STATE):
        raise NotImplementedError(_FITS.format(_CHANGE_STATE))

    def _LifecycleNodeMixin__on_change_state(self, request: Any, response: Any) -> Any:  # noqa: N802
        try:
            return getattr(super(), _CHANGE_STATE)(request, response)
        except RuntimeError as error:  # rclpy's RCLError
            logger: Any = self.get_logger()  # type: ignore[no-untyped-call]
            logger.error(f"transition {request.transition.id} refused: {error}")
            response.success = False
            return response


class RawReader:
    """
    A subscription whose messages wait, as bytes, until they are taken.

    Taking a message costs a third of what the executor needs to deliver it, and does not wake the
    process. It is for a node that takes many messages and need not see each one immediately.
    """

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        check_is_valid_msg_type(message_type)
        with node.handle:
            self._subscription = rclpy_implementation.Subscription(
                node.handle, message_type, topic, qos.get_c_qos_profile()
            )
        self._type = message_type

    def take(self, most: int) -> list[tuple[int, bytes]]:
        """Return at most ``most`` messages, each as (wall time of its arrival [ns], bytes)."""
        take, message_type = self._subscription.take_message, self._type
        taken: list[tuple[int, bytes]] = []
        while len(taken) < most and (message := take(message_type, True)) is not None:
            data, about = message
            taken.append((about["received_timestamp"], data))
        return taken

    def destroy(self) -> None:
        """End the subscription."""
        self._subscription.destroy_when_not_in_use()
