# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Errors between processes, without ROS, for processes that have not loaded it yet."""

from gait_entrainment.errors import EntrainmentError


class NodeError(EntrainmentError):
    """A run has failed; the log of ``node``, if one is named, may say more."""

    def __init__(self, message: str, node: str = "") -> None:
        super().__init__(message)
        self.node = node


class SilenceError(NodeError):
    """A node did not answer a request to its service or action ``name`` in time [s]."""

    def __init__(self, name: str, timeout: float) -> None:
        super().__init__(f"no answer from {name} within {timeout:g} s", name.rpartition("/")[0])
