# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""entrain ready: whether nodes answer and are ready for a run; a health check of containers."""

import argparse
import sys
import time
from typing import Any

from gait_entrainment_nodes.domain import DomainError, wanted_domain

# An answer may be lost while the node does not know yet who asks [s].
ASK_AGAIN = 0.5


def add_command(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "ready",
        help="whether nodes answer, here or on other hosts",
        description=(
            "Ask ~/ready of nodes in ROS_DOMAIN_ID. Exit code 0 once each has answered that it is "
            "ready, 1 where one has not: the reason is on standard error."
        ),
    )
    parser.add_argument("nodes", nargs="+", metavar="NODE", help="such as walker_sim")
    parser.add_argument(
        "--timeout", type=float, default=5.0, help="how long to wait [s] (default 5)"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Ask every node until all are ready; 1 after the timeout, 2 for what is no name of a node."""
    # Imported here: other commands do without ROS.
    import rclpy
    from rclpy.exceptions import InvalidServiceNameException
    from rclpy.experimental import EventsExecutor
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions
    from std_srvs.srv import Trigger

    from gait_entrainment_nodes.environment import set_environment

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
        clients = {name: asker.create_client(Trigger, f"{name}/ready") for name in options.nodes}
        while waiting and time.monotonic() < give_up:
            asked = {n: clients[n].call_async(Trigger.Request()) for n in waiting}
            again = time.monotonic() + ASK_AGAIN
            while time.monotonic() < min(again, give_up) and not all(
                call.done() for call in asked.values()
            ):
                executor.spin_once(timeout_sec=0.05)
            for name, call in asked.items():
                if call.done() and call.result().success:
                    del waiting[name]
                elif call.done():
                    waiting[name] = f"waits for {call.result().message}"
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
