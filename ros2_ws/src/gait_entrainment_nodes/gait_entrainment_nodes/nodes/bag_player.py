# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
bag_player: publishes the messages of a bag, each at its time or as fast as readers take them.

Messages are published as bytes and never decoded. Before the first one the node waits until the
expected subscriptions are matched, so that no early message is lost. It is the only publisher of
/clock. Ticks are at fixed times of the bag, independent of the rate.
"""

import math
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.parameter import Parameter
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.settings import setting, settings_of
from gait_entrainment_bags import (
    FASTEST,
    BagError,
    BagReader,
    DefinitionMissingError,
    Moment,
    NothingToPlayError,
    Playback,
    TopicInfo,
    UnreadableBagError,
    choose_topics,
    find_definition,
)
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.older_messages import converter_of
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.raw_messages import message_class
from gait_entrainment_nodes.nodes.lateness import Lateness
from gait_entrainment_nodes.nodes.parameters import texts
from gait_entrainment_nodes.nodes.participant import Participant

# How often to check the matching before the first message [s].
MATCHING_PERIOD = 0.02
# Most messages to publish before services and signals are handled again.
BURST_LENGTH = 200
# How long slow readers have at the end to receive the last messages [s].
FAREWELL = 30.0
# How many messages a transient-local or best-effort writer keeps.
KEPT = 1000
_CDR_LITTLE_ENDIAN = b"\0\1\0\0"
_ANY_LENGTH = (0.0, 1e9)


@dataclass(frozen=True)
class Settings:
    """Parameters of the node."""

    bag: str = setting("", "bag to play: a folder or an .mcap file")
    rate: float = setting(
        1.0, "seconds of the bag per second; 0: as fast as possible", "1", (0.0, 1e6)
    )
    loop: bool = setting(False, "start again at the end")
    start_paused: bool = setting(False, "start paused")
    start_offset: float = setting(0.0, "where in the bag to start", "s", _ANY_LENGTH)
    duration: float = setting(0.0, "how much of the bag to play; 0: all", "s", _ANY_LENGTH)
    clock: float = setting(
        40.0,
        "ticks of /clock per second of the bag; 0: none, and a recorded /clock is played",
        "Hz",
        (0.0, 1000.0),
    )
    expect_timeout: float = setting(
        30.0, "how long to wait for the expected subscriptions; 0: forever", "s", _ANY_LENGTH
    )
    stay: bool = setting(False, "keep running at the end, for ~/seek")
    topics: tuple[str, ...] = texts("topics to play; * matches any text; empty: all")
    exclude: tuple[str, ...] = texts("topics not to play; * matches any text")
    remap: tuple[str, ...] = texts("new names for topics: /from:=/to")
    expect: tuple[str, ...] = texts(
        "topics that must have a subscription before the first message; name a topic twice to "
        "require two"
    )


class BagPlayer(Participant):
    """ROS side of a playback. See the module docstring."""

    settings: Settings
    _begun = False  # all expected subscriptions have been matched

    @property
    def real_time(self) -> bool:
        """Return False: the player waits for its readers at every rate."""
        return False

    def __init__(self) -> None:
        fixed = settings_of(Settings).keys() - {"rate"}
        super().__init__("bag_player", settings=Settings, fixed=fixed)
        settings = self.settings
        if not settings.bag:
            raise ValueError("bag: is empty; give the folder of the bag to play")
        self._converters: dict[str, Callable[[bytes], bytes]] = {}  # of older messages, by topic
        try:
            self._bag = BagReader(settings.bag)
            self._types = self._playable(
                choose_topics(self._bag, settings.topics, settings.exclude)
            )
            self._playback = Playback(
                self._bag,
                self._types,
                start_offset=settings.start_offset,
                duration=settings.duration or math.inf,
                rate=self._rate,
                loop=settings.loop,
                paused=settings.start_paused,
                clock_period=1 / settings.clock if settings.clock else 0.0,
            )
        except NothingToPlayError:
            raise  # no parameter is wrong
        except BagError as error:
            raise ValueError(str(error)) from None
        self._offer_topics()
        self.note_state(DiagnosticStatus.OK, "playing")
        self._check_at = time.monotonic()  # when to check the matching next
        self._give_up_at = time.monotonic() + (settings.expect_timeout or math.inf)
        self._lateness = Lateness()  # of messages, from due to published
        playback = self._playback
        self._serve("pause", srv.Pause, lambda _, now: playback.pause(now))
        self._serve("resume", srv.Resume, lambda _, now: playback.resume(now))
        self._serve("toggle_paused", srv.TogglePaused, self._toggle_paused)
        self._serve("is_paused", srv.IsPaused, lambda *_: {"paused": playback.paused})
        self._serve("get_rate", srv.GetRate, lambda *_: {"rate": self._rate})
        self._serve("set_rate", srv.SetRate, self._set_rate)
        self._serve("seek", srv.Seek, lambda to, now: playback.seek(nanoseconds_of(to.time), now))
        self._serve("play_next", srv.PlayNext, self._play_next)

    def why_fixed(self, name: str) -> str:
        """Return an empty string: the rate may change at any time."""
        del name
        return ""

    def take_parameters(self, changes: dict[str, Any]) -> None:
        """Apply a change of the rate, effective from now on."""
        super().take_parameters(changes)
        if self._begun:
            self._playback.set_rate(self._rate, time.monotonic_ns())

    @property
    def _rate(self) -> float:
        return self.settings.rate or FASTEST

    # The start

    def _playable(self, names: list[str]) -> dict[str, Any]:
        """Return the types of the topics that the installed message types can represent."""
        types = {}
        for name in names:
            topic = self._bag.topics[name]
            if self.settings.clock and name == topics.CLOCK.name:
                continue
            try:
                installed = find_definition(topic.type)
                types[name] = message_class(topic.type)
            except (DefinitionMissingError, ImportError, AttributeError) as error:
                self.get_logger().error(f"{name} is not played: {error}")
                continue
            if topic.type_hash and topic.type_hash != installed.type_hash:
                if converter := converter_of(topic):
                    self._converters[name] = converter
                    continue
                self.get_logger().error(
                    f"{name} is not played: the installed {topic.type} differs from the recorded"
                )
                del types[name]
        return types

    def _offer_topics(self) -> None:
        """Create the publishers; raises ValueError if a topic named by the user is not played."""
        names = dict(_split_remap(remap) for remap in self.settings.remap)
        if unknown := sorted(names.keys() - self._bag.topics.keys()):
            raise ValueError(f"remap: no topic {unknown[0]} in the bag")
        offers = {name: _offer(self._bag.topics[name]) for name in self._types}
        self._players = {
            name: self.offer(
                topics.Topic(names.get(name, name), self._types[name], offer),
                counted=offer.reliability != ReliabilityPolicy.BEST_EFFORT,  # may lose messages
            )
            for name, offer in offers.items()
        }
        # A writer that keeps all waits by itself; one that keeps the last would overwrite.
        self._forgetful = {n for n, o in offers.items() if o.history == HistoryPolicy.KEEP_LAST}
        if self.settings.clock:
            self.offer(topics.CLOCK)
        self._by_name = {player.topic_name: player for player in self._players.values()}
        if missing := sorted(set(self.settings.expect) - self._by_name.keys()):
            raise ValueError(f"expect: {missing[0]} is not played")

    def not_ready(self) -> str:
        """Return what the node waits for before the first message."""
        missing = [
            name
            for name in sorted(set(self.settings.expect))
            if self._by_name[name].matched < self.settings.expect.count(name)
        ]
        return f"subscriptions of {', '.join(missing)}" if missing else super().not_ready()

    def _begin_if_matched(self) -> None:
        """Start once all expected subscriptions are matched; give up after a timeout."""
        self._check_at = time.monotonic() + MATCHING_PERIOD
        waiting = self.not_ready()
        if not waiting:
            self._begun, now = True, time.monotonic_ns()
            self._playback.begin(now)
            self._playback.set_rate(self._rate, now)
        elif time.monotonic() > self._give_up_at:
            timeout = f"{self.settings.expect_timeout:g} s"
            self.failure = f"no {waiting} within {timeout}; nothing was played"

    # Pacing

    def next_deadline(self) -> float | None:
        """Return when the next message is due, on steady time [s]."""
        if not self._begun:
            return self._check_at
        due = self._playback.due()
        return None if due is None else due / NANOSECONDS_PER_SECOND

    def on_deadline(self) -> None:
        """Publish what is due by now, in order."""
        if not self._begun:
            self._begin_if_matched()
            return
        playback = self._playback
        try:
            for _ in range(BURST_LENGTH):
                due, now = playback.due(), time.monotonic_ns()
                if due is None or (moment := playback.take(now)) is None:
                    break
                if playback.rate != FASTEST:
                    self._lateness.add((now - due) / NANOSECONDS_PER_SECOND)
                self._send(moment)
        except BagError as error:
            self.failure = str(error)
        self._end_if_played()

    def _send(self, moment: Moment) -> None:
        """Publish a message or a tick; wait if a reader does not keep up."""
        if moment.message is None:
            if self.settings.clock:
                self.publish(topics.CLOCK, clock_message(moment.instant))
            return
        player = self._players[moment.message.topic]
        convert = self._converters.get(moment.message.topic)
        data = moment.message.data
        player.publish(data if convert is None else convert(data))
        if moment.message.topic in self._forgetful and player.count % (KEPT // 2) == 0:
            player.wait_for_readers()

    def _end_if_played(self) -> None:
        """End the node once everything has been played and received, unless ``stay`` is set."""
        if not self._playback.ended or self.settings.stay or self.finished:
            return
        self.publish_counts(0, self._bag.end)
        give_up = time.monotonic() + FAREWELL
        for player in self._players.values():
            if not player.wait_for_readers(give_up - time.monotonic()):
                self.failure = (
                    f"a reader of {player.topic_name} did not receive its last messages within "
                    f"{FAREWELL:g} s"
                )
        self.finished = True

    def on_stop(self) -> None:
        """Log how much was played, and how late."""
        self._playback.stop()
        self._bag.close()
        count = sum(player.count for player in self._players.values())
        pace, late = "", self._lateness
        if late.count:
            median, worst = 1e3 * late.quantile(0.5), 1e3 * late.worst
            pace = f"; late by {median:.2f} ms (median), {worst:.2f} ms at worst"
        self.get_logger().info(f"{count} messages played{pace}")

    # Services

    def _serve(self, name: str, kind: Any, act: Callable[[Any, int], Any]) -> None:
        """
        Offer a service.

        ``act`` takes a request and the steady time [ns], returns response fields or None, and
        raises BagError to refuse the request.
        """

        def serve(request: Any, response: Any) -> Any:
            try:
                values = act(request, time.monotonic_ns()) or {}
            except BagError as error:
                # The response has no field for the reason.
                self.get_logger().error(f"{name}: {error}")
                return response
            if hasattr(response, "success"):
                response.success = True
            for field, value in values.items():
                setattr(response, field, value)
            return response

        self.create_service(kind, f"~/{name}", serve)

    def _toggle_paused(self, _: Any, now: int) -> None:
        toggle = self._playback.resume if self._playback.paused else self._playback.pause
        toggle(now)

    def _set_rate(self, request: Any, _: int) -> None:
        """Change the parameter ``rate``, which takes effect immediately."""
        if not request.rate > 0:
            raise BagError(f"{request.rate:g}; allowed: above 0")
        rate = 0.0 if math.isinf(request.rate) else request.rate
        (result,) = self.set_parameters([Parameter("rate", value=rate)])
        if not result.successful:
            raise BagError(result.reason)

    def _play_next(self, *_: Any) -> None:
        """Publish the next message and the ticks before it."""
        try:
            while self._begun and (moment := self._playback.take_next()):
                self._send(moment)
                if moment.message is not None:
                    self._end_if_played()
                    return
        except UnreadableBagError as error:
            self.failure = str(error)
            raise
        raise BagError("playback is not paused, or nothing is left to play")


def clock_message(instant: int) -> bytes:
    """Return a serialized /clock message."""
    sec, nanosec = divmod(instant, NANOSECONDS_PER_SECOND)
    return _CDR_LITTLE_ENDIAN + struct.pack("<iI", sec, nanosec)


def _split_remap(remap: str) -> tuple[str, str]:
    old, separator, new = remap.partition(":=")
    if not (old and separator and new):
        raise ValueError(f"remap: {remap!r}; allowed: /from:=/to")
    return old, new


def _offer(topic: TopicInfo) -> QoSProfile:
    """
    Return the quality of service to publish with: the strongest that a publisher offered.

    Reliable and transient-local offers match every reader. Discovery does not report how much a
    publisher keeps, so the player keeps all: it waits for a reader rather than overwrite.
    """
    lasting = any(qos.durability == "transient_local" for qos in topic.qos_profiles)
    best_effort = topic.qos_profiles and all(
        qos.reliability == "best_effort" for qos in topic.qos_profiles
    )
    kept = KEPT if lasting or best_effort else None
    return topics.quality(kept, reliable=not best_effort, lasting=lasting)


main = BagPlayer.main
