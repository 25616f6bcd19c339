# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One list of nodes and parameters: nodes declare exactly those that are given or listed."""

from pathlib import Path

import pytest
import rclpy
import yaml

from gait_entrainment.protocol import DEFAULT_PROTOCOL
from gait_entrainment.settings import settings_of
from gait_entrainment_bags import BagWriter, TopicInfo, find_definition
from gait_entrainment_bringup.node_list import (
    DISPLAY,
    NODES,
    PAGE,
    STOP_ORDER,
    WALKERS,
    nodes_for,
    parameter_arguments,
    parameters,
    replay_parameters,
    settings_file,
)
from gait_entrainment_bringup.run_options import check_walker
from gait_entrainment_nodes.messaging.environment import shared_file
from gait_entrainment_nodes.nodes.bag_player import BagPlayer
from gait_entrainment_nodes.nodes.bag_recorder import BagRecorder
from gait_entrainment_nodes.nodes.experiment import Experiment
from gait_entrainment_nodes.nodes.gait_analyzer import GaitAnalyzerNode
from gait_entrainment_nodes.nodes.gait_detector import GaitDetector
from gait_entrainment_nodes.nodes.perturbator import Perturbator
from gait_entrainment_nodes.nodes.sensor_sim import SensorSim
from gait_entrainment_nodes.nodes.walker_display import WalkerDisplay
from gait_entrainment_nodes.nodes.walker_sim import WalkerSim
from gait_entrainment_page import operator_page

BAG = Path(__file__).parents[4] / "bags" / "paper_example"
CLASSES = (
    WalkerSim,
    SensorSim,
    GaitDetector,
    Perturbator,
    GaitAnalyzerNode,
    Experiment,
    BagRecorder,
    BagPlayer,
    WalkerDisplay,
)
ALL = {*NODES, *nodes_for("sensed"), "bag_player"}
# Not in the file: from ROS, set by the mode or the launch file, or for nodes started by hand.
ELSEWHERE = {
    *(f"{name}.use_sim_time" for name in ALL),
    *(f"{name}.start_type_description_service" for name in (*ALL, DISPLAY)),
    "experiment.longest_lookahead",
    "experiment.longest_clock_offset",
    "perturbator.operator_timeout",
    "perturbator.operators",
    "experiment.protocol",
    "bag_recorder.topics",
    "bag_player.remap",
}


def declared(arguments):
    """Start every node with arguments; return its parameters by full name."""
    rclpy.init(args=arguments)
    found = {}
    for make in CLASSES:  # the type of a topic in an older bag may differ from a node's
        node = make()
        parameters = node._parameters.items()
        found |= {f"{node.get_name()}.{n}": p.value for n, p in parameters if n != "output"}
        node.destroy_node()
    rclpy.shutdown()
    return found


def full_names(tree, prefix=""):
    """Return the names of nested parameters."""
    for name, item in tree.items():
        if isinstance(item, dict):
            yield from full_names(item, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"


def test_file_lists_user_parameters_with_their_defaults(tmp_path):
    file = yaml.safe_load(settings_file().read_text())
    del file[f"/**/{PAGE}"]  # tested below
    listed = set(
        full_names({n.removeprefix("/**/"): p["ros__parameters"] for n, p in file.items()})
    )
    found = []
    for folder in (tmp_path / "with", tmp_path / "without"):
        folder.mkdir()
        given = parameters(DEFAULT_PROTOCOL, folder / "bag")
        given |= parameters(DEFAULT_PROTOCOL, folder / "bag", walker="sensed")
        given["bag_player"] = replay_parameters(BAG)[1]["bag_player"]
        arguments = parameter_arguments(given, folder)
        if folder.name == "without":
            arguments = [word for word in arguments if word != str(settings_file())]
            arguments.remove("--params-file")
        # A node refuses a parameter that it does not have.
        found.append(declared(arguments))
    assert found[0] == found[1]
    elsewhere = set(full_names(given)) | ELSEWHERE
    assert listed == (set(found[0]) - elsewhere)


@pytest.mark.parametrize("node", [*sorted(ALL), DISPLAY, PAGE])
def test_launch_finds_the_executable_of_each_node(node):
    package = "gait_entrainment_page" if node == PAGE else "gait_entrainment_nodes"
    prefix = shared_file(package, "package.xml").parents[2]
    assert (prefix / "lib" / package / node).exists()


def test_file_lists_user_parameters_of_the_page_with_their_defaults():
    # The node itself is not started: it would serve the page.
    file = yaml.safe_load(settings_file().read_text())
    listed = file[f"/**/{PAGE}"]["ros__parameters"]
    set_by_run = ("command", "record")
    names = [name for name in settings_of(operator_page.Settings) if name not in set_by_run]
    assert listed == {name: getattr(operator_page.Settings, name) for name in names}


@pytest.mark.parametrize("real_time", [False, True])
def test_parameters_are_given_to_every_node(real_time):
    given = parameters(DEFAULT_PROTOCOL, Path("/bag"), real_time=real_time)
    assert set(given) == {*NODES, DISPLAY, PAGE}
    walker = given["walker_sim"]
    assert walker["ankle_stiffness"] == 87.3
    assert walker["real_time"] is real_time
    # Only in lock-step does the walker wait for the recorder.
    assert walker["acknowledged"] is not real_time
    assert ("longest_lookahead" in given["experiment"]) is real_time
    sides = {given["perturbator"]["side"], given["gait_analyzer"]["side"]}
    assert sides == {"right"} == {walker["first_heel_strike"]}
    assert set(given["bag_recorder"]["publishers"]) == set(NODES) - {"bag_recorder"}
    assert "experiment" not in given["experiment"]["participants"]


@pytest.mark.parametrize(
    ("walker", "detector", "warning"),
    [
        ("sensed", "ankle_encoder", "ankle_encoder: a fallback: no toe-offs"),
        ("sensed", "shank_gyroscope", ""),
        ("person", "shank_gyroscope", ""),
        ("person", "ankle_encoder:decision=0.1", "no entrainment verdict can rest on them"),
        ("simulated", "ankle_encoder", ""),
    ],
)
def test_limitations_of_a_detector_are_printed_before_a_run(walker, detector, warning, capsys):
    check_walker(walker, detector, real_time=True)
    error = capsys.readouterr().err
    assert warning in error
    assert bool(error) == bool(warning)


@pytest.mark.parametrize("walker", WALKERS)
def test_every_kind_of_walker_takes_part_in_the_experiment(walker):
    given = parameters(DEFAULT_PROTOCOL, Path("/bag"), real_time=True, walker=walker)
    role, lead = given["experiment"]["walker"], given["experiment"]["longest_lookahead"]
    assert set(given) == {*nodes_for(walker), DISPLAY, PAGE}
    assert role in given["experiment"]["participants"]
    # Events of a sensed walker are known later, by the detector's latency.
    assert (lead == 0.3) is (walker == "simulated")
    assert 0.3 <= lead < 0.5


def test_torque_is_stopped_first_and_the_record_last():
    assert set(STOP_ORDER) == {*NODES, *nodes_for("sensed"), DISPLAY, PAGE}
    assert STOP_ORDER[0] == "perturbator"
    assert STOP_ORDER[-1] == "bag_recorder"


def test_a_bag_of_an_earlier_version_is_replayed_under_current_names(tmp_path):
    progress = "gait_entrainment_msgs/msg/Progress"
    event = "gait_entrainment_msgs/msg/GaitEvent"
    metadata = {"protocol": "{baseline: 20}\n"}
    bag = BagWriter(tmp_path / "bag", ros_distro="jazzy", custom_data=metadata)
    for name, kind in (
        ("/truth/gait_events", event),
        ("/gait_events", event),
        ("/walker_sim/progress", progress),
    ):
        bag.add_topic(TopicInfo(name, kind, find_definition(kind).schema_text))
        bag.write(name, bytes(64), 1, 1)
    bag.close()
    namespace, given = replay_parameters(tmp_path / "bag")
    assert namespace == ""
    assert given["bag_player"]["remap"] == ["/walker_sim/progress:=/walker/progress"]
    assert "/walker/progress" in given["bag_player"]["expect"]
