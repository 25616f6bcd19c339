# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop: torque to zero, latched, on every perturbator that can be found."""

import argparse
import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from gait_entrainment_nodes.messaging.domain import DomainError, domains_in_use, wanted_domain

# For so long perturbators are looked for [s]; and, in a domain where a run should be, until one is
# found and all have answered, but no longer than this.
DISCOVERY = 2.0
PATIENCE = 6.0
# Where nodes are that were started one by one, without a run that claims a domain.
DEFAULT_DOMAIN = 0
# A stop service is a perturbator's where the same node takes pulse trains.
STOP, TRAIN = "/stop", "/deliver_pulse_train/_action/send_goal"

DESCRIPTION = (
    "Call the stop service of every perturbator: in ROS_DOMAIN_ID where it is set, else in "
    "every domain in which a run of this machine goes on. Latched until it was cleaned up and "
    "configured again. No substitute for a switch in the hand: see docs/safety.md."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Stop everything; 1 where nothing was found, or a stop was not confirmed."""
    try:
        wanted = wanted_domain()
    except DomainError as error:
        print(f"entrain stop: {error}; stopping every run", file=sys.stderr)
        wanted = None
    if wanted is not None:
        domains = {wanted: PATIENCE}
    else:
        domains = {DEFAULT_DOMAIN: DISCOVERY, **dict.fromkeys(domains_in_use(), PATIENCE)}
    answers: dict[str, str | None] = {}
    # Side by side: no run waits for another one to be stopped.
    with ThreadPoolExecutor(len(domains)) as threads:
        for found in threads.map(stop_all, domains, domains.values()):
            answers |= found
    silent = [name for name, answer in answers.items() if answer is None]
    if options.json:
        print(json.dumps({"stopped": answers}))
    else:
        for name, answer in answers.items():
            print(f"{name}: {answer or 'did not confirm the stop'}")
    if not answers:
        print("entrain stop: no perturbator was found: is a run going on?", file=sys.stderr)
    elif silent:
        print(f"entrain stop: no stop of {', '.join(silent)}: cut the power", file=sys.stderr)
    return 0 if answers and not silent else 1


def stop_all(domain: int, patience: float) -> dict[str, str | None]:
    """Call every stop service in a domain; return the answers, None where no stop is confirmed."""
    # Imported here: other commands do without ROS.
    import rclpy
    from rclpy.context import Context
    from rclpy.experimental import EventsExecutor
    from rclpy.node import Node
    from std_srvs.srv import Trigger

    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = Node(f"entrain_stop_{domain}", context=context)
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    clients: dict[str, Any] = {}
    calls: dict[str, Any] = {}
    begun = time.monotonic()
    try:
        # Called as soon as it is seen: what is found first need not wait for what comes later.
        while (waited := time.monotonic() - begun) < patience:
            services = {name for name, _ in node.get_service_names_and_types()}
            stops = {s.removesuffix(TRAIN) + STOP for s in services if s.endswith(TRAIN)}
            for name in (stops & services) - set(clients):
                clients[name] = node.create_client(Trigger, name)
            for name, client in clients.items():
                if name not in calls and client.service_is_ready():
                    calls[name] = client.call_async(Trigger.Request())
            executor.spin_once(timeout_sec=0.02)
            answered = sum(call.done() for call in calls.values())
            if waited > DISCOVERY and clients and answered == len(clients):
                break
        answered = {name: call.result() for name, call in calls.items() if call.done()}
        confirmed = {name: answer.message for name, answer in answered.items() if answer.success}
        return {f"domain {domain} {name}": confirmed.get(name) for name in clients}
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
