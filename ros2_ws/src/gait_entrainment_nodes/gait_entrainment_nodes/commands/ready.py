# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain ready: whether nodes answer and are ready for a run; a health check of containers."""

import argparse
import sys
from contextlib import suppress

from gait_entrainment.settings import Setting
from gait_entrainment_nodes.messaging.domain import wanted_domain
from gait_entrainment_nodes.messaging.environment import set_environment

_TIMEOUT = Setting("how long to wait", unit="s", least=0.0, most=3600.0)
DESCRIPTION = (
    "Call the service ~/ready of nodes in ROS_DOMAIN_ID. Exit code 0 once each has answered that "
    "it is ready, 1 if one has not: the reason is on standard error."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("nodes", nargs="+", metavar="NODE", help="such as walker_sim")
    parser.add_argument("--timeout", default="5", help=f"{_TIMEOUT.meaning} [s] (5)")


def run(options: argparse.Namespace) -> int:
    """Ask every node until all are ready; return 1 if they are not ready in time."""
    timeout = _TIMEOUT.parse("--timeout", options.timeout)
    set_environment(wanted_domain() or 0)
    # Not at the top: they load ROS, for which the environment must be set first.
    from gait_entrainment_msgs.srv import Ready
    from gait_entrainment_nodes.messaging.client import Client, all_answered

    with Client("entrain_ready") as client:
        calls = [client.ask(Ready, f"{n}/ready", accept=lambda a: a.ready) for n in options.nodes]
        with suppress(KeyboardInterrupt):  # what is known by then is printed
            client.wait(lambda: all_answered(calls), timeout)
    for node, question in zip(options.nodes, calls, strict=True):
        if not question.accepted:
            latest = question.latest
            reason = f"waits for {latest.waiting_for}" if latest else "does not answer"
            print(f"entrain ready: {node} {reason}", file=sys.stderr)
    return 0 if all(question.accepted for question in calls) else 1
