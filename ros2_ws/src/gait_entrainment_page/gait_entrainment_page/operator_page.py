# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
operator_page: the page of a live run or a replay, as a node that only looks on.

No node waits for it. Messages stay in subscriptions without an executor until they are taken, a
few times a second; samples are subscribed to only up to four times real time. If it is the
operator's heartbeat, it publishes a sign of life as long as the page is watched.
"""

import contextlib
import importlib
import os
import queue
import threading
import time
from collections.abc import Callable
from concurrent import futures
from dataclasses import dataclass
from typing import Any

from rclpy.serialization import deserialize_message
from std_msgs.msg import String
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.errors import UsageError
from gait_entrainment.settings import setting, settings_of
from gait_entrainment_msgs.msg import Note
from gait_entrainment_msgs.srv import AskSession
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.nodes.loop import run_node
from gait_entrainment_nodes.nodes.parameters import texts
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.rclpy_internals import RawReader
from gait_entrainment_page.access import Access, Seat, listen
from gait_entrainment_page.actions import ActionError, Command
from gait_entrainment_page.view import View

# Periods of taking messages, and of publishing the heartbeat if there is one [s]; idle while
# samples are skipped.
PERIOD, IDLE_PERIOD = 0.05, 0.25
MOST_AT_ONCE = 1000
# How long a node may take to answer [s].
ANSWER_TIMEOUT = 3.0
# Above this pace, relative to the wall clock, samples are skipped: nobody could follow them.
FASTEST = 4.0
# While it loads, which takes seconds: a third of the share of a node that walks or records.
_NICENESS = 5
# Times of a run that differ more from the wall clock are simulated or recorded [ns].
_ANOTHER_TIME = 60 * NANOSECONDS_PER_SECOND

LOOKED_AT = (
    topics.EXPERIMENT_STATE,
    topics.STRIDES,
    topics.PULSE_PHASES,
    topics.ENTRAINMENT,
    topics.GAIT_EVENTS,
    topics.ROBOT_SETUP,
    topics.TROUBLE,
    topics.OPERATOR_NOTES,
    topics.DIAGNOSTICS,
)
SAMPLED = (
    (topics.ROBOT_STATE, topics.LOOKING_ON),
    # Only the latest posture is drawn.
    (topics.JOINT_STATES, topics.quality(1, reliable=False)),
)
SERVICES: dict[str, tuple[Any, str]] = {
    "stop": (Trigger, "perturbator/stop"),
    "arm": (Trigger, "perturbator/arm"),
    "pause": (AskSession, "session/pause"),
    "go_on": (AskSession, "session/go_on"),
    "repeat": (AskSession, "session/repeat"),
}


@dataclass(frozen=True)
class Settings:
    """Parameters of the node."""

    host: str = setting("127.0.0.1", "address to serve the page at; any other requires a token")
    port: int = setting(8080, "port of the page; 0: a free one", "1", (0, 65535))
    heartbeat: bool = setting(False, "the page is the operator's sign of life")
    heartbeat_timeout: float = setting(
        1.0, "longest silence of the operator's browser", "s", (0.2, 10.0)
    )
    blinded: bool = setting(False, "hide everything that would reveal the condition")
    foxglove: int = setting(
        0, "port of a Foxglove connection to the same data; 0: none", "1", (0, 65535)
    )
    record: str = setting("", "folder of the record, whose free disk space is shown")
    command: tuple[str, ...] = texts("entrain run or session command that the page may start")

    def __post_init__(self) -> None:
        if self.blinded and self.foxglove:
            raise UsageError("foxglove: offers what a blinded page hides; allowed: 0")


class OperatorPage(Participant):
    """ROS side of the page."""

    settings: Settings
    # It waits for no node, and must not run before the others.
    real_time = False

    def __init__(self) -> None:
        super().__init__("operator_page", settings=Settings, fixed=settings_of(Settings))
        settings = self.settings
        self.view = View(blinded=settings.blinded, clock=time.monotonic)
        access = Access.of_environment(settings.host)
        listener = listen(settings.host, settings.port)
        self._foxglove: Any = None
        if settings.foxglove:
            # Not at the top: it is optional.
            from gait_entrainment_page.foxglove_server import FoxgloveServer

            self._foxglove = FoxgloveServer(settings.host, settings.foxglove)
        self.offer(topics.OPERATOR_NOTES)
        if settings.heartbeat:
            self.offer(topics.OPERATOR_HEARTBEAT)
        self._service_clients = {n: self.create_client(k, s) for n, (k, s) in SERVICES.items()}
        self._requests: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._readers: dict[str, tuple[topics.Topic, RawReader]] = {}
        for topic in LOOKED_AT:
            # A writer of the latest state overwrites it: a hanging reader does not block it.
            lasting = topic.qos is topics.LATEST_STATE
            self._look_at(topic, topic.qos if lasting else topics.LOOKING_ON)
        self._follow(not self.get_parameter("use_sim_time").value)
        self._seen = (0, 0)  # when the pace was measured: run's time, wall time [ns]
        self._due = time.monotonic()
        # Not at the top: it takes seconds to load, see main.
        from gait_entrainment_page.layout import Page

        self.page = Page(
            lambda: self.view,
            Seat(settings.heartbeat_timeout),
            access,
            listener,
            nodes=self,
            command=Command(settings.command, heartbeat=settings.heartbeat),
            heartbeat=settings.heartbeat,
            record=settings.record,
        )

    # Looking

    def _look_at(self, topic: topics.Topic, qos: Any) -> None:
        self._readers[topic.name] = topic, RawReader(self, topic.type, topic.name, qos)

    def _follow(self, wanted: bool) -> None:
        """Subscribe to the samples or not; without them the walker does not wait for this node."""
        policy = os.SCHED_OTHER if wanted else os.SCHED_BATCH
        for thread in map(int, os.listdir("/proc/self/task")):
            with contextlib.suppress(ProcessLookupError):
                os.sched_setscheduler(thread, policy, os.sched_param(0))
        for topic, qos in SAMPLED:
            if wanted and topic.name not in self._readers:
                self._look_at(topic, qos)
            elif not wanted and topic.name in self._readers:
                self._readers.pop(topic.name)[1].destroy()

    def next_deadline(self) -> float:
        """Return when to take messages."""
        return self._due

    def on_deadline(self) -> None:
        """Take messages, carry out requests, and publish the heartbeat of a watched page."""
        following = topics.JOINT_STATES.name in self._readers
        self._due = time.monotonic() + (PERIOD if following else IDLE_PERIOD)
        if self.settings.heartbeat and self.page.seat.watched:
            self.publish(topics.OPERATOR_HEARTBEAT, String(data=self.get_name()))
        while not self._requests.empty():
            self._requests.get()()
        taken = [
            (received, topic, data)
            for topic, reader in self._readers.values()
            for received, data in reader.take(MOST_AT_ONCE)
        ]
        taken.sort(key=lambda message: message[0])
        with self.view.lock:
            for received, topic, data in taken:
                self._take(received, topic, data)

    def _take(self, received: int, topic: topics.Topic, data: bytes) -> None:
        message = deserialize_message(data, topic.type)
        if self._foxglove is not None:
            self._foxglove.send(topic, data, received)
        if topic is topics.DIAGNOSTICS:
            self.view.take_diagnostics(message)
            return
        self.view.take(topic.name, message)
        if topic is topics.GAIT_EVENTS:
            walked, passed = self.view.now - self._seen[0], received - self._seen[1]
            if not 0 <= walked < _ANOTHER_TIME:
                self._seen = (self.view.now, received)
            elif walked > NANOSECONDS_PER_SECOND // 2:
                self._seen = (self.view.now, received)
                self._follow(walked < FASTEST * passed)

    # Acting, from the threads of the web server

    def offered(self) -> set[str]:
        """Return the names of the SERVICES that are available."""
        return {n for n, client in self._service_clients.items() if client.service_is_ready()}

    def note(self, text: str) -> str:
        """Publish a note, stamped with the run's own time if that is not the wall clock's."""

        def publish() -> None:
            now = time.time_ns()
            simulated = self.view.going_on and abs(now - self.view.now) > _ANOTHER_TIME
            stamp = self.view.now if simulated else now
            self.publish(topics.OPERATOR_NOTES, Note(header=header(stamp), text=text))

        self._requests.put(publish)
        return "noted"

    def ask(self, what: str, reason: str = "") -> str:
        """Call one of SERVICES; ActionError if it refuses or does not answer."""
        kind, service = SERVICES[what]
        request = kind.Request(reason=reason) if kind is AskSession else kind.Request()
        answered = futures.Future[Any]()

        def call() -> None:
            sent = self._service_clients[what].call_async(request)
            sent.add_done_callback(lambda done: answered.set_result(done.result()))

        self._requests.put(call)
        try:
            answer = answered.result(ANSWER_TIMEOUT)
        except futures.TimeoutError:
            raise ActionError(f"{service} does not answer") from None
        if not answer.success:
            raise ActionError(answer.message or f"{service} refused")
        return str(answer.message)

    def on_stop(self) -> None:
        """Close the page."""
        self.page.close()


def _load() -> None:
    """Load the web server, at a low priority so that busy nodes go first."""
    os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)  # of this thread alone
    importlib.import_module("gait_entrainment_page.layout")


def main() -> int:
    """Run the node."""
    loading = threading.Thread(target=_load)
    loading.start()
    loading.join()
    return run_node(OperatorPage)
