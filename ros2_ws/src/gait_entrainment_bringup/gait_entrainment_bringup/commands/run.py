# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain run: start the nodes as processes, conduct one protocol, record the run."""

import argparse
import importlib
import json
import os
import shutil
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import Protocol, write_protocol
from gait_entrainment.robot import find_driver
from gait_entrainment_bags import BagError, BagReader, UnreadableBagError, recover
from gait_entrainment_bringup.node_list import (
    PAGE,
    PERSON_SILENCE,
    RUN_CLIENT,
    STOP_ORDER,
    WALKERS,
    nodes_for,
    parameter_arguments,
)
from gait_entrainment_bringup.page_options import add_page_options, check_heartbeat, checked_page
from gait_entrainment_bringup.run_options import (
    add_run_options,
    checked_run,
    chosen_parameters,
    claimed_folder,
)
from gait_entrainment_bringup.supervisor import Supervisor, supervised
from gait_entrainment_drivers.stop_channel import StopListener
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_page.access import Access

DESCRIPTION = "Start the nodes, conduct a protocol, record a bag, print the outcome."
EXAMPLES = """examples:
  entrain run                          the paper's example, as fast as possible
  entrain run --real-time              the same at the pace of the wall clock
  entrain run my_protocol.yaml --out bags/mine
  entrain run --walker sensed --detector foot_switch      rehearse an experiment on a person
  ROS_DOMAIN_ID=42 entrain run         in a domain of your choice, to listen with other tools
  entrain run --real-time --page       with the operator's page (docs/page.md)
  ROS_DOMAIN_ID=42 entrain run --elsewhere walker_sim     it runs on another host: docs/hosts.md
"""
# Nodes that may run on another host. Not those responsible for the torque and the record: Ctrl-C
# must reach them without a network.
DETACHABLE = ("walker_sim", "sensor_sim", "gait_detector", "gait_analyzer")
# The walker's role, if a program that is no node of this project plays it (docs/person.md).
ROLE = "walker"
# What the end of a run needs, loaded while the walker walks.
REPORT = "gait_entrainment_bringup.run_report"
DRAWING = ("matplotlib.figure", "matplotlib.backends.backend_agg")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_run_options(parser)
    add_node_options(parser)
    parser.add_argument("--no-figures", action="store_true", help="draw no figures")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def add_node_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for nodes that are not started here, and for the page."""
    parser.add_argument(
        "--elsewhere",
        action="append",
        choices=(*DETACHABLE, ROLE),
        default=[],
        help="do not start this node: it runs on another host (entrain node); walker: your own "
        "source of events; repeatable",
    )
    parser.add_argument("--page", action="store_true", help="show the run in a browser")
    add_page_options(parser)


def check_nodes(options: argparse.Namespace, protocol: Protocol) -> None:
    """Raise UsageError if nodes elsewhere could not be found, or the page could not be shown."""
    if options.elsewhere and "ROS_DOMAIN_ID" not in os.environ:
        raise UsageError("--elsewhere: set ROS_DOMAIN_ID, to the same number on every host")
    check_heartbeat(options, protocol)  # the page may have been started before
    options.page_parameters = checked_page(options, protocol) if options.page else {}


def run(options: argparse.Namespace) -> int:
    """Run one experiment and print its outcome."""
    protocol, bag = checked_run(options)
    check_nodes(options, protocol)
    exactly = options.out is not None
    with claimed_domain() as domain, claimed_folder(bag, exactly=exactly) as folder:
        run_experiment(
            protocol,
            folder,
            domain,
            options,
            while_walking=partial(load_report, not options.no_figures),
            once_recorded=partial(report, options=options),
            quiet=options.json,
        )
    return 0


def run_experiment(
    protocol: Protocol,
    bag: Path,
    domain: int,
    options: argparse.Namespace,
    *,
    while_walking: Callable[[], None] = lambda: None,
    once_recorded: Callable[[Path], None] | None = None,
    quiet: bool = False,
    about: Mapping[str, str] | None = None,
) -> None:
    """
    Start the nodes, conduct the protocol, stop the nodes.

    The bag keeps ``about`` in addition to what it holds for every run.
    """
    with (
        closing(StopListener(RUN_CLIENT)) as early,
        supervised(
            domain, STOP_ORDER, partial(kept, bag), real_time=options.real_time
        ) as supervisor,
    ):
        given = chosen_parameters(protocol, bag, options)
        nodes, elsewhere = nodes_for(options.walker), {*options.elsewhere}
        if ROLE in elsewhere:  # it only has to play the role
            player = given["experiment"]["walker"]
            given["experiment"]["participants"].remove(player)
            given["bag_recorder"]["publishers"].remove(player)
            given["experiment"]["walker"] = ROLE
            elsewhere.update(WALKERS[options.walker])
        given[PAGE] |= options.page_parameters
        given["perturbator"]["operators"] = [RUN_CLIENT, *([PAGE] if options.heartbeat else [])]
        custom_data = json.loads(given["bag_recorder"]["custom_data"])
        given["bag_recorder"]["custom_data"] = json.dumps(custom_data | dict(about or {}))
        arguments = parameter_arguments(given, supervisor.folder)
        for node in nodes:
            if node not in elsewhere:
                supervisor.start(node, arguments)
        if options.page:
            start_page(supervisor, arguments, options)
        # Not at the top: it loads ROS, and errors in the options are reported without it.
        from gait_entrainment_bringup.run_client import SILENCE_TIMEOUT, conduct

        real = not find_driver(protocol.driver).simulated
        silence = PERSON_SILENCE if real else SILENCE_TIMEOUT
        conduct(
            supervisor,
            protocol,
            while_walking,
            quiet=quiet,
            real_time=options.real_time,
            silence=silence,
            early=early,
        )
        supervisor.wait_for_record()
        # There is no torque any more and the record is closed: the rest may end in any order.
        supervisor.request_stop(nodes)
        (bag / "protocol.yaml").write_text(write_protocol(protocol))
        if once_recorded:
            once_recorded(bag)


def start_page(
    supervisor: Supervisor, arguments: Sequence[str], options: argparse.Namespace
) -> None:
    """Start the operator's page and print its address, since its own output goes to its log."""
    supervisor.start(PAGE, arguments, "gait_entrainment_page")
    Access.of_environment(options.host).announce(options.page_parameters["port"])


def report(bag: Path, options: argparse.Namespace) -> None:
    """Print the outcome of a run, and draw its figures."""
    figures = not options.no_figures
    importlib.import_module(REPORT).report(bag, figures=figures, as_json=options.json)


def load_report(figures: bool) -> None:
    """Load in a thread what the end of a run needs."""
    modules = (REPORT, *DRAWING) if figures else (REPORT,)

    def load() -> None:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))  # not urgent
        for module in modules:
            importlib.import_module(module)

    threading.Thread(target=load, daemon=True).start()


def kept(bag: Path) -> str:
    """
    Make what is left of a failed run readable; return a message that says where it is.

    A recorder that was killed could not close the bag; what reached the file is recovered.
    """
    if not any(bag.glob("*")):  # if the disk was full, there is not even a folder
        return ""
    try:
        BagReader(bag).close()
    except UnreadableBagError:
        damaged = bag.with_name(f"{bag.name}_unfinished")
        try:
            bag.rename(damaged)
            recover(damaged, bag)
            shutil.rmtree(damaged)
        except (BagError, OSError) as error:
            return f"; the bag was not closed and could not be recovered: {error}"
        return f"; the bag was not closed; what could be recovered is in {bag}"
    return f"; the bag of the run so far is {bag}"
