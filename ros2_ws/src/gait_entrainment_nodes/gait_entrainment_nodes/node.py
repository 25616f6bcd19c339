# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
What all nodes share: one loop, a clean stop, counted publishers, declared parameters.

The loop is a series of ``spin_once`` of the EventsExecutor: it receives ten times as much as the
default executor, and between two calls the node meets its own deadlines on steady time.
"""

import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_nodes.stamps import header
from gait_entrainment_nodes.topics import DIAGNOSTICS, PUBLISHED_COUNTS, Topic

# The longest time [s] that the loop sleeps in the executor, so that a signal is soon obeyed.
LONGEST_SLEEP = 0.1
# How often a full writer is tried again [s], while its slowest reader catches up.
RETRY_PERIOD = 0.002


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
    def unmatched(self) -> int:
        """Number of subscriptions known to exist that have not been matched yet."""
        known = self._node.count_subscribers(self.topic_name)
        return max(known - self._publisher.get_subscription_count(), 0)

    def publish(self, message: Any) -> None:
        """Publish a message, or its serialized bytes; wait while the history is full."""
        while True:
            try:
                self._publisher.publish(message)
            except rclpy._rclpy_pybind11.RCLError:
                if self._node.stopping:
                    raise
                time.sleep(RETRY_PERIOD)
            else:
                self.count += 1
                return


class Participant:
    """
    Mixin for a node that takes part in a run.

    Offers ``~/ready`` (std_srvs/Trigger): true once every subscription that is known to exist on
    its topics has been matched, so that the first message that must arrive will arrive.
    """

    get_logger: Callable[[], RcutilsLogger]

    def begin_participation(self) -> None:
        """Set up what every participant has; to be called at the end of the constructor."""
        self.stopping = False
        self.failure: str | None = None  # why the node must end with exit code 1
        self.finished = False  # set to end the loop with exit code 0
        self._publishers_counted: list[CountedPublisher] = []
        self._diagnostics = self.create_publisher(
            DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.qos
        )
        self._counts = self.create_publisher(
            PUBLISHED_COUNTS.type, PUBLISHED_COUNTS.name, PUBLISHED_COUNTS.qos
        )
        self.create_service(Trigger, "~/ready", self._on_ready)

    def publisher(self, topic: Topic) -> CountedPublisher:
        """Create a counted publisher."""
        publisher = CountedPublisher(self, topic)
        self._publishers_counted.append(publisher)
        return publisher

    def subscription(self, topic: Topic, callback: Callable[[Any], None], **options: Any) -> Any:
        """Create a subscription with the quality of service of its topic."""
        return self.create_subscription(topic.type, topic.name, callback, topic.qos, **options)

    def not_ready(self) -> str:
        """Return what this node still waits for before a run, or an empty text."""
        waiting = [p.topic_name for p in self._publishers_counted if p.unmatched]
        return f"subscriptions of {', '.join(waiting)}" if waiting else ""

    def _on_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self.not_ready()
        response.success = not response.message
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
        """Publish one diagnostic status of this node."""
        status = DiagnosticStatus(
            level=level,
            name=f"{self.get_name()}: run",
            message=message,
            hardware_id="",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        self._diagnostics.publish(DiagnosticArray(header=header(stamp), status=[status]))

    def next_deadline(self) -> float | None:
        """Return the steady time [s] at which ``on_deadline`` is due; None for never."""
        return None

    def on_deadline(self) -> None:
        """Do what was due at the deadline; a late wake-up finds everything that is due."""

    def on_stop(self) -> None:
        """Bring things to a safe end: torque to zero, files closed."""


def declare(
    node: Node,
    name: str,
    default: object,
    description: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    read_only: bool = True,
) -> Any:
    """Declare a parameter with description, unit and range, and return its value."""
    text = f"{description} [{unit}]" if unit else description
    descriptor = ParameterDescriptor(description=text, read_only=read_only)
    if minimum is not None and maximum is not None:
        if isinstance(default, int):
            descriptor.integer_range = [
                IntegerRange(from_value=int(minimum), to_value=int(maximum))
            ]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(minimum), to_value=float(maximum))
            ]
    return node.declare_parameter(name, default, descriptor).value


def declare_fields(node: Node, dataclass_type: Any, prefix: str = "") -> Any:
    """
    Declare every field of a dataclass as a parameter and return an instance of it.

    The fields' metadata say meaning, unit and, where it is fixed, the range. The dataclass checks
    the rest when it is made.
    """
    values = {}
    for f in fields(dataclass_type):
        low, high = f.metadata.get("range", (None, None))
        values[f.name] = declare(
            node,
            f"{prefix}.{f.name}" if prefix else f.name,
            f.default,
            f.metadata["meaning"],
            unit=f.metadata["unit"],
            minimum=low,
            maximum=high,
        )
    return dataclass_type(**values)


def run_node(make_node: Callable[[], Any], arguments: Sequence[str] | None = None) -> int:
    """
    Run a node until it is finished, it fails, or SIGINT or SIGTERM arrives.

    Returns
    -------
    int
        0 for a clean stop, 1 for a failure, 2 for a parameter that was refused; the reason is
        one line on standard error.

    """
    stop_requested = False

    def request_stop(*_: object) -> None:
        nonlocal stop_requested
        stop_requested = True

    # rclpy's own handlers shut the context down at once: no last message could be sent.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, request_stop)
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = make_node()
        executor = EventsExecutor()
        executor.add_node(node)
        while not (stop_requested or node.finished or node.failure):
            deadline = node.next_deadline()
            sleep = LONGEST_SLEEP
            if deadline is not None:
                sleep = min(max(deadline - time.monotonic(), 0.0), LONGEST_SLEEP)
            executor.spin_once(timeout_sec=sleep)
            deadline = node.next_deadline()
            if deadline is not None and time.monotonic() >= deadline:
                node.on_deadline()
        node.stopping = True
        node.on_stop()
        executor.shutdown()
        if node.failure:
            print(f"{node.get_name()}: {node.failure}", file=sys.stderr)
            return 1
    except (ParameterException, ValueError) as error:
        print(f"{' '.join(str(error).split())}", file=sys.stderr)
        return 2 if node is None else 1
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
