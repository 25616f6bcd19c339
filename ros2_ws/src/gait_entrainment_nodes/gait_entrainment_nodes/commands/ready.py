# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain ready: whether nodes answer and are ready for a run; a health check of containers."""

import argparse
import sys
import time

from gait_entrainment_nodes.messaging.domain import DomainError, wanted_domain

# An answer may be lost while the node does not know yet who asks [s].
ASK_AGAIN = 0.5

DESCRIPTION = (
    "Ask ~/ready of nodes in ROS_DOMAIN_ID. Exit code 0 once each has answered that it is "
    "ready, 1 where one has not: the reason is on standard error."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("nodes", nargs="+", metavar="NODE", help="such as walker_sim")
    parser.add_argument(
        "--timeout", type=float, default=5.0, help="how long to wait [s] (default 5)"
    )


def run(options: argparse.Namespace) -> int:
    """Ask every node until all are ready; 1 after the timeout, 2 for what is no name of a node."""
    # Imported here: other commands do without ROS.
    import rclpy
    from rclpy.exceptions import InvalidServiceNameException
    from rclpy.experimental import EventsExecutor
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    from gait_entrainment_msgs.srv import Ready
    from gait_entrainment_nodes.messaging.environment import set_environment

    try:
        set_environment(wanted_domain() or 0)
    except DomainError as error:
        print(f"entrain ready: {error}", file=sys.stderr)
        return 1
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    asker = Node("entrain_ready", enable_rosout=False, start_parameter_services=False)
    executor = EventsExecutor()
    executor.add_node(asker)
    waiting = dict.fromkeys(options.nodes, "does not answer")
    give_up = time.monotonic() + options.timeout
    try:
        clients = {name: asker.create_client(Ready, f"{name}/ready") for name in options.nodes}
        while waiting and time.monotonic() < give_up:
            asked = {n: clients[n].call_async(Ready.Request()) for n in waiting}
            again = time.monotonic() + ASK_AGAIN
            while time.monotonic() < min(again, give_up) and not all(
                call.done() for call in asked.values()
            ):
                executor.spin_once(timeout_sec=0.05)
            for name, call in asked.items():
                if call.done() and call.result().ready:
                    del waiting[name]
                elif call.done():
                    waiting[name] = f"waits for {call.result().waiting_for}"
    except InvalidServiceNameException as error:
        print(f"entrain ready: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass  # who did not answer until now is named
    finally:
        executor.shutdown()
        asker.destroy_node()
        rclpy.try_shutdown()
    for name, reason in waiting.items():
        print(f"entrain ready: {name} {reason}", file=sys.stderr)
    return 1 if waiting else 0
