# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
bag_recorder: records topics into an MCAP bag that rosbag2 can open, and reports what it missed.

Messages are taken and written as bytes, many at a time, and never decoded. In lock-step the node
sends the walker's progress back once everything that it covers is written. At the end of a run it
compares its counts with those of the publishers. If the disk is full, recording stops and the bag
is closed and readable. The run continues unless the record is required.
"""

import json
import os
import struct
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.settings import setting, settings_of
from gait_entrainment_bags import (
    BagError,
    BagWriter,
    Definition,
    DefinitionMissingError,
    TopicInfo,
    find_definition,
)
from gait_entrainment_bags import QosProfile as OfferedQos
from gait_entrainment_bags.definitions import fields_of
from gait_entrainment_msgs.msg import Progress, PublishedCounts
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.raw_messages import message_class
from gait_entrainment_nodes.nodes.parameters import texts
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.rclpy_internals import RawReader

# How often to look for new topics and flush data to the file [s].
UPKEEP_PERIOD = 0.2
# How often to take messages [s]: normally, and while one that a progress covers is missing.
TAKE_PERIOD, COVERED_TAKE_PERIOD = 0.01, 0.001
# Most messages of a topic to take at a time, so that no topic waits long for another.
MOST_AT_ONCE = 1000
# How long to wait after the end of a run for messages and counts still in transit [s].
CLOSING_TIMEOUT = 5.0
# A message that arrives after one with a later stamp is logged with that stamp, so that a player
# keeps the order. A stamp earlier by more than this [ns] is from another clock and is used. One
# ahead of ROS time by more than this is not used: the bag would span years.
LONGEST_OVERTAKING = 60 * NANOSECONDS_PER_SECOND
# If the first field of a message is a header or a stamp, it follows the four-byte CDR header.
_STAMP = struct.Struct("<iI")
_STAMPED = ("std_msgs/Header", "builtin_interfaces/Time")
# Stamped by the wall clock even if time is simulated: log entries always, parameter events while
# a node is created. One of them among simulated stamps would make a bag span decades.
_BY_WALL_CLOCK = ("rcl_interfaces/msg/Log", "rcl_interfaces/msg/ParameterEvent")


@dataclass(frozen=True)
class Settings:
    """Parameters of the node."""

    topics: tuple[str, ...] = texts(
        "topics to record, fully qualified; empty: all in the node's namespace"
    )
    publishers: tuple[str, ...] = texts(
        "nodes whose final counts end the recording; empty: record until stopped"
    )
    output: str = setting("", "folder of the bag, which must not exist yet")
    custom_data: str = setting("{}", "more metadata of the bag: a JSON object of strings")
    max_bytes: int = setting(
        0, "start a new file once one is this large; 0: never", "byte", (0, 2**62)
    )
    max_duration: float = setting(
        0.0, "start a new file once one spans this much ROS time; 0: never", "s", (0.0, 1e9)
    )
    required: bool = setting(False, "end the node and the run if nothing more can be written")


class BagRecorder(Participant):
    """ROS side of the bag writer. See the module docstring."""

    settings: Settings

    def __init__(self) -> None:
        super().__init__("bag_recorder", settings=Settings, fixed=settings_of(Settings))
        self._chosen, self._expected = set(self.settings.topics), set(self.settings.publishers)
        self._bag = self._make_bag()
        # Readiness includes this topic, although it is not counted: the walker waits for it.
        self.offer(topics.RECORDER_PROGRESS, counted=False)
        name = self.resolve_topic_name
        self._progress_topic = name(topics.WALKER_PROGRESS.name)
        self._counts_topic = name(topics.PUBLISHED_COUNTS.name)
        self._own_topic = name(topics.RECORDER_PROGRESS.name)
        self._clock_topic = name(topics.CLOCK.name)
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        # The latest time on that topic that was accepted, and the latest received [ns].
        self._heard_clock = self._latest_tick = 0
        self._believed_until = 0  # no stamp up to here is too far ahead [ns]
        sampled = (topics.JOINT_STATES, topics.ANKLE_TORQUE, *topics.GROUND_REACTION)
        # The topics that a progress message covers, and its field that counts their messages.
        self._covered = {name(topics.GAIT_EVENTS.name): "events"}
        self._covered |= {name(topic.name): "samples" for topic in sampled}
        if self._chosen and self._expected:
            # The topics that announce the end are always needed.
            self._chosen |= {self._progress_topic, self._counts_topic}
        self.note_state(DiagnosticStatus.OK, "recording", output=self.settings.output)
        self._broken_off = ""  # why the recording ended early
        # Messages received before ROS time started: topic, bytes, time of reception [ns].
        self._early: list[tuple[str, bytes, int]] = []
        self._latest: dict[str, int] = {}  # log time of the latest message, by topic
        self._offers: dict[str, tuple[OfferedQos, ...]] = {}
        self._beneath = self.get_namespace().rstrip("/") + "/"  # how names in the namespace begin
        self._seen: set[str] = set()  # topics that are recorded or cannot be recorded
        self._progress: Progress | None = None  # not acknowledged yet
        self._published: dict[str, dict[str, int]] = {}  # final counts by node and topic
        self._final_at: float | None = None  # when the run was reported to end, steady time [s]
        self._upkeep_at = self._take_at = time.monotonic()
        self._readers: list[tuple[RawReader, Callable[[bytes, int], None]]] = []

    def _make_bag(self) -> BagWriter:
        """Create the bag; raises ValueError if that is not possible."""
        settings = self.settings
        if not settings.output:
            raise ValueError("output: is empty; give the folder of the bag to make")
        try:
            return BagWriter(
                settings.output,
                ros_distro=os.environ.get("ROS_DISTRO", "jazzy"),
                custom_data=_texts(settings.custom_data),
                max_bytes=settings.max_bytes,
                max_duration=settings.max_duration,
            )
        except BagError as error:
            raise ValueError(f"output: {error}") from None

    # Topics

    def _subscribe_to_new_topics(self) -> None:
        """Subscribe to every topic that has a publisher and is not recorded yet."""
        for name, types in self.get_topic_names_and_types():
            hidden = "/_" in name or name == self._own_topic
            chosen = name in self._chosen if self._chosen else name.startswith(self._beneath)
            if hidden or not chosen or not self.count_publishers(name):
                continue
            if name in self._seen:
                self._note_offers(name)
                continue
            self._seen.add(name)
            try:
                definition = find_definition(types[0])
                message_type = message_class(types[0])
            except (DefinitionMissingError, ImportError, AttributeError) as error:
                self.get_logger().error(f"{name} is not recorded: {error}")
                continue
            self._record(name, message_type, definition)

    def _record(self, name: str, message_type: Any, definition: Definition) -> None:
        """Subscribe to one topic with the quality of service that its publishers offer."""
        offers = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
        self._offers[name] = tuple(_offered(offer) for offer in offers)
        self._bag.add_topic(
            TopicInfo(
                name=name,
                type=definition.type,
                schema_text=definition.schema_text,
                type_hash=definition.type_hash,
                qos_profiles=self._offers[name],
            )
        )
        reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
        lasting = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
        qos = topics.quality(reliable=reliable, lasting=lasting)
        record = self._writer_for(name, definition)
        if name != self._progress_topic:
            self._readers.append((RawReader(self, message_type, name, qos), record))
            return

        def record_progress(data: bytes) -> None:
            received = time.time_ns()
            self._take_messages()  # what it covers was sent before it
            record(data, received)
            self._take_messages()

        self.subscribe(topics.Topic(name, message_type, qos), record_progress, raw=True)

    def _take_messages(self) -> None:
        """Record what has arrived, in order of arrival."""
        taken, full = [], False
        for reader, record in self._readers:
            found = reader.take(MOST_AT_ONCE)
            full |= len(found) == MOST_AT_ONCE
            taken += [(received, record, data) for received, data in found]
        taken.sort(key=itemgetter(0))
        for received, record, data in taken:
            record(data, received)
        if self._progress is not None:
            self._acknowledge_progress()
        period = TAKE_PERIOD if self._progress is None else COVERED_TAKE_PERIOD
        self._take_at = time.monotonic() + (0.0 if full else period)

    def _note_offers(self, name: str) -> None:
        """
        Report a publisher that joined later and is not recorded.

        The bag keeps the first offers: a channel cannot be changed, and readers drop a topic whose
        quality in metadata.yaml differs from that in the channel.
        """
        known = self._offers.get(name)
        # Check their number first: querying their quality costs ten times as much.
        if known is None or self.count_publishers(name) <= len(known):
            return
        infos = self.get_publishers_info_by_topic(name)
        self._offers[name] = tuple(_offered(info.qos_profile) for info in infos)
        lossy = {o.reliability for o in self._offers[name]} - {o.reliability for o in known}
        if "best_effort" in lossy and all(o.reliability == "reliable" for o in known):
            self.get_logger().error(
                f"{name}: a publisher that joined later is best effort and is not recorded, "
                "because this topic is recorded as reliable"
            )

    def _writer_for(self, name: str, definition: Definition) -> Callable[[bytes, int], None]:
        """Return a function that records a message of one topic, given its reception time [ns]."""
        first = next(fields_of(definition.schema_text, ""), None)
        stamped = definition.type not in _BY_WALL_CLOCK and (
            first is not None and first.type in _STAMPED and first.length is None
        )
        write, unpack, latest = self._bag.write, _STAMP.unpack_from, self._latest
        then = {
            self._progress_topic: self._on_progress,
            self._counts_topic: self._on_counts,
        }.get(name)

        def record(data: bytes, received: int) -> None:
            logged = 0
            if stamped:
                sec, nanosec = unpack(data, 4)
                logged = sec * NANOSECONDS_PER_SECOND + nanosec
            if name == self._clock_topic:
                logged = self._believed_tick(logged)
            elif logged <= 0 or logged > self._believed_until:
                now = self._ros_time(received)
                self._believed_until = now + LONGEST_OVERTAKING
                if logged <= 0 or 0 < now < logged - LONGEST_OVERTAKING:
                    logged = now
            if logged <= 0 or self._early:
                self._record_early(logged, name, data, received)
            if logged > 0 and not self._broken_off:
                before = latest.get(name, 0)
                if 0 < before - logged < LONGEST_OVERTAKING:
                    logged = before
                latest[name] = logged
                try:
                    write(name, data, logged, received)
                except BagError as error:
                    self._break_off(error)
            if then is not None:
                then(data)

        return record

    def _believed_tick(self, tick: int) -> int:
        """Return ROS time [ns] at a tick; a distant tick counts once the next is nearer to it."""
        far = self._heard_clock and abs(tick - self._heard_clock) > LONGEST_OVERTAKING
        if not far or abs(tick - self._latest_tick) < abs(tick - self._heard_clock):
            self._heard_clock = tick
        self._latest_tick = tick
        return self._heard_clock

    def _ros_time(self, received: int) -> int:
        """Return the ROS time [ns] at which a message was received; it may be taken later."""
        if not self._simulated:
            return received
        recorded = self._clock_topic in self._bag.counts
        return self._heard_clock if recorded else self.get_clock().now().nanoseconds

    def _record_early(self, logged: int, name: str, data: bytes, received: int) -> None:
        """Keep a message from before ROS time started, or record those kept once it has."""
        if logged <= 0:
            self._early.append((name, data, received))
            return
        early, self._early = self._early, []
        try:
            for topic, content, arrived in early:
                self._bag.write(topic, content, logged, arrived)
                self._latest[topic] = logged
        except BagError as error:
            self._break_off(error)

    def _break_off(self, error: BagError) -> None:
        """End the recording if nothing more can be written, and the run if it requires one."""
        if self._broken_off:
            return
        self._broken_off = str(error)
        if self.settings.required:
            self.failure = str(error)
            return
        self.get_logger().error(f"{error}; the run continues without a record")
        stamp = self.get_clock().now().nanoseconds
        self.diagnose(stamp, DiagnosticStatus.ERROR, f"the recording has ended: {error}")

    # Lock-step

    def _on_progress(self, data: bytes) -> None:
        """Keep a progress message until everything that it covers is written."""
        self._progress = deserialize_message(data, Progress)
        if self._progress.state != Progress.WALKING:
            self._final_at = time.monotonic()

    def _acknowledge_progress(self) -> None:
        """Send the progress back once everything that it covers is written."""
        progress, counts = self._progress, {} if self._broken_off else self._bag.counts
        assert progress is not None
        for topic, field in self._covered.items():
            covered = getattr(progress, field)
            if counts.get(topic, covered) < covered:
                return
        self._progress = None
        self.publish(topics.RECORDER_PROGRESS, progress)

    # The end

    def _on_counts(self, data: bytes) -> None:
        """Take a publisher's final counts."""
        message = deserialize_message(data, PublishedCounts)
        node = message.node.rpartition("/")[2]
        self._published[node] = dict(zip(message.topics, message.counts, strict=False))
        if self._final_at is None and self._expected <= self._published.keys():
            self._final_at = time.monotonic()

    def _lost(self) -> dict[str, int]:
        """Return how many published messages are missing, by topic."""
        published: Counter[str] = Counter()
        for counts in self._published.values():
            published.update(counts)
        recorded = self._bag.counts
        return {
            topic: count - recorded[topic]
            for topic, count in published.items()
            if topic in recorded and recorded[topic] < count
        }

    def next_deadline(self) -> float:
        """Return when to take messages, or to check for new topics and flush the file."""
        return min(self._take_at, self._upkeep_at)

    def on_deadline(self) -> None:
        """Record what has arrived; less often check topics, the file and the end of the run."""
        self._take_messages()
        if time.monotonic() < self._upkeep_at:
            return
        closing = self._final_at is not None and bool(self._expected)
        self._upkeep_at = time.monotonic() + (0.01 if closing else UPKEEP_PERIOD)
        self._do_upkeep()
        if self._final_at is None or not self._expected:
            return
        if self._expected <= self._published.keys() and self._broken_off:
            self.failure = f"the recording ended before the run did: {self._broken_off}"
        elif self._expected <= self._published.keys() and not self._lost():
            self.finished = True
        elif time.monotonic() - self._final_at > CLOSING_TIMEOUT:
            silent = sorted(self._expected - self._published.keys())
            missing = [f"no final count from {', '.join(silent)}"] if silent else []
            missing += [f"{count} of {topic} lost" for topic, count in self._lost().items()]
            self.failure = "the record is incomplete: " + "; ".join(missing)

    def not_ready(self) -> str:
        """Look for new topics and return what the node waits for."""
        self._do_upkeep()
        return super().not_ready()

    def _do_upkeep(self) -> None:
        """Look for new topics and flush data to the file."""
        if self._broken_off:
            return
        try:
            self._subscribe_to_new_topics()
            self._bag.flush()
            info = {"output": self.settings.output, "messages": sum(self._bag.counts.values())}
            self.note_state(DiagnosticStatus.OK, "recording", **info)
        except BagError as error:
            self._break_off(error)

    def on_stop(self) -> None:
        """Close the bag, noting in it what was lost, and log how much was recorded."""
        self._take_messages()
        for reader, _ in self._readers:
            reader.destroy()
        if self._early and not self._broken_off:
            # ROS time never started, so the wall clock is used.
            self._record_early(max(self._latest.values(), default=self._early[0][2]), "", b"", 0)
        for topic, count in sorted(self._bag.counts.items()):
            self.get_logger().info(f"{count} messages of {topic}")
        uncounted = sorted(self._expected - self._published.keys())
        self._bag.custom_data["messages_lost"] = json.dumps(self._lost())
        self._bag.custom_data["publishers_without_final_count"] = json.dumps(uncounted)
        try:
            self._bag.close()
        except BagError as error:
            self.failure = self.failure or str(error)


def _texts(custom_data: str) -> dict[str, str]:
    """Parse a JSON object of strings; raises ValueError if it is anything else."""
    try:
        texts = json.loads(custom_data)
    except ValueError:
        texts = None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise ValueError(f"custom_data: {custom_data!r}; allowed: a JSON object of strings")
    return texts


def _offered(profile: QoSProfile) -> OfferedQos:
    """Return the quality of service that a publisher offers, as a bag describes it."""
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


main = BagRecorder.main
