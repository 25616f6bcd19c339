# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Conduct one protocol with the nodes and record it: `entrain run` as a launch file.

Nodes and parameters are those of `entrain run`. The experiment brings up the perturbator, and the
launch ends with the experiment: exit code 0 and the outcome once it is over and recorded, 1 if it
failed. Whatever would make it fail from the start is reported before a node is started. Another
program may record it, after a delay in which that program finds the topics (docs/bags.md).
"""

from pathlib import Path

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import EmitEvent, OpaqueFunction, TimerAction
from launch.events import Shutdown

from gait_entrainment.protocol import read_protocol, write_protocol
from gait_entrainment.settings import Setting
from gait_entrainment_bringup import launch_nodes as shared
from gait_entrainment_bringup.node_list import (
    DETECTOR,
    RECORDER,
    WALKERS,
    bag_folder,
    nodes_for,
    parameters,
)
from gait_entrainment_bringup.run_options import check_output, check_robot, check_walker

DELAY = Setting("from the start of the other nodes to that of the experiment", float, "s", 0, 600)


def nodes(context: LaunchContext) -> list[Action]:
    """Make the nodes once the arguments are known: their parameters depend on the protocol."""
    protocol = read_protocol(shared.value(context, "protocol") or None, to_run=True)
    real_time = shared.is_true(context, "real_time")
    arming = {"armed": "arm", "unproved": "unproved"}
    switches = {name: shared.is_true(context, argument) for name, argument in arming.items()}
    onset = shared.choice(context, "onset", "commanded", "measured")
    recorded = shared.choice(context, "recorder", RECORDER, "none") == RECORDER
    delay = DELAY.parse("start_delay", shared.value(context, "start_delay"))
    bag = None
    if recorded:
        bag = Path(shared.value(context, "bag") or bag_folder(protocol)).absolute()
        check_output(bag, "bag")
    elif shared.value(context, "bag"):
        raise shared.LaunchError("bag: not recorded with recorder:=none; leave one of them out")
    check_robot(protocol, real_time=real_time, **switches)
    walking = {
        "walker": shared.choice(context, "walker", *WALKERS),
        "detector": shared.value(context, "detector"),
    }
    check_walker(**walking, real_time=real_time)
    given = parameters(protocol, bag, real_time=real_time, onset=onset, **switches, **walking)
    given["experiment"]["protocol"] = write_protocol(protocol)
    namespace = shared.value(context, "namespace")
    names = [name for name in nodes_for(walking["walker"]) if recorded or name != RECORDER]
    made = [shared.make_node(context, name, namespace, given[name]) for name in names]
    over: list[Action] = [EmitEvent(event=Shutdown(reason="the experiment is over"))]
    if recorded:
        over.insert(0, OpaqueFunction(function=report, args=[bag]))
    ending = shared.ended_by(made, {"experiment", RECORDER} & set(names), over, bag)
    *others, experiment = made  # as in the list of nodes
    later = TimerAction(period=delay, actions=[experiment]) if delay else experiment
    seen = [*shared.rviz(context, namespace, given), *shared.page(context, namespace, given)]
    return [*ending, *seen, *others, later]


def report(_: LaunchContext, bag: Path) -> None:
    """Print the outcome of the run, and where its bag is."""
    # Not at the top: it takes a second to load.
    from gait_entrainment_bringup.run_report import report

    report(bag, figures=False, as_json=False)


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments, then make the nodes."""
    return shared.description(
        nodes,
        ("protocol", "", "protocol file (YAML); empty: the paper's example"),
        ("real_time", "false", "run at the pace of the wall clock, not in lock-step"),
        ("arm", "false", "let a real ankle robot deliver torque right away: see safety.md"),
        ("unproved", "false", "even if its own watchdog was not proved on this computer"),
        ("walker", "simulated", "who walks: simulated, sensed (through sensors) or person"),
        ("detector", DETECTOR, "what finds the gait events of a sensed walker or a person"),
        ("onset", "commanded", "onset of a pulse for the analyzer: commanded or measured"),
        ("recorder", RECORDER, "or none: another program records, such as ros2 bag record"),
        ("start_delay", "0", "seconds before the run in which another recorder finds the topics"),
        ("bag", "", "folder of the bag; empty: bags/<time>_<name>"),
        shared.NAMESPACE,
        shared.PARAMETERS_FILE,
        shared.RVIZ,
        shared.SHOW_PAGE,
    )
