# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0


"""The launch files with the real launch: exit codes, namespaces, remapping, replay, a device."""

import os
import signal
import sys
import textwrap
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory
from harness import Feet, Started, alive, probe, stamp_of
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState

from gait_entrainment.protocol import read_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_bringup.node_list import NODES, nodes_for
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.topics import GAIT_EVENTS, STRIDES, Topic

pytestmark = pytest.mark.skipif(
    find_spec("ros2launch") is None, reason="needs ros2 launch, which the wheels do not include"
)

FILES = Path(get_package_share_directory("gait_entrainment_bringup")) / "launch"
BAG = Path(__file__).parents[2] / "bags" / "paper_example"
# What `ros2 launch` does with a file and arguments.
ROS2_LAUNCH = (
    "import sys; from ros2launch.api import launch_a_launch_file as go;"
    "sys.exit(go(launch_file_path=sys.argv[1], launch_file_arguments=sys.argv[2:]))"
)


class Launch(Started):
    """One ``ros2 launch`` as a process."""

    def __init__(
        self, file: Path, out: Path, domain: int, *arguments: str, **environment: str
    ) -> None:
        command = [sys.executable, "-c", ROS2_LAUNCH, str(file), *arguments]
        logs = str(out.with_suffix(".logs"))
        super().__init__(command, out, ROS_DOMAIN_ID=str(domain), ROS_LOG_DIR=logs, **environment)


@contextmanager
def launched(file, out, domain, *arguments, **environment):
    """Start a launch file; leave no process behind."""
    launch = Launch(FILES / file, out, domain, *arguments, **environment)
    try:
        yield launch
    finally:
        launch.end()


def short_protocol(folder, name, pulses):
    file = folder / f"{name}.yaml"
    file.write_text(f"{{name: {name}, baseline: 4, pulses: {{count: {pulses}}}, washout: 2}}")
    return file


def recorded_events(bag):
    """Return a bag's topics, its events since the start and the simulated events."""
    with BagReader(bag) as reader:
        topic = next(name for name in reader.topics if name.endswith("/gait_events"))
        events = [message for _, message in reader.decoded([topic])]
        simulation = simulate(read_protocol(reader.custom_data["protocol"]))
        simulated = [(e.stamp, int(e.kind), int(e.side), e.step) for e in simulation.events]
        topics = set(reader.topics)
    start = stamp_of(events[0].header)
    recorded = [(stamp_of(e.header) - start, e.kind, e.side, e.step) for e in events]
    return topics, recorded, simulated


@pytest.mark.parametrize("name", ["experiment", "replay", "device_only"])
def test_every_argument_is_documented(name):
    from launch import LaunchContext
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    source = PythonLaunchDescriptionSource(str(FILES / f"{name}.launch.py"))
    arguments = source.get_launch_description(LaunchContext()).get_launch_arguments()
    assert {"namespace", "params_file"} <= {argument.name for argument in arguments}
    for argument in arguments:
        assert argument.description not in ("", "no description given")


def test_experiment_ends_the_launch_with_success(tmp_path):
    file, bag = short_protocol(tmp_path, "alone", 6), tmp_path / "bag"
    with (
        claimed_domain() as domain,
        launched(
            "experiment.launch.py", tmp_path / "out", domain, f"protocol:={file}", f"bag:={bag}"
        ) as launch,
    ):
        launch.find_nodes()
        assert launch.wait() == 0, launch.text
        assert launch.survivors() == []
    assert launch.text.count("started in ROS domain") == len(NODES)
    assert "\nverdict          undecided" in launch.text
    assert f"\nbag              {bag}\n" in launch.text
    topics, recorded, simulated = recorded_events(bag)
    assert recorded == simulated
    assert {"/clock", "/joint_states", "/gait/strides", "/rosout"} <= topics
    run = read_run(bag)
    assert (run.lost, run.differences) == (0, ())


@pytest.mark.parametrize("walker", ["sensed", "person"])
def test_a_walker_can_be_seen_through_sensors(walker, tmp_path):
    bag = tmp_path / "bag"
    arguments = [
        *(f"protocol:={short_protocol(tmp_path, walker, 3)}", f"bag:={bag}", f"walker:={walker}"),
        f"real_time:={str(walker == 'person').lower()}",
    ]
    with (
        claimed_domain() as domain,
        launched("experiment.launch.py", tmp_path / "out", domain, *arguments) as launch,
        probe(domain) as listener,
    ):
        if walker == "person":
            Feet(listener).until(lambda: not alive(launch.process.pid), "the end")
        assert launch.wait() == 0, launch.text
    assert launch.text.count("started in ROS domain") == len(nodes_for(walker))
    run = read_run(bag)
    assert (run.lost, len(run.strides)) == (0, 9)
    assert bool(run.detector_errors) == (walker == "sensed")
    with BagReader(bag) as reader:
        events = [message for _, message in reader.decoded(["/gait_events"])]
    assert {event.detector for event in events} == {"vertical_force"}


def test_another_recorder_may_record_a_run_that_starts_later(tmp_path):
    file = short_protocol(tmp_path, "theirs", 4)
    arguments = (f"protocol:={file}", "recorder:=none", "start_delay:=3")
    others = [name for name in NODES if name != "bag_recorder"]
    with (
        claimed_domain() as domain,
        launched("experiment.launch.py", tmp_path / "out", domain, *arguments) as launch,
    ):
        with probe(domain) as listener:
            listener.client.wait_to_be_known("perturbator")
            assert "experiment" not in listener.node.get_node_names()
            events = listener.listen(GAIT_EVENTS)
            listener.until(lambda: events, "the run")
        launch.find_nodes(others)
        assert launch.wait() == 0, launch.text
    assert "\nbag  " not in launch.text
    assert events[0].step == 0


def fake_rviz(prefix):
    """Make a package rviz2 that saves its arguments to a file and then waits; return the file."""
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "rviz2").touch()
    program = prefix / "lib/rviz2/rviz2"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\necho "$@" > {prefix}/arguments\nexec sleep infinity\n')
    program.chmod(0o755)
    return prefix / "arguments"


def test_experiment_is_drawn_for_rviz(tmp_path):
    file, bag = short_protocol(tmp_path, "drawn", 6), tmp_path / "bag"
    arguments = fake_rviz(tmp_path / "rviz")
    prefixes = f"{tmp_path / 'rviz'}:{os.environ['AMENT_PREFIX_PATH']}"
    words = (f"protocol:={file}", f"bag:={bag}", "rviz:=true", "namespace:=lab")
    with (
        claimed_domain() as domain,
        launched(
            "experiment.launch.py", tmp_path / "out", domain, *words, AMENT_PREFIX_PATH=prefixes
        ) as launch,
    ):
        launch.find_nodes()
        assert launch.wait() == 0, launch.text
        assert launch.survivors() == []
    assert "walker.rviz" in arguments.read_text()
    assert "/tf:=tf" in arguments.read_text()
    with BagReader(bag) as reader:
        assert reader.counts["/lab/tf"] > 100
        assert reader.counts["/lab/robot_description"] == 1


def test_two_experiments_run_side_by_side(tmp_path):
    bags = {name: tmp_path / name for name in ("left", "right")}
    protocols = {
        name: short_protocol(tmp_path, name, n) for name, n in (("left", 5), ("right", 7))
    }
    # One is included by another launch file, which pushes a namespace and remaps.
    other = tmp_path / "other.launch.py"
    other.write_text(
        textwrap.dedent(
            f"""
            from launch import LaunchDescription
            from launch.actions import GroupAction, IncludeLaunchDescription
            from launch_ros.actions import PushRosNamespace, SetRemap

            def generate_launch_description():
                arguments = {{"protocol": "{protocols["right"]}", "bag": "{bags["right"]}"}}
                file = "{FILES / "experiment.launch.py"}"
                return LaunchDescription([GroupAction([
                    PushRosNamespace("laboratory"),
                    SetRemap("joint_states", "robot/joint_states"),
                    IncludeLaunchDescription(file, launch_arguments=arguments.items()),
                ])])
            """
        )
    )
    alone = ["namespace:=a/left", f"protocol:={protocols['left']}", f"bag:={bags['left']}"]
    with (
        claimed_domain() as domain,
        launched("experiment.launch.py", tmp_path / "l", domain, *alone) as first,
        launched(other, tmp_path / "r", domain) as second,
    ):
        assert first.wait() == 0, first.text
        assert second.wait() == 0, second.text
    for name, namespace, pulses in (("left", "/a/left", 5), ("right", "/laboratory", 7)):
        topics, recorded, simulated = recorded_events(bags[name])
        assert recorded == simulated
        assert {topic for topic in topics if not topic.startswith(f"{namespace}/")} == set()
        assert {f"{namespace}/clock", f"{namespace}/diagnostics"} <= topics
        with BagReader(bags[name]) as reader:
            assert reader.counts[f"{namespace}/gait/pulse_phases"] == pulses
    assert "/laboratory/robot/joint_states" in topics
    assert "/laboratory/joint_states" not in topics


@pytest.mark.parametrize("node", ["gait_analyzer", "experiment"])
def test_death_of_a_node_fails_the_launch_and_ends_everything(node, tmp_path):
    bag, free = tmp_path / "bag", tmp_path / "free.yaml"
    free.write_text("/**/operator_page: {ros__parameters: {port: 0}}")
    words = (f"bag:={bag}", "real_time:=true", "page:=true", f"params_file:={free}")
    with (
        claimed_domain() as domain,
        launched("experiment.launch.py", tmp_path / "out", domain, *words) as launch,
        probe(domain) as listener,
    ):
        strides = listener.listen(STRIDES)
        launch.find_nodes()
        listener.until(lambda: strides or not alive(launch.process.pid), "strides")
        listener.until(lambda: "page: http://127.0.0.1:" in launch.text, "the page")
        os.kill(launch.nodes[node], signal.SIGKILL)
        assert launch.wait() == 1, launch.text
        assert f"{node} ended with exit code -9" in launch.text
        assert launch.text.count(f"the bag of the run so far is {bag}") == 1
        assert launch.survivors() == []
    with BagReader(bag) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count > 100


def test_failed_experiment_fails_the_launch(tmp_path):
    file = tmp_path / "fall.yaml"
    file.write_text("{baseline: 2, pulses: {count: 20, torque: -30, width: 0.4, period: 0.9}}")
    bag = tmp_path / "bag"
    with (
        claimed_domain() as domain,
        launched(
            "experiment.launch.py", tmp_path / "out", domain, f"protocol:={file}", f"bag:={bag}"
        ) as launch,
    ):
        launch.find_nodes()
        assert launch.wait() == 1, launch.text
        assert "The walker fell" in launch.text
        assert f"the bag of the run so far is {bag}" in launch.text
        assert launch.survivors() == []
    # Readable, but launch stops all nodes together, so the last messages may be missing.
    assert read_run(bag).messages > 1000


def test_replay_ends_once_everything_is_played_and_analyzed(tmp_path):
    paused = tmp_path / "paused.yaml"
    paused.write_text("/**/bag_player: {ros__parameters: {start_paused: true, rate: 0.0}}")
    with (
        claimed_domain() as domain,
        probe(domain) as listener,
        launched(
            "replay.launch.py",
            tmp_path / "out",
            domain,
            f"bag:={BAG}",
            f"params_file:={paused}",
            "namespace:=again",
        ) as launch,
    ):
        heard = listener.listen(Topic("again/gait/strides", STRIDES.type, STRIDES.qos))

        def matched():
            answer = listener.call(Ready, "again/gait_analyzer/ready")
            matched = dict(zip(answer.topics, answer.matched, strict=True))
            return answer.ready and matched["/again/gait/strides"] == 1

        listener.until(matched, "a match with the analyzer")
        listener.call(srv.Resume, "again/bag_player/resume")
        listener.until(lambda: not alive(launch.process.pid), "the end")
        assert launch.wait() == 0, launch.text
    with BagReader(BAG) as reader:
        recorded = [message.period for _, message in reader.decoded(["/gait/strides"])]
    assert [stride.period for stride in heard] == recorded


def test_device_is_brought_up_and_an_interruption_ends_the_launch(tmp_path):
    with (
        claimed_domain() as domain,
        launched(
            "device_only.launch.py", tmp_path / "out", domain, "driver:=emulated", "side:=left"
        ) as launch,
        probe(domain) as listener,
    ):
        launch.find_nodes(("perturbator", "gait_analyzer"))

        def state():
            return listener.call(GetState, "perturbator/get_state").current_state.id

        listener.until(lambda: state() == State.PRIMARY_STATE_ACTIVE, "activation")
        strides = listener.listen(STRIDES)
        kind, name, qos = GAIT_EVENTS.type, GAIT_EVENTS.name, GAIT_EVENTS.qos
        events = listener.node.create_publisher(kind, name, qos)
        listener.client.wait_to_be_known("gait_analyzer")
        listener.until(events.get_subscription_count, "the analyzer")
        for step in range(5):
            event = kind(run=1, kind=0, side=(1 + step) % 2, step=step, source="sensor")
            event.header.stamp.sec = step + 1
            events.publish(event)
        listener.until(lambda: strides, "strides")
        assert strides[0].period == 2.0
        launch.process.send_signal(signal.SIGINT)
        assert launch.wait() == 0, launch.text
        assert launch.survivors() == []


@pytest.mark.parametrize(
    ("file", "argument", "words"),
    [
        ("experiment", f"bag:={BAG}", f"bag: {BAG} already exists"),
        ("experiment", "protocol:=nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("experiment", "params_file:=nowhere.yaml", "nowhere.yaml: no such file"),
        ("experiment", "onset:=felt", "onset: 'felt'; allowed: commanded, measured"),
        ("experiment", "recorder:=nobody", "recorder: 'nobody'; allowed: bag_recorder, none"),
        ("experiment", "start_delay:=soon", "start_delay: 'soon'; allowed: 0 to 600 s"),
        ("replay", "bag:=nowhere", "nowhere: no such file"),
        ("replay", "rate:=fast", "rate: 'fast'; allowed: at least 0"),
        ("device_only", "driver:=nosuch", "'nosuch' is unknown; allowed: "),
        ("device_only", "side:=middle", "side: 'middle'; allowed: left, right"),
    ],
)
def test_a_mistake_is_found_before_a_node_is_started(file, argument, words, tmp_path):
    needed = {"replay": [f"bag:={BAG}"], "device_only": ["driver:=ideal"]}
    arguments = [*needed.get(file, []), argument]
    with (
        claimed_domain() as domain,
        launched(f"{file}.launch.py", tmp_path / "out", domain, *arguments) as launch,
    ):
        assert launch.wait() == 1, launch.text
    assert words in launch.text
    assert "process started" not in launch.text
