# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
bag_player: publishes what a bag holds, each message at its time, or as fast as it is taken.

Messages are published as bytes, never decoded. Before the first one it waits until the expected
subscriptions have been matched, so that nothing of the start is lost. It is the sole owner of
/clock: ticks lie at fixed instants of the bag, the same at every rate.
"""

import math
import struct
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags import (
    FASTEST,
    BagError,
    BagReader,
    DefinitionMissingError,
    Moment,
    Playback,
    TopicInfo,
    choose_topics,
    find_definition,
)
from gait_entrainment_msgs.srv import Burst, GetRate, IsPaused, Play, Seek, SetRate
from gait_entrainment_nodes.messaging.raw_messages import message_class
from gait_entrainment_nodes.messaging.stamps import to_nanoseconds
from gait_entrainment_nodes.messaging.topics import CLOCK, Topic
from gait_entrainment_nodes.nodes.lateness import Lateness
from gait_entrainment_nodes.nodes.node import Participant, declare, declare_texts, run_node

# How often matching is looked after before the first message [s].
MATCHING_PERIOD = 0.02
# So many messages at most are published before services and signals are looked after again.
BURST_LENGTH = 200
# At the end slow readers have so long to receive the last messages [s].
FAREWELL = 30.0
# What a writer keeps for late-comers where the bag does not say it.
KEPT = 1000
_CDR_LITTLE_ENDIAN = b"\0\1\0\0"


class BagPlayer(Participant, Node):
    """ROS side of a playback. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("bag_player")
        bag = declare(self, "bag", "", "bag to play: a folder or an .mcap file")
        if not bag:
            raise ValueError("bag: is empty; give the folder of the bag to play")
        declare(
            self,
            "rate",
            1.0,
            "seconds of the bag per second; 0 for as fast as it goes",
            unit="1",
            within=(0.0, 1e6),
            read_only=False,
        )
        loop = declare(self, "loop", False, "begin again at the end")
        paused = declare(self, "start_paused", False, "start paused")
        start_offset = _seconds(self, "start_offset", 0.0, "where in the bag to start")
        duration = _seconds(self, "duration", 0.0, "how much of it to play; 0: all")
        topics = declare_texts(self, "topics", "topics to play, * for any text; empty plays all")
        excluded = declare_texts(self, "exclude", "topics to leave out, * for any text")
        remaps = declare_texts(self, "remap", "other names for topics: /from:=/to")
        clock_rate = declare(
            self,
            "clock",
            40.0,
            "ticks of /clock per second of the bag; 0: none, a recorded /clock is played",
            unit="Hz",
            within=(0.0, 1000.0),
        )
        self.expected = declare_texts(
            self,
            "expect",
            "topics that must have a subscription before the first message; one that must have "
            "two is named twice",
        )
        self.patience = _seconds(
            self, "expect_timeout", 30.0, "how long to wait for them; 0: for ever"
        )
        self.stay = declare(self, "stay", False, "stay at the end, for ~/play and ~/seek")
        self.playback: Playback | None = None
        self.begin_participation()
        try:
            self.bag = BagReader(bag)
            self.playback = Playback(
                self.bag,
                self.playable(choose_topics(self.bag, topics, excluded), bool(clock_rate)),
                start_offset=start_offset,
                duration=duration or math.inf,
                rate=self.rate,
                loop=loop,
                paused=paused,
                clock_period=1 / clock_rate if clock_rate else 0.0,
            )
        except BagError as error:
            raise ValueError(str(error)) from None
        names = dict(_split_remap(remap) for remap in remaps)
        if unknown := names.keys() - self.bag.topics.keys():
            raise ValueError(f"remap: no topic {sorted(unknown)[0]} in the bag")
        self.players = {
            name: self.publisher(
                Topic(names.get(name, name), message_type, _offer(self.bag.topics[name]))
            )
            for name, message_type in self.types.items()
        }
        self.forgetful = {
            name
            for name in self.players
            if _offer(self.bag.topics[name]).history == HistoryPolicy.KEEP_LAST
        }
        self.clock_publisher = self.publisher(CLOCK) if clock_rate else None
        played = {p.topic_name for p in self.players.values()}
        if missing := sorted(set(self.expected) - played):
            raise ValueError(f"expect: {missing[0]} is not played")
        self.note_state(DiagnosticStatus.OK, "plays")
        self.begun = False
        self.look_at = time.monotonic()  # when matching is looked after next
        self.give_up_at = time.monotonic() + (self.patience or math.inf)
        self.lateness = Lateness()  # of messages, from due to published
        for name, service, answer in (
            ("pause", Trigger, self.on_pause),
            ("resume", Trigger, self.on_resume),
            ("toggle_paused", Trigger, self.on_toggle_paused),
            ("stop", Trigger, self.on_stop_request),
            ("play_next", Trigger, self.on_play_next),
            ("is_paused", IsPaused, self.on_is_paused),
            ("get_rate", GetRate, self.on_get_rate),
            ("set_rate", SetRate, self.on_set_rate),
            ("seek", Seek, self.on_seek),
            ("burst", Burst, self.on_burst),
            ("play", Play, self.on_play),
        ):
            self.create_service(service, f"~/{name}", answer)

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """Play at another rate from now on."""
        rate = value("rate") or FASTEST
        if self.playback is not None:
            self.playback.set_rate(rate, time.monotonic_ns())
        self.rate = rate

    def playable(self, topics: list[str], own_clock: bool) -> list[str]:
        """Return those topics whose type is installed here as it was recorded."""
        self.types: dict[str, Any] = {}
        for name in topics:
            topic = self.bag.topics[name]
            if own_clock and name == "/clock":
                continue
            try:
                installed = find_definition(topic.type)
                message_type = message_class(topic.type)
            except (DefinitionMissingError, ImportError, AttributeError) as error:
                self.get_logger().error(f"{name} is not played: {error}")
                continue
            if topic.type_hash and topic.type_hash != installed.type_hash:
                self.get_logger().error(
                    f"{name} is not played: the installed {topic.type} is not the recorded one"
                )
                continue
            self.types[name] = message_type
        return list(self.types)

    # The start

    def missing_subscriptions(self) -> str:
        """Return the topics whose expected subscriptions have not all been matched."""
        by_name = {player.topic_name: player for player in self.players.values()}
        missing = [
            name
            for name in sorted(set(self.expected))
            if by_name[name].matched < self.expected.count(name)
        ]
        return ", ".join(missing)

    def not_ready(self) -> str:
        """Return what is waited for before the first message."""
        missing = self.missing_subscriptions()
        return f"subscriptions of {missing}" if missing else super().not_ready()

    def wait_for_subscriptions(self) -> None:
        """Begin once all subscriptions have been matched; give up after a while."""
        self.look_at = time.monotonic() + MATCHING_PERIOD
        waiting = self.not_ready()
        if not waiting:
            self.begun = True
            self.playback.begin(time.monotonic_ns())
        elif time.monotonic() > self.give_up_at:
            self.failure = f"no {waiting} within {self.patience:g} s; nothing was played"

    # Pacing

    def next_deadline(self) -> float | None:
        """Return when the next message is due, on steady time [s]."""
        if not self.begun:
            return self.look_at
        due = self.playback.due()
        return None if due is None else due / NANOSECONDS_PER_SECOND

    def on_deadline(self) -> None:
        """Publish what is due by now, in order."""
        if not self.begun:
            self.wait_for_subscriptions()
            return
        playback = self.playback
        try:
            for _ in range(BURST_LENGTH):
                due, now = playback.due(), time.monotonic_ns()
                if due is None or (moment := playback.take(now)) is None:
                    break
                if playback.rate != FASTEST:
                    self.lateness.add((now - due) / NANOSECONDS_PER_SECOND)
                self.send(moment)
        except BagError as error:
            self.failure = str(error)
        self.end_if_played()

    def send(self, moment: Moment) -> None:
        """Publish a message or a tick; wait where a reader does not keep up."""
        if moment.message is None:
            if self.clock_publisher is not None:
                self.clock_publisher.publish(clock_message(moment.instant))
            return
        player = self.players[moment.message.topic]
        player.publish(moment.message.data)
        # Who keeps all waits by itself; who keeps the last ones for late-comers would overwrite.
        if moment.message.topic in self.forgetful and player.count % (KEPT // 2) == 0:
            player.wait_for_readers()

    def end_if_played(self) -> None:
        """End the node once everything was played and received, unless it is to stay."""
        if not self.playback.ended or self.stay or self.finished:
            return
        self.publish_counts(0, self.bag.end)
        give_up = time.monotonic() + FAREWELL
        for player in self.players.values():
            if not player.wait_for_readers(give_up - time.monotonic()):
                self.failure = (
                    f"a reader of {player.topic_name} has not received its last messages within "
                    f"{FAREWELL:g} s"
                )
        self.finished = True

    def on_stop(self) -> None:
        """Say how much was played, and how late."""
        self.playback.stop()
        self.bag.close()
        count = sum(player.count for player in self.players.values())
        late = self.lateness
        pace = (
            f"; late by {1e3 * late.quantile(0.5):.2f} ms (median), {1e3 * late.worst:.2f} ms "
            "at worst"
            if late.count
            else ""
        )
        self.get_logger().info(f"{count} messages played{pace}")

    # Services

    def on_pause(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Stop at the present instant."""
        self.playback.pause(time.monotonic_ns())
        response.success = True
        return response

    def on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Go on from there."""
        self.playback.resume(time.monotonic_ns())
        response.success = True
        return response

    def on_toggle_paused(self, request: Trigger.Request, response: Trigger.Response) -> Any:
        """Pause, or go on; the message says which."""
        was_paused = self.playback.paused
        response = (self.on_resume if was_paused else self.on_pause)(request, response)
        response.message = "goes on" if was_paused else "paused"
        return response

    def on_is_paused(self, _: IsPaused.Request, response: IsPaused.Response) -> Any:
        """Say whether it is paused."""
        response.paused = self.playback.paused
        return response

    def on_get_rate(self, _: GetRate.Request, response: GetRate.Response) -> Any:
        """Tell the rate."""
        response.rate = self.playback.rate
        return response

    def on_set_rate(self, request: SetRate.Request, response: SetRate.Response) -> Any:
        """Change the parameter, which plays at that rate from now on."""
        if not request.rate > 0:
            response.message = f"rate: {request.rate:g}; allowed: above 0"
            return response
        rate = 0.0 if math.isinf(request.rate) else request.rate
        (result,) = self.set_parameters([Parameter("rate", value=rate)])
        response.success, response.message = result.successful, result.reason
        return response

    def on_seek(self, request: Seek.Request, response: Seek.Response) -> Any:
        """Go on at another instant of the bag."""
        try:
            self.playback.seek(to_nanoseconds(request.time), time.monotonic_ns())
            response.success = True
        except BagError as error:
            response.message = str(error)
        return response

    def on_play_next(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Publish the next message while paused."""
        if not self.playback.paused:
            response.message = "not paused"
        elif not self.play_next(1):
            response.message = "nothing is left to play"
        else:
            response.success = True
        return response

    def on_burst(self, request: Burst.Request, response: Burst.Response) -> Any:
        """Publish the next messages while paused."""
        if self.playback.paused:
            response.actually_burst = self.play_next(request.num_messages or math.inf)
        return response

    def play_next(self, count: float) -> int:
        """Publish so many messages, with the ticks before them; return how many there were."""
        played = 0
        try:
            while self.begun and played < count and (moment := self.playback.take_next()):
                self.send(moment)
                played += moment.message is not None
        except BagError as error:
            self.failure = str(error)
        self.end_if_played()
        return played

    def on_play(self, request: Play.Request, response: Play.Response) -> Any:
        """Play anew, once everything was played."""
        if not self.playback.ended:
            response.message = "still playing; pause, seek or stop instead"
            return response
        try:
            self.playback.play(
                to_nanoseconds(request.start_offset),
                to_nanoseconds(request.playback_duration),
                time.monotonic_ns(),
            )
            response.success = True
        except BagError as error:
            response.message = str(error)
        return response

    def on_stop_request(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Play no more."""
        self.playback.stop()
        self.end_if_played()
        response.success = True
        return response


def clock_message(instant: int) -> bytes:
    """Return a serialized /clock message."""
    sec, nanosec = divmod(instant, NANOSECONDS_PER_SECOND)
    return _CDR_LITTLE_ENDIAN + struct.pack("<iI", sec, nanosec)


def _seconds(node: Node, name: str, default: float, description: str) -> float:
    """Declare a parameter that holds a length of time."""
    return float(declare(node, name, default, description, unit="s", within=(0.0, 1e9)))


def _split_remap(remap: str) -> tuple[str, str]:
    old, separator, new = remap.partition(":=")
    if not (old and separator and new):
        raise ValueError(f"remap: {remap!r}; allowed: /from:=/to")
    return old, new


def _offer(topic: TopicInfo) -> QoSProfile:
    """
    Return the quality to publish with: what the publishers offered that asked most of a reader.

    A reliable offer serves every reader, a lasting one too. Discovery does not tell how much a
    publisher keeps, so a player keeps all: it waits for a reader rather than overwrite.
    """
    lasting = any(qos.durability == "transient_local" for qos in topic.qos_profiles)
    best_effort = topic.qos_profiles and all(
        qos.reliability == "best_effort" for qos in topic.qos_profiles
    )
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST if lasting or best_effort else HistoryPolicy.KEEP_ALL,
        depth=KEPT,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if lasting else DurabilityPolicy.VOLATILE,
    )


def main() -> int:
    """Run the node."""
    return run_node(BagPlayer)
