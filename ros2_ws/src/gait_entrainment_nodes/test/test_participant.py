# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS arguments that every node accepts: names, qualities of service, parameters, --help."""

import sys
from contextlib import contextmanager

import pytest
import rclpy
import yaml
from rclpy.parameter import Parameter

from gait_entrainment.settings import SettingError, settings_of
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.nodes import experiment, gait_analyzer, walker_sim
from gait_entrainment_nodes.nodes.experiment import Experiment
from gait_entrainment_nodes.nodes.gait_analyzer import GaitAnalyzerNode
from gait_entrainment_nodes.nodes.gait_detector import GaitDetector
from gait_entrainment_nodes.nodes.parameters import HelpRequestedError
from gait_entrainment_nodes.nodes.sensor_sim import SensorSim
from gait_entrainment_nodes.nodes.walker_sim import WalkerSim


@contextmanager
def node(make, *arguments):
    """Make a node as a process with these arguments would."""
    rclpy.init(args=["--ros-args", *arguments])
    made = None
    try:
        made = make()
        yield made
    finally:
        if made is not None:
            made.destroy_node()
        rclpy.shutdown()


def names(made):
    """Return the names of the topics that a node publishes."""
    found = made.get_publisher_names_and_types_by_node(made.get_name(), made.get_namespace())
    return {name for name, _ in found}


def test_topics_under_a_nodes_name_follow_its_name():
    with node(Experiment, "-r", "__node:=trial", "-r", "__ns:=/lab") as made:
        assert {"/lab/trial/state", "/lab/trial/horizon", "/diagnostics"} <= names(made)
        assert not any("experiment" in name for name in names(made))


def test_other_publishers_of_a_topic_that_must_have_one_publisher_are_named():
    events = topics.GAIT_EVENTS
    with node(WalkerSim) as made:
        assert made.rivals(events) == ""
        other = rclpy.create_node("other_walker")
        other.create_publisher(events.type, events.name, events.qos)
        text = "gait_events is published by other_walker and walker_sim; a run needs one publisher"
        assert made.rivals(events) == text
        other.destroy_node()


def test_a_quality_of_service_is_accepted_if_a_run_allows_it():
    chosen = "qos_overrides./diagnostics.publisher"
    with node(
        Experiment, "-p", f"{chosen}.depth:=7", "-p", f"{chosen}.history:=keep_last"
    ) as made:
        assert made.get_parameter(f"{chosen}.depth").value == 7
    assert topics.VIEWED.depth == 100  # that of the other nodes in this process
    state = "qos_overrides./gait/entrainment.publisher"
    with node(GaitAnalyzerNode, "-p", f"{state}.depth:=2000") as made:
        (info,) = made.get_publishers_info_by_topic("/gait/entrainment")
        assert info.qos_profile.durability == topics.LATEST_STATE.durability


@pytest.mark.parametrize(
    "override",
    [
        "/gait/strides.publisher.reliability:=best_effort",
        "/gait/strides.publisher.history:=keep_last",
        "/gait/entrainment.publisher.depth:=5",
        "/gait_events.subscription.reliability:=best_effort",
    ],
)
def test_a_quality_of_service_with_which_a_run_would_lose_messages_is_refused(override):
    simulated = ("-p", "use_sim_time:=true")
    with (
        pytest.raises(SettingError, match=r"is refused: a run depends on this topic") as caught,
        node(GaitAnalyzerNode, *simulated, "-p", f"qos_overrides.{override}"),
    ):
        pass
    topic = override.rpartition(".")[0]
    assert str(caught.value).startswith(f"qos_overrides.{topic}: ")
    assert "allowed: history keep_" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_quality_of_service_of_an_unknown_topic_is_warned_about(capfd):
    with node(Experiment, "-p", "qos_overrides./nowhere.publisher.depth:=7") as made:
        made.offer_ready()
    assert "does not take: qos_overrides./nowhere.publisher.depth" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("make", "module"),
    [(Experiment, experiment), (GaitAnalyzerNode, gait_analyzer), (WalkerSim, walker_sim)],
)
def test_help_lists_what_a_node_accepts(make, module, monkeypatch):
    name = module.__name__.rpartition(".")[2]
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    with pytest.raises(HelpRequestedError) as caught, node(make):
        pass
    text = str(caught.value)
    assert text.startswith(f"usage: {name} [--ros-args ")
    assert module.__doc__.strip().splitlines()[0] in text
    for name, setting in settings_of(module.Settings).items():
        assert f"\n  {name}: {setting.meaning}" in text


@pytest.mark.parametrize("make", [WalkerSim, SensorSim])
def test_a_walk_awaits_the_torque_of_both_ankles_if_both_are_pushed(make):
    with node(make, "-p", "both_ankles:=true") as made:
        assert made.new_walk().ankles == 2


@pytest.mark.parametrize("make", [Experiment, GaitAnalyzerNode, WalkerSim])
def test_dumped_parameters_start_the_node_again_without_a_warning(make, tmp_path, capfd):
    with node(make) as made:
        values = {n: p.value for n, p in made._parameters.items() if not n.startswith("qos")}
        name = made.get_fully_qualified_name()
    file = tmp_path / "dumped.yaml"
    file.write_text(yaml.safe_dump({name: {"ros__parameters": values}}))
    capfd.readouterr()
    with node(make, "--params-file", str(file)) as made:
        made.offer_ready()
        assert {n: made.get_parameter(n).value for n in values} == values
    # Fast DDS may report a port of a suspended process, as this process is not one of ours.
    printed = capfd.readouterr().err.splitlines()
    assert [line for line in printed if "RTPS_TRANSPORT_SHM" not in line] == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("-p", "left_topic:=insole", "-p", "right_topic:=/insole"),
        ("-r", "ground_reaction/right:=ground_reaction/left"),
    ],
)
def test_both_feet_on_one_topic_are_refused(arguments):
    refused = "left_topic, right_topic: both are"
    with pytest.raises(ValueError, match=refused), node(GaitDetector, *arguments):
        pass


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("mass", 70, ""),  # a whole number is accepted for a real one, as at startup
        ("seed", 1.5, "Wrong parameter type"),
        ("mas", 70.0, "mas: unknown parameter"),
    ],
)
def test_a_parameter_is_set_as_a_person_writes_it(name, value, reason):
    with node(WalkerSim) as made:
        result = made.set_parameters_atomically([Parameter(name, value=value)])
        assert result.successful == (not reason)
        assert result.reason.startswith(reason)
        assert made.walker.mass == (80.0 if reason else 70.0)
