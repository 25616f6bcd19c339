# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The recorder as a process: what it keeps, and how, even if it is killed or the disk is full."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import yaml
from harness import TIMEOUT, Probe, probe, session
from rcl_interfaces.msg import ParameterEvent
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty

from gait_entrainment.simulation import simulate
from gait_entrainment_bags import (
    BagReader,
    BagWriter,
    TopicInfo,
    UnreadableBagError,
    check,
    find_definition,
    recover,
)
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_bringup.node_list import NODES
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_msgs.msg import Progress, PublishedCounts
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.environment import shared_file
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.messaging.topics import (
    CLOCK,
    EVERY_MESSAGE,
    LATEST_STATE,
    PUBLISHED_COUNTS,
    RECORDER_PROGRESS,
    WALKER_PROGRESS,
    Topic,
)
from gait_entrainment_sensors.sources import ENCODER, FOOT, SHANK, SWITCH

SECOND = 10**9
RECORDER = (
    "import sys; from gait_entrainment_nodes.nodes.bag_recorder import main; sys.exit(main())"
)
# A disk that is full after this many bytes, although the reserved space is still there.
FULL_DISK = """
import errno
from gait_entrainment_bags import writer

class File:
    def __init__(self, path):
        self.file, self.reported = path.open("xb", buffering=0), False
    def write(self, data):
        if self.file.tell() > 20_000 and not self.reported:
            self.reported = True
            raise OSError(errno.ENOSPC, "No space left on device")
        return self.file.write(data)
    def fileno(self):
        return self.file.fileno()
    def close(self):
        self.file.close()

writer._open_new = File
"""


class Recorder:
    """A recorder process in the domain of a probe."""

    def __init__(self, bag: Path, domain: int, parameters: Sequence[str], before: str) -> None:
        self.bag = bag
        self.log = bag.with_suffix(".log")
        arguments = ["--ros-args"]
        for parameter in (f"output:={bag}", "publishers:=[walker_sim]", *parameters):
            arguments += ["-p", parameter]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", before + RECORDER, *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            )

    def wait(self) -> int:
        return self.process.wait(TIMEOUT)

    def finish(self, listener: Probe, **counts: int) -> int:
        """Send the recorder the final counts; it ends once it has written all those messages."""
        made = listener.node.create_publisher(
            PUBLISHED_COUNTS.type, PUBLISHED_COUNTS.name, PUBLISHED_COUNTS.qos
        )
        listener.until(made.get_subscription_count, "the recorder")
        topics = [f"/{topic}" for topic in counts]
        made.publish(PublishedCounts(node="/walker_sim", topics=topics))  # invalid: no counts
        made.publish(
            PublishedCounts(node="/walker_sim", topics=topics, counts=list(counts.values()))
        )
        return self.wait()

    @property
    def text(self) -> str:
        return self.log.read_text()


@contextmanager
def recorder(folder: Path, *parameters: str, before: str = "") -> Iterator[tuple[Recorder, Probe]]:
    with claimed_domain() as domain, probe(domain) as listener:
        process = Recorder(folder / "bag", domain, parameters, before)
        try:
            yield process, listener
        finally:
            process.process.kill()
            process.process.wait()


def joints(number: int, stamp: int) -> JointState:
    return JointState(header=header(stamp), name=["l_hip"], position=[float(number)])


def publisher(listener: Probe, topic: str, qos: QoSProfile = EVERY_MESSAGE) -> Any:
    """Return a publisher that the recorder has found."""
    made = listener.node.create_publisher(JointState, topic, qos)
    listener.until(made.get_subscription_count, f"the recorder on {topic}")
    return made


def numbers(bag: Path, topic: str) -> list[int]:
    with BagReader(bag) as reader:
        return [int(message.position[0]) for _, message in reader.decoded([topic])]


def test_a_killed_recorder_loses_less_than_a_second(tmp_path: Path) -> None:
    draw = random.Random(4)
    for trial in range(5):
        folder = tmp_path / str(trial)
        folder.mkdir()
        with recorder(folder) as (process, listener):
            publishers = [publisher(listener, topic) for topic in ("left", "right")]
            begin = time.monotonic_ns()
            end = begin + round(draw.uniform(0.2, 2.2) * SECOND)
            sent: list[int] = []  # steady time of each message
            while (now := time.monotonic_ns()) < end:
                # 1000 per second, by absolute deadlines.
                while len(sent) < (now - begin) // 1_000_000:
                    for each in publishers:
                        each.publish(joints(len(sent), SECOND + len(sent)))
                    sent.append(now)
                listener.node.executor.spin_once(timeout_sec=0.001)
            process.process.send_signal(signal.SIGKILL)
            process.wait()
        with pytest.raises(UnreadableBagError, match="entrain bag recover"):
            BagReader(process.bag)
        rescued = recover(process.bag, folder / "rescued")
        assert check(rescued.folder) == []
        assert any("never closed" in loss for loss in rescued.losses)
        due = sum(at < end - SECOND for at in sent)
        for topic in ("/left", "/right"):
            if topic in rescued.counts:
                found = numbers(rescued.folder, topic)
                assert found == list(range(len(found)))
            assert rescued.counts.get(topic, 0) >= due


@pytest.mark.parametrize("required", [False, True])
def test_a_full_disk_ends_the_recording_and_the_run_only_if_required(
    tmp_path: Path, required: bool
) -> None:
    with recorder(tmp_path, f"required:={required}".lower(), before=FULL_DISK) as (
        process,
        listener,
    ):
        acknowledged = listener.listen(RECORDER_PROGRESS)
        progress = listener.node.create_publisher(
            WALKER_PROGRESS.type, WALKER_PROGRESS.name, WALKER_PROGRESS.qos
        )
        listener.until(progress.get_subscription_count, "the recorder")
        samples = publisher(listener, "joint_states")
        sent = 0

        def full() -> bool:
            nonlocal sent
            noise = random.Random(sent).randbytes(2000).hex()
            state = joints(sent, SECOND + sent)
            state.header.frame_id = noise
            samples.publish(state)
            sent += 1
            return "disk full" in process.text

        listener.until(full, "the disk to be full")
        if required:
            assert process.wait() == 1
        else:
            # Nodes that wait for the recorder go on. It fails when the run ends.
            progress.publish(Progress(header=header(SECOND), grant=7, samples=10**6))
            listener.until(lambda: acknowledged, "an acknowledgement")
            assert acknowledged[0].grant == 7
            assert process.finish(listener, joint_states=sent) == 1
            assert "the recording ended before the run did" in process.text
    assert "closed and readable" in process.text
    assert [f.rule for f in check(process.bag)] == []
    with BagReader(process.bag) as bag:
        assert bag.custom_data["ended_early"].startswith("disk full after")
        assert 0 < bag.counts["/joint_states"] < sent
    assert numbers(process.bag, "/joint_states") == list(range(bag.counts["/joint_states"]))


def test_topics_are_selected_discovered_late_and_described_as_offered(tmp_path: Path) -> None:
    best_effort = QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=5, reliability=ReliabilityPolicy.BEST_EFFORT
    )
    with recorder(tmp_path, "topics:=[/left, /late, /nothing]") as (process, listener):
        left = publisher(listener, "left")
        unwanted = listener.node.create_publisher(JointState, "unwanted", EVERY_MESSAGE)
        for number in range(3):
            left.publish(joints(number, (number + 1) * SECOND))
            unwanted.publish(joints(number, SECOND))
        late = publisher(listener, "late", best_effort)
        late.publish(joints(0, 5 * SECOND))
        # Stamped less than a minute before the previous message, it is logged at that one's time.
        left.publish(joints(3, 2 * SECOND))
        assert process.finish(listener, left=4, late=1) == 0
        assert "4 messages of /left" in process.text
    assert check(process.bag) == []
    assert numbers(process.bag, "/left") == [0, 1, 2, 3]
    with BagReader(process.bag) as bag:
        # The counts that end a recording are always received, and so they are recorded.
        assert set(bag.topics) == {"/left", "/late", "/published_counts"}
        times = [message.log_time // SECOND for message in bag.messages(["/left"])]
        assert times == [1, 2, 3, 3]
        (offered,) = bag.topics["/late"].qos_profiles
        assert (offered.reliability, offered.durability) == ("best_effort", "volatile")
        (offered,) = bag.topics["/left"].qos_profiles
        assert offered.reliability == "reliable"


def size_of(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


@pytest.mark.parametrize("split", ["max_duration:=1.5", "max_bytes:=4000"])
def test_a_recording_is_split(tmp_path: Path, split: str) -> None:
    with recorder(tmp_path, split) as (process, listener):
        left = publisher(listener, "left")
        for number in range(40):
            left.publish(joints(number, SECOND + number * SECOND // 10))
            if number % 10 == 9:
                size = size_of(process.bag)
                listener.until(lambda size=size: size_of(process.bag) > size, "data in the file")
        assert process.finish(listener, left=40) == 0
    assert check(process.bag) == []
    assert len(list(process.bag.glob("*.mcap"))) > 1
    assert numbers(process.bag, "/left") == list(range(40))


def test_messages_before_ros_time_starts_are_logged_at_its_start(tmp_path: Path) -> None:
    with recorder(tmp_path, "use_sim_time:=true") as (process, listener):
        empty = listener.node.create_publisher(Empty, "empty", EVERY_MESSAGE)
        clock = listener.node.create_publisher(CLOCK.type, CLOCK.name, CLOCK.qos)
        left = publisher(listener, "left")
        event = listener.node.create_publisher(ParameterEvent, "event", EVERY_MESSAGE)
        for made in (empty, clock, event):
            listener.until(made.get_subscription_count, "the recorder")
        empty.publish(Empty())
        # As rclpy stamps the events of a node under construction.
        event.publish(ParameterEvent(stamp=to_time(time.time_ns())))
        left.publish(joints(0, 0))  # a stamp of zero means no stamp
        left.publish(joints(1, 77 * SECOND))
        clock.publish(CLOCK.type(clock=to_time(78 * SECOND)))
        empty.publish(Empty())
        size = size_of(process.bag)
        listener.until(lambda: size_of(process.bag) > size, "data in the file")
        left.publish(joints(2, 78 * SECOND + 3600 * SECOND))  # an hour ahead of ROS time
        for tick in (3600 * SECOND, -2 * SECOND, 78 * SECOND):  # the first two are impossible
            clock.publish(CLOCK.type(clock=to_time(tick)))
        assert process.finish(listener, left=3, clock=4, empty=2, event=1) == 0
    assert check(process.bag) == []
    with BagReader(process.bag) as bag:
        assert bag.start == 77 * SECOND
        assert bag.end <= 78 * SECOND
        assert bag.counts["/empty"] == 2
    assert numbers(process.bag, "/left") == [0, 1, 2]


def test_an_existing_folder_is_not_touched(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", ros_distro="jazzy"):
        pass
    before = {file: file.read_bytes() for file in (tmp_path / "bag").iterdir()}
    with recorder(tmp_path) as (process, _):
        assert process.wait() == 2
    assert "already exists" in process.text
    assert {file: file.read_bytes() for file in (tmp_path / "bag").iterdir()} == before


@pytest.mark.parametrize("named", [False, True], ids=["default names", "same name"])
def test_runs_that_start_together_leave_each_others_bags_alone(
    tmp_path: Path, named: bool
) -> None:
    command = ["entrain", "run", "--json", "--no-figures", "--sample-rate=0", "--baseline=2"]
    command += ["--pulses=1", "--washout=0", *(["--out=mine"] if named else [])]
    runs = [
        subprocess.Popen(
            command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    outputs = [run.communicate(timeout=TIMEOUT) for run in runs]
    codes = sorted(run.returncode for run in runs)
    assert codes == ([0, 2, 2] if named else [0, 0, 0]), outputs
    bags = list(tmp_path.iterdir()) if named else list((tmp_path / "bags").iterdir())
    assert len(bags) == codes.count(0)
    for bag in bags:
        with BagReader(bag) as reader:
            assert reader.message_count == sum(1 for _ in reader.messages()) > 0
        assert check(bag) == []
    refused = [err for _, err in outputs if err]
    assert all("already exists; a bag is never overwritten" in text for text in refused)


def test_lost_messages_are_counted_and_recorded(tmp_path: Path) -> None:
    with recorder(tmp_path) as (process, listener):
        publisher(listener, "left").publish(joints(0, SECOND))
        assert process.finish(listener, left=3) == 1
    assert "the record is incomplete: 2 of /left lost" in process.text
    with BagReader(process.bag) as bag:
        assert json.loads(bag.custom_data["messages_lost"]) == {"/left": 2}


def test_another_recorder_hears_a_whole_run_in_lock_step(tmp_path: Path) -> None:
    file = shared_file("gait_entrainment_bringup", "config/ros2_bag_record.yaml")
    chosen = {
        name: QoSProfile(
            history=HistoryPolicy.get_from_short_key(quality["history"]),
            reliability=ReliabilityPolicy.get_from_short_key(quality["reliability"]),
            durability=DurabilityPolicy.get_from_short_key(quality["durability"]),
        )
        for name, quality in yaml.safe_load(file.read_text()).items()
    }
    types = {f"/{topic.name.lstrip('/')}": topic.type for topic in every_topic()}
    options = ("--baseline=3", "--pulses=4", "--washout=1")
    others = [name for name in NODES if name != "bag_recorder"]
    with (
        session(tmp_path, *options, nodes=others, real_time=False) as nodes,
        BagWriter(tmp_path / "theirs", ros_distro="jazzy", custom_data={}) as bag,
    ):
        ended: dict[str, int] = {}

        def record(name: str, data: bytes) -> None:
            bag.write(name, data, time.time_ns(), time.time_ns())
            if name == "/published_counts":
                counts = deserialize_message(data, PublishedCounts)
                ended.update(zip(counts.topics, counts.counts, strict=True))

        for name, quality in chosen.items():
            kind = types[name]
            definition = find_definition(f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}")
            bag.add_topic(
                TopicInfo(name, definition.type, definition.schema_text, definition.type_hash)
            )
            nodes.probe.node.create_subscription(
                kind, name, partial(record, name), quality, raw=True
            )
        handle = nodes.conduct()
        result = nodes.probe.client.result(handle, TIMEOUT).result
        assert result.outcome == RunProtocol.Result.FINISHED, result.message
        nodes.probe.until(
            lambda: (
                ended.get("/experiment/horizon")
                and all(bag.counts[name] >= n for name, n in ended.items() if name in chosen)
            ),
            "the final counts",
        )
    run = read_run(tmp_path / "theirs", protocol=nodes.protocol)
    assert run.differences == ()
    start = run.events[0].stamp
    simulated = simulate(nodes.protocol).events
    assert [e.stamp - start for e in run.events] == [e.stamp for e in simulated]


def test_settings_for_another_recorder_list_every_topic_that_counts() -> None:
    file = shared_file("gait_entrainment_bringup", "config/ros2_bag_record.yaml")
    assert yaml.safe_load(file.read_text()) == {
        f"/{topic.name.lstrip('/')}": {
            "history": "keep_all",
            "reliability": "reliable",
            "durability": topic.qos.durability.short_key,
        }
        for topic in every_topic()
        if topic.qos in (EVERY_MESSAGE, LATEST_STATE)
    }


def every_topic() -> Iterator[Topic]:
    for source in (ENCODER, FOOT, SHANK, SWITCH):
        yield from topics.sensor_topics(source)
    for value in vars(topics).values():
        if isinstance(value, Topic):
            yield value
        elif isinstance(value, tuple) and value and isinstance(value[0], Topic):
            yield from value
