# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop-ros: the stop service of every perturbator that ROS can find."""

import argparse
import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from gait_entrainment_nodes.messaging.domain import DomainError, domains_in_use, wanted_domain
from gait_entrainment_nodes.messaging.environment import require_usable_environment

# How long to look for perturbators [s]. In a domain that a run has claimed, the search lasts until
# one is found and all have answered, but no longer than TIMEOUT.
DISCOVERY = 2.0
TIMEOUT = 6.0
# The domain of nodes that were started one by one, without a run that claims a domain.
DEFAULT_DOMAIN = 0
# A stop service belongs to a perturbator if the same node takes pulse trains.
STOP, TRAIN = "/stop", "/deliver_pulse_train/_action/send_goal"

DESCRIPTION = (
    "Call the stop service of every perturbator: in ROS_DOMAIN_ID if it is set, else in "
    "every domain with a run on this machine. The stop is latched until the perturbator is "
    "cleaned up and configured again. For robots that another host drives; discovery takes one to "
    "two seconds, so on this machine use entrain stop."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Stop everything; return 1 if nothing was found, or a stop was not confirmed."""
    require_usable_environment()
    domains = {DEFAULT_DOMAIN: DISCOVERY, **dict.fromkeys(domains_in_use(), TIMEOUT)}
    try:
        if (wanted := wanted_domain()) is not None:
            domains = {wanted: TIMEOUT}
    except DomainError as error:
        print(f"entrain stop-ros: {error}; stopping every run", file=sys.stderr)
    answers: dict[str, str | None] = {}
    # In parallel: no run waits for another one to be stopped.
    with ThreadPoolExecutor(len(domains)) as threads:
        for found in threads.map(stop_all, domains, domains.values()):
            answers |= found
    silent = ", ".join(name for name, answer in answers.items() if answer is None)
    if options.json:
        print(json.dumps({"stopped": answers}))
    else:
        for name, answer in answers.items():
            print(f"{name}: {answer or 'did not confirm the stop'}")
    if not answers:
        print("entrain stop-ros: no perturbator was found: is a run going on?", file=sys.stderr)
    elif silent:
        print(f"entrain stop-ros: {silent} did not confirm: cut the power", file=sys.stderr)
    return 0 if answers and not silent else 1


def stop_all(domain: int, timeout: float) -> dict[str, str | None]:
    """Call every stop service in a domain; return the answers, None if no stop is confirmed."""
    # Not at the top: they load ROS, for which the environment must be set first.
    from std_srvs.srv import Trigger

    from gait_entrainment_nodes.messaging.client import Client, Question, all_answered

    calls: dict[str, Question] = {}
    look_until = time.monotonic() + DISCOVERY
    with Client(f"entrain_stop_{domain}", domain=domain) as client:

        def all_stopped() -> bool:
            """Call each service as soon as it is seen; return whether there are no more."""
            services = {name for name, _ in client.node.get_service_names_and_types()}
            stops = {s.removesuffix(TRAIN) + STOP for s in services if s.endswith(TRAIN)}
            for name in (stops & services) - calls.keys():
                calls[name] = client.ask(Trigger, name)
            done = all_answered(calls.values()) and time.monotonic() > look_until
            return bool(calls) and done

        client.wait(all_stopped, timeout)
    answers = {f"domain {domain} {name}": call.accepted for name, call in calls.items()}
    return {name: a.message if a and a.success else None for name, a in answers.items()}
