# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What all nodes share: one loop, a clean stop, counted publishers, declared parameters.

The loop is a series of ``spin_once`` of the EventsExecutor: it receives ten times as much as the
default executor, and between two calls the node meets its own deadlines on steady time.
"""

import functools
import json
import math
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.duration import Duration
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterException,
)
from rclpy.experimental import EventsExecutor
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.settings import settings_of
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.messaging.topics import DIAGNOSTICS, PUBLISHED_COUNTS, Topic

SIDES = ("left", "right")
# The longest time [s] that the loop sleeps in the executor, so that a signal is soon obeyed.
LONGEST_SLEEP = 0.1
# How often a node's state goes to /diagnostics [s]; after 5 s of silence rqt calls it stale.
STATE_PERIOD = 1.0
# How often a full writer is tried again [s], while its slowest reader catches up.
RETRY_PERIOD = 0.002
# A writer that waits for a reader says so in the log after so long, and again [s].
LAG_REPORT_PERIOD = 1.0
# At the end of a node its last messages, a stop among them, have so long to arrive [s].
LAST_WORDS = 0.5


class StopRequestedError(Exception):
    """The node must end while a publisher waits for a reader that lags."""


class CountedPublisher:
    """A publisher that counts, and that waits for a slow reader instead of losing a message."""

    def __init__(self, node: "Participant", topic: Topic) -> None:
        self._node = node
        self._publisher = node.create_publisher(topic.type, topic.name, topic.qos)
        self.count = 0

    @property
    def topic_name(self) -> str:
        """Fully qualified name of the topic."""
        return str(self._publisher.topic_name)

    @property
    def matched(self) -> int:
        """Number of subscriptions that what is published from now on will reach."""
        return int(self._publisher.get_subscription_count())

    @property
    def unmatched(self) -> int:
        """Number of subscriptions known to exist that have not been matched yet."""
        return max(self._node.count_subscribers(self.topic_name) - self.matched, 0)

    def publish(self, message: Any) -> None:
        """
        Publish a message, or its serialized bytes; wait while the history is full.

        Raises
        ------
        StopRequestedError
            where the node is to end meanwhile.

        """
        data = message if isinstance(message, bytes) else serialize(message)
        report_at = time.monotonic() + LAG_REPORT_PERIOD
        while True:
            try:
                self._publisher.publish(data)
            except rclpy._rclpy_pybind11.RCLError:
                if self._node.stopping or not rclpy.ok():
                    raise StopRequestedError from None
                if time.monotonic() > report_at:
                    report_at += LAG_REPORT_PERIOD
                    self._report_lag()
                time.sleep(RETRY_PERIOD)
            else:
                self.count += 1
                return

    def wait_until_received(self, timeout: float) -> bool:
        """Wait until every reader has received what was published; False after a time [s]."""
        return bool(self._publisher.wait_for_all_acked(Duration(seconds=timeout)))

    def wait_for_readers(self, patience: float = math.inf) -> bool:
        """
        Wait until every reader has received what was published; False after a time [s].

        Raises
        ------
        StopRequestedError
            where the node is to end meanwhile.

        """
        give_up = time.monotonic() + patience
        report_at = time.monotonic() + LAG_REPORT_PERIOD
        while not self.wait_until_received(LONGEST_SLEEP):
            if self._node.stopping:
                raise StopRequestedError
            if time.monotonic() > give_up:
                return False
            if time.monotonic() > report_at:
                report_at += LAG_REPORT_PERIOD
                self._report_lag()
        return True

    def _report_lag(self) -> None:
        readers = self._node.get_subscriptions_info_by_topic(self.topic_name)
        names = ", ".join(sorted({reader.node_name for reader in readers}))
        self._node.get_logger().warning(
            f"{self.topic_name} waits: one of its readers does not keep up ({names})"
        )


class Participant:
    """
    Mixin for a node that takes part in a run.

    Offers ``~/ready`` (std_srvs/Trigger): true once every subscription that is known to exist on
    its topics has been matched, so that the first message that must arrive will arrive. As
    discovery may have told others of more subscriptions, the message then says how many have been
    matched on each topic, as a JSON object.
    """

    get_logger: Callable[[], RcutilsLogger]
    hardware_id = "none"  # of the hardware that diagnostics speak of
    stopping = False  # set from outside: the node is to end

    def begin_participation(self) -> None:
        """Set up what every participant has: behind its parameters, before its publishers."""
        refuse_unknown_parameters(self)
        self.take_parameters(self.parameter)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.failure: str | None = None  # why the node must end with exit code 1
        self.finished = False  # set to end the loop with exit code 0
        self._offered: list[CountedPublisher] = []
        self._publishers_counted: list[CountedPublisher] = []
        self._diagnostics = self.publisher(DIAGNOSTICS)
        self.note_state(DiagnosticStatus.OK, "ready")
        self._state_due = 0.0  # steady time [s]
        # Not counted itself: its message says what the others published.
        self._counts = self.publisher(PUBLISHED_COUNTS, recorded=False)

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter(name).value

    def why_fixed(self, name: str) -> str:
        """Return why a parameter that is not read-only cannot change now, or an empty text."""
        del name
        return ""

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """
        Take the values of all parameters that may change, at the start and at each change.

        Raises
        ------
        ValueError
            where they cannot be; nothing has been taken then.

        """

    def _on_set_parameters(self, changes: Sequence[Any]) -> SetParametersResult:
        """Take a change, or refuse it with the reason; types and ranges have been checked."""
        values = {change.name: change.value for change in changes}
        try:
            for name, value in values.items():
                reason = self.why_fixed(name)
                if name == "use_sim_time":
                    reason = "which clock counts is decided when the node starts"
                if reason:
                    raise ValueError(f"{name}: {value!r} is refused: {reason}")
            self.take_parameters(lambda n: values[n] if n in values else self.parameter(n))
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def offer_ready(self) -> None:
        """
        Offer ``~/ready``, behind everything else that the node offers and listens to.

        Discovery tells of one node's endpoints in the order in which they were made: who sees
        this service knows all of the node's subscriptions.
        """
        self.create_service(Trigger, "~/ready", self._on_ready)

    def publisher(self, topic: Topic, *, recorded: bool = True) -> CountedPublisher:
        """Create a publisher; what it has sent is told to the recorder, if that records it."""
        publisher = CountedPublisher(self, topic)
        self._offered.append(publisher)
        if recorded:
            self._publishers_counted.append(publisher)
        return publisher

    def subscription(self, topic: Topic, callback: Callable[[Any], None], **options: Any) -> Any:
        """Create a subscription with the quality of service of its topic."""
        return self.create_subscription(topic.type, topic.name, callback, topic.qos, **options)

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """
        Return the callback of an action server or of a future, made safe to raise exceptions.

        The EventsExecutor hands on what a subscription, a service or a timer raises, but an
        exception in a task crashes the process. Here it ends the node in order instead.
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
        """End the node because of an exception that nobody foresaw, or of a requested stop."""
        if isinstance(error, StopRequestedError):
            return
        traceback.print_exception(error)
        self.failure = f"{type(error).__name__}: {error}"

    def not_ready(self) -> str:
        """Return what this node still waits for before a run, or an empty text."""
        waiting = [p.topic_name for p in self._offered if p.unmatched]
        return f"subscriptions of {', '.join(waiting)}" if waiting else ""

    def _on_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        waiting = self.not_ready()
        matched = {p.topic_name: p.matched for p in self._offered}
        response.success, response.message = not waiting, waiting or json.dumps(matched)
        return response

    def publish_counts(self, run: int, stamp: int) -> None:
        """Tell the recorder, at the end of a run, how many messages were published."""
        self._counts.publish(
            PublishedCounts(
                header=header(stamp),
                run=run,
                node=self.get_fully_qualified_name(),
                topics=[p.topic_name for p in self._publishers_counted],
                counts=[p.count for p in self._publishers_counted],
            )
        )

    def diagnose(self, stamp: int, level: bytes, message: str, **values: object) -> None:
        """Publish what has happened in a run; it is this node's state until the next is noted."""
        self.note_state(level, message, **values)
        self._publish_status("run", stamp)

    def note_state(self, level: bytes, message: str, **values: object) -> None:
        """Note how this node is: ``tell_state`` publishes it."""
        self._status = DiagnosticStatus(
            level=level,
            message=message,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )

    def tell_state(self) -> None:
        """Publish the state where it is due, so that who looks knows that this node is there."""
        if time.monotonic() >= self._state_due:
            self._state_due = time.monotonic() + STATE_PERIOD
            self._publish_status("state", self.get_clock().now().nanoseconds)
            # Told from the first moment on: a recorder that comes later has lost nothing.
            self._diagnostics.count -= 1

    def _publish_status(self, what: str, stamp: int) -> None:
        status = self._status
        status.name = f"{self.get_fully_qualified_name().lstrip('/')}: {what}"
        status.hardware_id = self.hardware_id
        self._diagnostics.publish(DiagnosticArray(header=header(stamp), status=[status]))

    def next_deadline(self) -> float | None:
        """Return the steady time [s] at which ``on_deadline`` is due; None for never."""
        return None

    def on_deadline(self) -> None:
        """Do what was due at the deadline; a late wake-up finds everything that is due."""

    def on_stop(self) -> None:
        """Bring things to a safe end: torque to zero, files closed."""

    def end(self) -> None:
        """End the node's part, however it came to its end, and see its last messages off."""
        self.stopping = True
        try:
            self.on_stop()
        except Exception as error:
            self.fail_with(error)
        deadline = time.monotonic() + LAST_WORDS
        for publisher in self._offered:
            publisher.wait_until_received(max(deadline - time.monotonic(), 0.0))


def declare(
    node: Node,
    name: str,
    default: object,
    description: str,
    *,
    unit: str = "",
    within: tuple[float, float] | None = None,
    choices: Sequence[str] = (),
    read_only: bool = True,
) -> Any:
    """
    Declare a parameter with description, unit and range, and return its value.

    Raises
    ------
    ValueError
        where the value that was given is of another type or out of range.

    """
    text = f"{description} [{unit}]" if unit else description
    descriptor = ParameterDescriptor(description=text, read_only=read_only)
    allowed = f"a value like {default!r}"
    if choices:
        allowed = descriptor.additional_constraints = ", ".join(choices)
    if within is not None:
        low, high = within
        allowed = f"{low:g} to {high:g}" + (f" {unit}" if unit not in ("", "1") else "")
        if isinstance(default, int):
            whole = IntegerRange(from_value=int(low), to_value=int(high))
            descriptor.integer_range = [whole]
        else:
            real = FloatingPointRange(from_value=float(low), to_value=float(high))
            descriptor.floating_point_range = [real]
    try:
        return node.declare_parameter(name, default, descriptor).value
    except (InvalidParameterValueException, InvalidParameterTypeException):
        given = node._parameter_overrides[name].value
        if isinstance(default, float) and type(given) is int:
            allowed = f"a number with a decimal point, such as {float(given)!r}"
        raise ValueError(f"{name}: {given!r}; allowed: {allowed}") from None


def declare_texts(node: Node, name: str, description: str) -> list[str]:
    """Declare a parameter that holds texts; ROS cannot tell the type of an empty list."""
    return [text for text in declare(node, name, [""], description) if text]


def declare_side(node: Node, name: str, description: str) -> None:
    """Declare a parameter that names a leg and may change."""
    declare(node, name, "right", description, choices=SIDES, read_only=False)


def side_of(name: str, value: Callable[[str], Any]) -> Side:
    """Return the side that a parameter names; ValueError where it names none."""
    if value(name) not in SIDES:
        raise ValueError(f"{name}: {value(name)!r}; allowed: {', '.join(SIDES)}")
    return Side[value(name).upper()]


def declare_fields(node: Node, dataclass_type: Any, prefix: str = "") -> None:
    """
    Declare every field of a dataclass as a parameter that may change.

    The fields' settings say meaning, unit and range.
    """
    for name, told in settings_of(dataclass_type).items():
        declare(
            node,
            prefix + name,
            getattr(dataclass_type, name),
            told.meaning,
            unit=told.unit,
            within=(told.least, told.most),
            read_only=False,
        )


def fields_of(dataclass_type: Any, value: Callable[[str], Any], prefix: str = "") -> Any:
    """Return a dataclass made of its parameters; it raises ValueError where they do not fit."""
    return dataclass_type(**{f.name: value(prefix + f.name) for f in fields(dataclass_type)})


def refuse_unknown_parameters(node: Any) -> None:
    """Raise ValueError where a parameter was given that the node does not have."""
    unknown = [
        name
        for name in node._parameter_overrides
        if not node.has_parameter(name) and not name.startswith("qos_overrides.")
    ]
    if unknown:
        known = ", ".join(sorted(node._parameters))
        raise ValueError(f"{unknown[0]}: unknown parameter; allowed: {known}")


def run_node(make_node: Callable[[], Any]) -> int:
    """
    Run a node until it is finished, it fails, or SIGINT or SIGTERM arrives.

    Returns
    -------
    int
        0 for a clean stop, 1 for a failure, 2 for an argument or a parameter that was refused;
        the reason is one line on standard error, for an unforeseen failure behind its traceback.

    """
    stop_requested = False
    node: Any = None

    def request_stop(*_: object) -> None:
        nonlocal stop_requested
        stop_requested = True
        if node is not None:
            node.stopping = True

    # rclpy's own handlers shut the context down at once: no last message could be sent.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, request_stop)
    arguments = sys.argv
    name = arguments[0].rpartition("/")[2]
    try:
        try:
            rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
            if extra := remove_ros_args(arguments)[1:]:
                raise ValueError(
                    f"unknown argument {extra[0]!r}; allowed: --ros-args -p PARAMETER:=VALUE ..."
                )
            node = make_node()
            node.offer_ready()
        except (ParameterException, ValueError, rclpy._rclpy_pybind11.RCLError) as error:
            print(f"{name}: {' '.join(str(error).split())}", file=sys.stderr)
            return 2
        except rclpy._rclpy_pybind11.UnknownROSArgsError as error:
            print(f"{name}: unknown ROS arguments {error}", file=sys.stderr)
            return 2
        executor = EventsExecutor()
        executor.add_node(node)
        try:
            while not (stop_requested or node.finished or node.failure):
                deadline = node.next_deadline()
                sleep = LONGEST_SLEEP
                if deadline is not None:
                    sleep = min(max(deadline - time.monotonic(), 0.0), LONGEST_SLEEP)
                executor.spin_once(timeout_sec=sleep)
                node.tell_state()
                deadline = node.next_deadline()
                if deadline is not None and time.monotonic() >= deadline:
                    node.on_deadline()
        except Exception as error:
            node.fail_with(error)
        node.end()
        executor.shutdown()
        if node.failure:
            print(f"{name}: {node.failure}", file=sys.stderr)
            return 1
        return 0
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
