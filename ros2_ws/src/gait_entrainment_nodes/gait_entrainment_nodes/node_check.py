# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Entry of `entrain driver check --node`: sees that ROS can start before the check loads it."""

from collections.abc import Iterator
from typing import Any

from gait_entrainment_nodes.messaging.environment import require_usable_environment


def check_node(*arguments: Any, **options: Any) -> Iterator[Any]:
    """Run `node_bench.check_node`; raises UnusableEnvironmentError before ROS is loaded."""
    require_usable_environment()
    from gait_entrainment_nodes import node_bench

    return node_bench.check_node(*arguments, **options)
