# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What the nodes need of rclpy and rclpy does not offer: written for rclpy 7.1, that of ROS 2 Jazzy.

Two things: which parameters a node was started with, and a lifecycle node that survives a request
for a transition that its present state does not have.
"""

from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node

_CHANGE_STATE = "_LifecycleNodeMixin__on_change_state"
_OVERRIDES = "_parameter_overrides"
_FITS = "this rclpy is not that of ROS 2 Jazzy (7.1): it has no {}; see nodes/rclpy_internals.py"


def given_parameters(node: Node) -> dict[str, Any]:
    """Return the values of the parameters that a node was started with, by name."""
    overrides = getattr(node, _OVERRIDES, None)
    if overrides is None:
        raise NotImplementedError(_FITS.format(_OVERRIDES))
    return {name: parameter.value for name, parameter in overrides.items()}


class TolerantLifecycleNode(LifecycleNode):
    """
    A lifecycle node that refuses a transition that its present state does not have.

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
