# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
bag_recorder: records topics into an MCAP bag that rosbag2 opens, and says what it missed.

Messages are taken and written as bytes, never decoded. In lock-step it sends the walker's
progress back once everything that it covers is written. At the end of a run it holds its counts
against those of the publishers. Where the disk is full the recording ends, closed and readable;
the run goes on unless the record is required.
"""

import json
import os
import struct
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.serialization import deserialize_message

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags import (
    BagError,
    BagWriter,
    Definition,
    DefinitionMissingError,
    TopicInfo,
    find_definition,
)
from gait_entrainment_bags import QosProfile as OfferedQos
from gait_entrainment_msgs.msg import Progress, PublishedCounts
from gait_entrainment_nodes.messaging.raw_messages import message_class
from gait_entrainment_nodes.messaging.topics import (
    ANKLE_TORQUE,
    GAIT_EVENTS,
    GROUND_REACTION,
    JOINT_STATES,
    PUBLISHED_COUNTS,
    RECORDER_PROGRESS,
    WALKER_PROGRESS,
)
from gait_entrainment_nodes.nodes.node import Participant, declare, declare_texts, run_node

# How often new topics are looked for and data is brought to the file [s].
CARE_PERIOD = 0.2
# How long to wait, after the end of a run, for messages and counts still on their way [s].
CLOSING_TIMEOUT = 5.0
# A message that comes behind one with a later stamp is logged with it, so that a player keeps the
# order; one that is earlier by more [ns] has a clock of its own, and is believed.
LONGEST_OVERTAKING = 60 * NANOSECONDS_PER_SECOND
# A message whose first field is a header or a stamp has it behind four bytes of CDR header.
_STAMP = struct.Struct("<iI")
_STAMPED = ("std_msgs/Header ", "builtin_interfaces/Time ")
# Stamped by the wall clock also where time is simulated: log entries always, parameter events
# while a node is being made. With one of them among simulated stamps a bag would span decades.
_BY_WALL_CLOCK = ("rcl_interfaces/msg/Log", "rcl_interfaces/msg/ParameterEvent")


class BagRecorder(Participant, Node):
    """ROS side of the bag writer. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("bag_recorder")
        output = declare(self, "output", "", "folder of the bag, which must not exist yet")
        if not output:
            raise ValueError("output: is empty; give the folder of the bag to make")
        chosen = "topics to record, fully qualified; empty records all below the node's namespace"
        self.chosen = set(declare_texts(self, "topics", chosen))
        expected = "nodes whose final counts end the recording; empty records until stopped"
        self.expected = set(declare_texts(self, "publishers", expected))
        custom_data = declare(
            self, "custom_data", "{}", "what else belongs to the record: a JSON object of texts"
        )
        max_bytes = declare(
            self,
            "max_bytes",
            0,
            "begin a new file once one is so large; 0: never",
            unit="byte",
            within=(0, 2**62),
        )
        max_duration = declare(
            self,
            "max_duration",
            0.0,
            "begin a new file once one spans so much ROS time; 0: never",
            unit="s",
            within=(0.0, 1e9),
        )
        self.required = declare(
            self, "required", False, "end, and with it the run, where nothing more can be written"
        )
        self.begin_participation()
        try:
            self.bag = BagWriter(
                output,
                ros_distro=os.environ.get("ROS_DISTRO", "jazzy"),
                custom_data=_texts(custom_data),
                max_bytes=max_bytes,
                max_duration=max_duration,
            )
        except BagError as error:
            raise ValueError(f"output: {error}") from None
        # Ready means, for this topic too, that everyone will hear: the walker waits for it.
        self.acknowledge = self.publisher(RECORDER_PROGRESS, recorded=False)
        self.resolved = {
            topic.name: self.resolve_topic_name(topic.name)
            for topic in (
                GAIT_EVENTS,
                JOINT_STATES,
                ANKLE_TORQUE,
                *GROUND_REACTION,
                WALKER_PROGRESS,
                PUBLISHED_COUNTS,
                RECORDER_PROGRESS,
            )
        }
        if self.chosen and self.expected:
            # What tells of the end is heard in any case.
            self.chosen |= {self.resolved[t.name] for t in (PUBLISHED_COUNTS, WALKER_PROGRESS)}
        self.note_state(DiagnosticStatus.OK, "records", output=output)
        self.broken_off = False  # the recording has ended before its time
        self.reason = ""  # why it was broken off
        # Messages that came before ROS time began: topic, bytes, time of reception [ns].
        self.early: list[tuple[str, bytes, int]] = []
        self.latest: dict[str, int] = {}  # log time of the latest message, by topic
        self.offers: dict[str, tuple[OfferedQos, ...]] = {}
        self.beneath = self.get_namespace().rstrip("/") + "/"  # how names in the namespace begin
        self.seen: set[str] = set()  # topics that are recorded, or cannot be
        self.progress: Progress | None = None  # not acknowledged yet
        self.published: dict[str, dict[str, int]] = {}  # by node: final count by topic
        self.final_at: float | None = None  # steady time at which the end of the run was heard of
        self._care_at = time.monotonic()

    # Topics

    def subscribe_to_new_topics(self) -> None:
        """Subscribe to every topic that has a publisher and is not recorded yet."""
        for name, types in self.get_topic_names_and_types():
            hidden = "/_" in name or name == self.resolved[RECORDER_PROGRESS.name]
            chosen = name in self.chosen if self.chosen else name.startswith(self.beneath)
            if hidden or not chosen or not self.count_publishers(name):
                continue
            if name in self.seen:
                self.note_offers(name)
                continue
            self.seen.add(name)
            try:
                definition = find_definition(types[0])
                message_type = message_class(types[0])
            except (DefinitionMissingError, ImportError, AttributeError) as error:
                self.get_logger().error(f"{name} is not recorded: {error}")
                continue
            self.record(name, message_type, definition)

    def record(self, name: str, message_type: Any, definition: Definition) -> None:
        """Subscribe to one topic, in the quality that its publishers offer."""
        offers = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
        self.offers[name] = tuple(_offered(offer) for offer in offers)
        self.bag.add_topic(
            TopicInfo(
                name=name,
                type=definition.type,
                schema_text=definition.schema_text,
                type_hash=definition.type_hash,
                qos_profiles=self.offers[name],
            )
        )
        reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
        lasting = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
        self.create_subscription(
            message_type,
            name,
            self.writer_for(name, definition),
            QoSProfile(
                history=HistoryPolicy.KEEP_ALL,
                reliability=(
                    ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
                ),
                durability=(
                    DurabilityPolicy.TRANSIENT_LOCAL if lasting else DurabilityPolicy.VOLATILE
                ),
            ),
            raw=True,
        )

    def note_offers(self, name: str) -> None:
        """
        Say where a publisher that came later is not recorded.

        The bag keeps what was offered at first: a channel cannot be changed, and readers that
        find another quality in metadata.yaml than in the channel drop the topic.
        """
        known = self.offers.get(name)
        # Asked for by their number first: asking for their quality costs ten times as much.
        if known is None or self.count_publishers(name) <= len(known):
            return
        infos = self.get_publishers_info_by_topic(name)
        self.offers[name] = tuple(_offered(info.qos_profile) for info in infos)
        lossy = {o.reliability for o in self.offers[name]} - {o.reliability for o in known}
        if "best_effort" in lossy and all(o.reliability == "reliable" for o in known):
            self.get_logger().error(
                f"{name}: a publisher that came later is best effort; it is not recorded, since "
                "the recording of this topic began as reliable"
            )

    def writer_for(self, name: str, definition: Definition) -> Callable[[bytes], None]:
        """Return the callback that writes the messages of one topic."""
        stamped = definition.type not in _BY_WALL_CLOCK and _first_field(
            definition.schema_text
        ).startswith(_STAMPED)
        write, wall_clock, unpack = self.bag.write, time.time_ns, _STAMP.unpack_from
        latest = self.latest
        then = {
            self.resolved[WALKER_PROGRESS.name]: self.on_progress,
            self.resolved[PUBLISHED_COUNTS.name]: self.on_counts,
        }.get(name)

        def record(data: bytes) -> None:
            received = wall_clock()
            logged = 0
            if stamped:
                sec, nanosec = unpack(data, 4)
                logged = sec * NANOSECONDS_PER_SECOND + nanosec
            if logged <= 0:
                logged = self.get_clock().now().nanoseconds
            if logged <= 0 or self.early:
                self.record_early(logged, name, data, received)
            if logged > 0 and not self.broken_off:
                before = latest.get(name, 0)
                if 0 < before - logged < LONGEST_OVERTAKING:
                    logged = before
                latest[name] = logged
                try:
                    write(name, data, logged, received)
                except BagError as error:
                    self.break_off(error)
            if then is not None:
                then(data)
            if self.progress is not None:
                self.acknowledge_progress()

        return record

    def record_early(self, logged: int, name: str, data: bytes, received: int) -> None:
        """Keep a message from before ROS time began, or record those once it has begun."""
        if logged <= 0:
            self.early.append((name, data, received))
            return
        early, self.early = self.early, []
        try:
            for topic, content, came in early:
                self.bag.write(topic, content, logged, came)
                self.latest[topic] = logged
        except BagError as error:
            self.break_off(error)

    def break_off(self, error: BagError) -> None:
        """End the recording where nothing more can be written; the run goes on unless told to."""
        if self.broken_off:
            return
        self.broken_off, self.reason = True, str(error)
        if self.required:
            self.failure = str(error)
            return
        self.get_logger().error(f"{error}; the run goes on without a record")
        stamp = self.get_clock().now().nanoseconds
        self.diagnose(stamp, DiagnosticStatus.ERROR, f"the recording has ended: {error}")

    # Lock-step

    def on_progress(self, data: bytes) -> None:
        """Keep a progress message until everything that it covers is written."""
        self.progress = deserialize_message(data, Progress)
        if self.progress.state != Progress.WALKING:
            self.final_at = time.monotonic()

    def acknowledge_progress(self) -> None:
        """Send the progress back once everything that it covers is written."""
        progress, counts = self.progress, {} if self.broken_off else self.bag.counts
        assert progress is not None
        if counts.get(self.resolved[GAIT_EVENTS.name], progress.events) < progress.events:
            return
        for topic in (JOINT_STATES, ANKLE_TORQUE, *GROUND_REACTION):
            if counts.get(self.resolved[topic.name], progress.samples) < progress.samples:
                return
        self.progress = None
        self.acknowledge.publish(progress)

    # The end

    def on_counts(self, data: bytes) -> None:
        """Take a publisher's final counts."""
        message = deserialize_message(data, PublishedCounts)
        node = message.node.rpartition("/")[2]
        self.published[node] = dict(zip(message.topics, message.counts, strict=True))
        if self.final_at is None and self.expected <= self.published.keys():
            self.final_at = time.monotonic()

    def lost(self) -> dict[str, int]:
        """Return how many messages each topic lacks against its publisher's count."""
        published: Counter[str] = Counter()
        for counts in self.published.values():
            published.update(counts)
        recorded = self.bag.counts
        return {
            topic: count - recorded[topic]
            for topic, count in published.items()
            if topic in recorded and recorded[topic] < count
        }

    def next_deadline(self) -> float:
        """Return when topics and the file are looked after next."""
        return self._care_at

    def on_deadline(self) -> None:
        """Look for new topics, bring data to the file, end where everything is there."""
        closing = self.final_at is not None and bool(self.expected)
        self._care_at = time.monotonic() + (0.01 if closing else CARE_PERIOD)
        if not self.broken_off:
            try:
                self.subscribe_to_new_topics()
                self.bag.flush()
            except BagError as error:
                self.break_off(error)
        if self.final_at is None or not self.expected:
            return
        if self.expected <= self.published.keys() and self.broken_off:
            self.failure = f"the recording ended before the run did: {self.reason}"
        elif self.expected <= self.published.keys() and not self.lost():
            self.finished = True
        elif time.monotonic() - self.final_at > CLOSING_TIMEOUT:
            silent = sorted(self.expected - self.published.keys())
            missing = [f"no final count from {', '.join(silent)}"] if silent else []
            missing += [f"{count} of {topic} lost" for topic, count in self.lost().items()]
            self.failure = "the record is incomplete: " + "; ".join(missing)

    def not_ready(self) -> str:
        """Return what is still waited for: nothing, once new topics have been looked for."""
        try:
            self.subscribe_to_new_topics()
        except BagError as error:
            self.break_off(error)
        return super().not_ready()

    def on_stop(self) -> None:
        """Close the bag, with what was lost written into it, and say how much was written."""
        if self.early and not self.broken_off:
            # ROS time never began: the wall clock is the only one there is.
            self.record_early(max(self.latest.values(), default=self.early[0][2]), "", b"", 0)
        for topic, count in sorted(self.bag.counts.items()):
            self.get_logger().info(f"{count} messages of {topic}")
        uncounted = sorted(self.expected - self.published.keys())
        self.bag.custom_data["messages_lost"] = json.dumps(self.lost())
        self.bag.custom_data["publishers_without_final_count"] = json.dumps(uncounted)
        try:
            self.bag.close()
        except BagError as error:
            self.failure = self.failure or str(error)


def _texts(custom_data: str) -> dict[str, str]:
    """Return a JSON object of texts; ValueError where it is none."""
    try:
        texts = json.loads(custom_data)
    except ValueError:
        texts = None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise ValueError(f"custom_data: {custom_data!r}; allowed: a JSON object of texts")
    return texts


def _first_field(schema_text: str) -> str:
    """Return the first line of a message definition that declares a field."""
    for line in schema_text.splitlines():
        declaration = line.split("#")[0].strip()
        if declaration and "=" not in declaration:
            return declaration
    return ""


def _offered(profile: QoSProfile) -> OfferedQos:
    """Return the quality that a publisher offers in the terms of a bag."""
    return OfferedQos(
        history=profile.history.name.lower(),
        depth=profile.depth,
        reliability=profile.reliability.name.lower(),
        durability=profile.durability.name.lower(),
        deadline=profile.deadline.nanoseconds,
        lifespan=profile.lifespan.nanoseconds,
        liveliness=profile.liveliness.name.lower(),
        liveliness_lease_duration=profile.liveliness_lease_duration.nanoseconds,
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def main() -> int:
    """Run the node."""
    return run_node(BagRecorder)
