# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain node: one node of an experiment, for runs over several hosts or containers."""

import argparse
import importlib
import sys
import tempfile
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import write_protocol
from gait_entrainment_bringup.node_list import WALKERS, nodes_for, parameter_arguments
from gait_entrainment_bringup.run_options import add_run_options, checked_run, chosen_parameters
from gait_entrainment_nodes.messaging.domain import wanted_domain
from gait_entrainment_nodes.messaging.environment import PACKAGE, set_environment

DESCRIPTION = (
    "Run one node with the parameters that follow from the protocol and the options. The "
    "experiment conducts the protocol right away; bag_recorder ends by itself once the record is "
    "complete; the others run until they are stopped."
)
EXAMPLES = """examples:
  ROS_DOMAIN_ID=42 entrain node walker_sim               here; the rest on another host, by
  ROS_DOMAIN_ID=42 entrain run --elsewhere walker_sim
  entrain node experiment protocol.yaml                  conducts it, then ends

Each node gets what entrain run would give it: give all of them the same protocol and options.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    nodes = list(dict.fromkeys(node for walker in WALKERS for node in nodes_for(walker)))
    parser.add_argument("node", choices=nodes, metavar="NODE", help=", ".join(nodes))
    add_run_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run the node to its end and return its exit code."""
    domain = wanted_domain() or 0
    drives, records = options.node == "perturbator", options.node == "bag_recorder"
    protocol, bag = checked_run(options, drives=drives, records=records)
    set_environment(domain, real_time=options.real_time)
    given = chosen_parameters(protocol, bag, options)
    given["experiment"]["protocol"] = write_protocol(protocol)
    if options.node not in given:
        raise UsageError(f"NODE: {options.node} is not used with --walker {options.walker}")
    with tempfile.TemporaryDirectory(prefix="entrain_") as folder:
        arguments = parameter_arguments({options.node: given[options.node]}, Path(folder))
        sys.argv = [options.node, *arguments]
        return int(importlib.import_module(f"{PACKAGE}.nodes.{options.node}").main())
