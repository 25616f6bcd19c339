# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The loop that every node runs in, and its clean stop.

It repeats ``spin_once`` of the EventsExecutor, which receives ten times as many messages as the
default executor. Between two calls the node meets its own deadlines on steady time.
"""

import gc
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from gait_entrainment.errors import EntrainmentError, UsageError
from gait_entrainment_bags import NothingToPlayError
from gait_entrainment_commands.signals import STOPPING
from gait_entrainment_nodes.messaging.environment import come_before_others
from gait_entrainment_nodes.nodes.parameters import HELP, HelpRequestedError

# The longest time [s] that the loop sleeps in the executor, so that signals are handled soon.
LONGEST_SLEEP = 0.1


def run_node(make_node: Callable[[], Any]) -> int:
    """
    Run a node until it finishes, fails or receives a signal that stops it.

    Returns 0 for a clean stop, 1 for a failure, 2 for a refused argument or parameter. The reason
    is one line on standard error, after a traceback if the failure was unexpected.
    """
    stop_requested = False
    node: Any = None

    def request_stop(*_: object) -> None:
        nonlocal stop_requested
        stop_requested = True
        if node is not None:
            node.stopping = True

    # rclpy's own handlers shut the context down immediately, so no last message could be sent.
    for number in STOPPING:
        signal.signal(number, request_stop)
    name = sys.argv[0].rpartition("/")[2]
    try:
        try:
            _join_ros()
            node = make_node()
            node.offer_ready()
            domain = rclpy.get_default_context().get_domain_id()
            node.get_logger().info(f"started in ROS domain {domain}")
            if node.real_time:
                come_before_others(node.priority)
        except HelpRequestedError as answer:
            print(answer, flush=True)
            return 0
        except (EntrainmentError, ParameterException, ValueError, RuntimeError) as error:
            print(f"{name}: {' '.join(str(error).split())}", file=sys.stderr)
            return 1 if isinstance(error, NothingToPlayError) else 2
        executor = EventsExecutor()
        executor.add_node(node)
        # What is loaded stays loaded; garbage collection that scans it would make samples late.
        gc.freeze()
        try:
            while not (stop_requested or node.finished or node.failure):
                _serve_once(executor, node)
        except Exception as error:
            node.fail_with(error)
        node.end()
        executor.shutdown()
        if node.failure:
            print(f"{name}: {node.failure}", file=sys.stderr)
            return 1
        return 0
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _join_ros() -> None:
    """Initialize rclpy with the process arguments; raises UsageError if they are invalid."""
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # one of several errors that rclpy does not export
        raise UsageError(f"invalid ROS arguments: {error}") from None
    if (extra := remove_ros_args(sys.argv)[1:]) and extra[0] not in HELP:
        raise UsageError(
            f"unknown argument {extra[0]!r}; allowed: --help, --ros-args -p PARAMETER:=VALUE ..."
        )


def _serve_once(executor: Any, node: Any) -> None:
    """Serve ROS until the node's deadline or for a short time, then do what is due."""
    deadline = node.next_deadline()
    sleep = LONGEST_SLEEP
    if deadline is not None:
        sleep = min(max(deadline - time.monotonic(), 0.0), LONGEST_SLEEP)
    try:
        executor.spin_once(timeout_sec=sleep)
    except RuntimeError as error:  # rclpy's RCLError, which it does not export
        # The client of a service is gone, or is not matched yet and will ask again.
        if "client will not receive response" not in str(error):
            raise
    except ValueError as error:  # rclpy's own handling of /clock
        if "value must not be negative" not in str(error):
            raise
        node.get_logger().warning(f"a message is dropped: /clock: {error}")
    node.publish_state()
    deadline = node.next_deadline()
    if deadline is not None and time.monotonic() >= deadline:
        node.on_deadline()
