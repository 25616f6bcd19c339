# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What all nodes of an experiment share: parameters, counted topics, readiness, diagnostics."""

import functools
import time
import traceback
from collections.abc import Callable, Collection, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile

from gait_entrainment.errors import EntrainmentError
from gait_entrainment.settings import SettingError
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.environment import PRIORITY
from gait_entrainment_nodes.messaging.publisher import CountedPublisher, StopRequestedError
from gait_entrainment_nodes.messaging.stamps import header, to_time
from gait_entrainment_nodes.messaging.topics import DIAGNOSTICS, PUBLISHED_COUNTS, Topic
from gait_entrainment_nodes.nodes.loop import run_node
from gait_entrainment_nodes.nodes.parameters import (
    answer_help,
    chosen_quality,
    declare_settings,
    of_rclpy,
    read_settings,
    warn_of_unknown_parameters,
    warn_of_unused_quality,
)

# How often a node publishes its state on /diagnostics [s]; rqt calls it stale after 5 s.
STATE_PERIOD = 1.0
# How long a node's last messages, such as a stop, have to arrive when it ends [s].
LAST_WORDS = 0.5


class Participant(Node):
    """
    A node that takes part in a run.

    ``settings`` maps each attribute that holds parameter values to a settings dataclass, or to a
    pair of that and the prefix of its parameters. Parameters named in ``fixed`` are read-only.
    Raises EntrainmentError if a value is not allowed, or if the values are inconsistent.
    """

    get_logger: Callable[[], RcutilsLogger]  # rclpy does not type it
    priority = PRIORITY  # in real time, if the system permits it
    stopping = False  # set from outside to end the node
    failure: str | None = None  # why the node must end with exit code 1
    finished = False  # set to end the loop with exit code 0
    run: Any = None  # the current run, with its ``number``; None between runs

    def __init__(self, node_name: str, *, fixed: Collection[str] = (), **settings: Any) -> None:
        self._own = f"{node_name}/"  # how the names of its own topics begin in the table
        super().__init__(node_name)
        groups = {n: s if isinstance(s, tuple) else (s, "") for n, s in settings.items()}
        answer_help(self, groups.values())
        for group, prefix in groups.values():
            declare_settings(self, group, prefix, fixed)
        warn_of_unknown_parameters(self)
        self._settings = groups
        self.take_parameters({})
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self._offered: list[CountedPublisher] = []
        self._publisher_of: dict[str, CountedPublisher] = {}  # by name in the table of topics
        self.offer(DIAGNOSTICS)
        self._state_due = 0.0  # when to publish the state, steady time [s]
        self.note_state(DiagnosticStatus.OK, "ready")
        # Not counted itself: its message reports the counts of the others.
        self.offer(PUBLISHED_COUNTS, counted=False)

    @property
    def real_time(self) -> bool:
        """Whether this node never waits, neither for a reader nor for its turn."""
        return not self.get_parameter("use_sim_time").value

    # Parameters

    def why_fixed(self, name: str) -> str:
        """Return why a parameter that is not read-only cannot change now, or an empty string."""
        del name
        running = self.run is not None
        return f"run {self.run.number} is in progress; change it between runs" if running else ""

    def take_parameters(self, changes: dict[str, Any]) -> None:
        """Apply the values of all parameters, or none if they are inconsistent."""

        def value(name: str) -> Any:
            return changes[name] if name in changes else self.get_parameter(name).value

        read = {name: read_settings(value, *group) for name, group in self._settings.items()}
        vars(self).update(read)

    def set_parameters_atomically(self, parameter_list: list[Any]) -> SetParametersResult:
        """Set the values that change; repeating a current value is allowed, even if read-only."""
        changes = []
        for parameter in parameter_list:
            name = parameter.name
            if not self.has_parameter(name):
                reason = f"{name}: unknown parameter; ros2 param list names those that exist"
                return SetParametersResult(successful=False, reason=reason)
            present = self.get_parameter(name)
            if (present.type_, parameter.type_) == (Parameter.Type.DOUBLE, Parameter.Type.INTEGER):
                # An integer is accepted for a float, as when the node starts.
                parameter = Parameter(name, value=float(parameter.value))
            if present.get_parameter_value() != parameter.get_parameter_value():
                changes.append(parameter)
        if parameter_list and not changes:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(changes)

    def _on_set_parameters(self, changes: Sequence[Any]) -> SetParametersResult:
        """Apply a change or refuse it with a reason; types and ranges have been checked."""
        values = {change.name: change.value for change in changes}
        try:
            for name, value in values.items():
                reason = "" if of_rclpy(name) else self.why_fixed(name)
                if name == "use_sim_time":
                    reason = "the clock is chosen when the node starts"
                if reason:
                    raise SettingError(f"{name}: {value!r} is refused: {reason}")
            self.take_parameters(values)
        except EntrainmentError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    # Topics

    def name_of(self, topic: Topic) -> str:
        """Return this node's name of a topic; topics under the node's name follow that name."""
        own = topic.name.startswith(self._own)
        return f"~/{topic.name.removeprefix(self._own)}" if own else topic.name

    def quality_of(self, name: str, end: str, qos: QoSProfile) -> dict[str, Any]:
        """Return the arguments for the quality of one end of a topic; see `chosen_quality`."""
        return chosen_quality(self, name, end, qos)

    def offer(self, topic: Topic, *, counted: bool = True) -> CountedPublisher:
        """Create a publisher for ``publish``; the count of a ``counted`` one is reported."""
        publisher = CountedPublisher(self, topic, counted=counted)
        self._publisher_of.setdefault(topic.name, publisher)
        self._offered.append(publisher)
        return publisher

    def publish(self, topic: Topic, message: Any) -> None:
        """Publish a message, or its bytes, on a topic that was offered."""
        self._publisher_of[topic.name].publish(message)

    def subscribe(
        self, topic: Topic, callback: Callable[[Any], None], *, raw: bool = False
    ) -> None:
        """Create a subscription with its topic's quality of service, to bytes if ``raw``."""
        name = self.name_of(topic)
        qos = self.quality_of(name, "subscription", topic.qos)
        self.create_subscription(topic.type, name, callback, raw=raw, **qos)

    def client(self, service_type: Any, name: str) -> Any:
        """Create a client of another node's service, whose name starts with that node's."""
        return self.create_client(service_type, name)

    def subscribe_to_run(self, topic: Topic, callback: Callable[[Any, Any], None]) -> None:
        """Subscribe; call ``callback`` with the run and each message of the current run."""

        def take(message: Any) -> None:
            if (run := self.run_of(message)) is not None:
                callback(run, message)

        self.subscribe(topic, take)

    def run_of(self, message: Any) -> Any:
        """Return the run that a message belongs to, or None if that is not the current one."""
        return self.run if self.run is not None and message.run == self.run.number else None

    def rivals(self, topic: Topic) -> str:
        """Return which nodes publish a topic if there are several, else an empty string."""
        name = self.name_of(topic)
        if self.count_publishers(name) < 2:
            return ""
        names = sorted(info.node_name for info in self.get_publishers_info_by_topic(name))
        return f"{topic.name} is published by {' and '.join(names)}; a run needs one publisher"

    def publish_counts(self, run: int, stamp: int) -> None:
        """Report how many messages were published, for the recorder, at the end of a run."""
        counted = [publisher for publisher in self._offered if publisher.counted]
        message = PublishedCounts(header=header(stamp), run=run)
        message.node = self.get_fully_qualified_name()
        message.topics = [publisher.topic_name for publisher in counted]
        message.counts = [publisher.count for publisher in counted]
        self.publish(PUBLISHED_COUNTS, message)

    # Readiness

    def offer_ready(self) -> None:
        """
        Offer ``~/ready``, after all other publishers, subscriptions and services of the node.

        Discovery announces the endpoints of a node in the order of their creation, so a client
        that sees this service knows all of the node's subscriptions.
        """
        warn_of_unused_quality(self)
        self.create_service(Ready, "~/ready", self._on_ready)

    @property
    def matched(self) -> dict[str, int]:
        """Number of matched subscriptions, by the name of each topic that the node offers."""
        return {publisher.topic_name: publisher.matched for publisher in self._offered}

    def not_ready(self) -> str:
        """
        Return what this node waits for before a run, or an empty string.

        It is ready once every known subscription of its topics is matched, so that the first
        message is not lost.
        """
        waiting = [p.topic_name for p in self._offered if p.unmatched]
        return f"subscriptions of {', '.join(waiting)}" if waiting else ""

    def _on_ready(self, _: Ready.Request, response: Ready.Response) -> Ready.Response:
        response.waiting_for = self.not_ready()
        response.ready = not response.waiting_for
        # The host's time, whatever clock the node follows: the experiment compares it to its own.
        response.now = to_time(time.time_ns())
        response.topics, response.matched = list(self.matched), list(self.matched.values())
        return response

    # Diagnostics

    @property
    def hardware_id(self) -> str:
        """The hardware that the diagnostics are about."""
        return "none"

    def diagnose(self, stamp: int, level: bytes, message: str, **values: object) -> None:
        """Publish what happened in a run; it is this node's state until another is noted."""
        self.note_state(level, message, **values)
        self._publish_status("run", stamp)

    def note_state(self, level: bytes, message: str, **values: object) -> None:
        """Set this node's state, for ``publish_state``."""
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        self._status = DiagnosticStatus(level=level, message=message, values=pairs)

    def publish_state(self) -> None:
        """Publish the state if it is due, which also shows that this node is alive."""
        if time.monotonic() >= self._state_due:
            self._state_due = time.monotonic() + STATE_PERIOD
            self._publish_status("state", self.get_clock().now().nanoseconds)
            # Published from the start: a recorder that starts later must not count it as lost.
            self._publisher_of[DIAGNOSTICS.name].count -= 1

    def _publish_status(self, what: str, stamp: int) -> None:
        status = self._status
        status.name = f"{self.get_fully_qualified_name().lstrip('/')}: {what}"
        status.hardware_id = self.hardware_id
        self.publish(DIAGNOSTICS, DiagnosticArray(header=header(stamp), status=[status]))

    # The loop and its end

    @classmethod
    def main(cls) -> int:
        """Run this node as the process; return the exit code, see `run_node`."""
        return run_node(cls)

    def next_deadline(self) -> float | None:
        """Return the steady time [s] at which ``on_deadline`` is due; None for never."""
        return None

    def on_deadline(self) -> None:
        """Do everything that is due, even if the node wakes up late."""

    def on_stop(self) -> None:
        """Bring things to a safe end: torque to zero, files closed."""

    def end(self) -> None:
        """End the node's work, for whatever reason, and let its last messages arrive."""
        self.stopping = True
        try:
            self.on_stop()
        except Exception as error:
            self.fail_with(error)
        deadline = time.monotonic() + LAST_WORDS
        for publisher in self._offered:
            publisher.wait_until_received(max(deadline - time.monotonic(), 0.0))

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """
        Wrap a callback of an action server or a future so that it may raise exceptions.

        The EventsExecutor propagates exceptions of subscriptions, services and timers, but an
        exception in a task crashes the process. The wrapper ends the node cleanly instead.
        """

        @functools.wraps(callback)
        def call(*arguments: Any) -> Any:
            try:
                return callback(*arguments)
            except Exception as error:
                self.fail_with(error)
                return None

        return call

    def fail_with(self, error: Exception) -> None:
        """End the node because of an unexpected exception, or because a stop was requested."""
        if isinstance(error, StopRequestedError):
            return
        traceback.print_exception(error)
        self.failure = f"{type(error).__name__}: {error}"
