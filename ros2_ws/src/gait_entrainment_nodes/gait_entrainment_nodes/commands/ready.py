# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain ready: whether nodes answer and are ready for a run; a health check of containers."""

import argparse
import sys
from contextlib import suppress

from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import wanted_domain
from gait_entrainment_nodes.messaging.environment import set_environment

DESCRIPTION = (
    "Ask ~/ready of nodes in ROS_DOMAIN_ID. Exit code 0 once each has answered that it is "
    "ready, 1 if one has not: the reason is on standard error."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("nodes", nargs="+", metavar="NODE", help="such as walker_sim")
    parser.add_argument(
        "--timeout", type=float, default=5.0, help="how long to wait [s] (default 5)"
    )


def run(options: argparse.Namespace) -> int:
    """Ask every node until all are ready; 1 if they are not in time."""
    set_environment(wanted_domain() or 0)
    with Client("entrain_ready") as client:
        questions = {
            name: client.ask(Ready, f"{name}/ready", accept=lambda answer: answer.ready)
            for name in options.nodes
        }

        def all_ready() -> bool:
            answers = [question.answer() for question in questions.values()]  # each is asked
            return all(answers)

        with suppress(KeyboardInterrupt):  # what is known by then is told
            client.wait(all_ready, options.timeout)
    waiting = {name: q.latest for name, q in questions.items() if not q.accepted}
    for name, answer in waiting.items():
        reason = f"waits for {answer.waiting_for}" if answer else "does not answer"
        print(f"entrain ready: {name} {reason}", file=sys.stderr)
    return 1 if waiting else 0
