# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A place in the ROS graph for processes that are not nodes: commands, launch files, tests.

A node can answer only clients that it has discovered; an answer to any other is lost. So requests
are repeated (``Client.call``, ``Client.ask``), and a request that must not be repeated waits until
the node is known to answer (``Client.wait_to_be_known``). Discovery announces the endpoints of a
process in the order in which they were made: a node that answers the latest one knows them all.
"""

import math
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import rclpy
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.exceptions import InvalidServiceNameException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from gait_entrainment.errors import UsageError
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.environment import UnusableEnvironmentError
from gait_entrainment_nodes.messaging.errors import SilenceError

if TYPE_CHECKING:  # it loads every type of message, which a client need not wait for
    from gait_entrainment_nodes.messaging.topics import Topic

# How long to wait for a node before it counts as silent [s].
TIMEOUT = 60.0
# When to ask again [s].
ASKING_PERIOD = 0.1
# How long to listen before a condition is checked again, even if nothing arrives [s].
ROUND = 0.02


class Question:
    """A request to a service, repeated each period [s] until its answer is acceptable."""

    def __init__(
        self, service: Any, request: Any, accept: Callable[[Any], object], period: float
    ) -> None:
        self.latest: Any = None  # answer, acceptable or not
        self.answered_at = -math.inf  # when it arrived, on the steady clock [s]
        self.accepted: Any = None  # the first acceptable answer
        self._service, self._request, self._accept, self._period = service, request, accept, period
        self._asked_at = -math.inf
        self._pending: list[Any] = []

    def answer(self) -> Any:
        """Return the first acceptable answer, None before it arrives; ask if it is time to."""
        now = time.monotonic()
        for call in [call for call in self._pending if call.done()]:
            self._pending.remove(call)
            self.latest, self.answered_at = call.result(), now
            if self.accepted is None and self._accept(self.latest):
                self.accepted = self.latest
        due = self.accepted is None and now - self._asked_at >= self._period
        if due and self._service.service_is_ready():
            self._asked_at = now
            self._pending.append(self._service.call_async(self._request))
        return self.accepted


def all_answered(questions: Iterable[Question]) -> bool:
    """Ask each of several questions if it is due; return whether all are answered."""
    answers = [question.answer() for question in questions]
    return all(answers)


class Client:
    """
    A node with its own context and executor, in a ROS domain or that of the environment.

    ``each_round`` is called repeatedly during every wait. An exception in it ends the wait, for
    example when a process that should answer has ended. Raises UnusableEnvironmentError if ROS
    cannot start.
    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str = "",
        domain: int | None = None,
        each_round: Callable[[], object] = lambda: None,
    ) -> None:
        self.each_round = each_round
        self._context = Context()
        try:
            rclpy.init(args=[], context=self._context, domain_id=domain)
        except RuntimeError as error:
            raise UnusableEnvironmentError(" ".join(str(error).split())) from None
        # Fewer endpoints are discovered sooner.
        self.node = Node(
            name,
            context=self._context,
            namespace=namespace,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._services: dict[str, Any] = {}
        self._actions: dict[str, ActionClient] = {}

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def subscribe(
        self, topic: "Topic", callback: Callable[[Any], None], *, raw: bool = False
    ) -> None:
        """Subscribe to a topic; with ``raw`` the callback gets serialized messages."""
        self.node.create_subscription(topic.type, topic.name, callback, topic.qos, raw=raw)

    def wait(self, condition: Callable[[], Any], timeout: float = math.inf) -> Any:
        """Serve ROS until a condition holds, at most ``timeout`` [s]; return its last value."""
        give_up = time.monotonic() + timeout
        while not (value := condition()) and (left := give_up - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=min(left, ROUND))
            self.each_round()
        return value

    def service(self, service_type: Any, name: str) -> Any:
        """Return the client of a service, made once; UsageError if the name is invalid."""
        if name not in self._services:
            try:
                self._services[name] = self.node.create_client(service_type, name)
            except InvalidServiceNameException as error:
                raise UsageError(" ".join(str(error).split())) from None
        return self._services[name]

    def action(self, action_type: Any, name: str) -> Any:
        """Return the client of an action, made once."""
        if name not in self._actions:
            self._actions[name] = ActionClient(self.node, action_type, name)
        return self._actions[name]

    def ask(
        self,
        service_type: Any,
        name: str,
        request: Any = None,
        *,
        accept: Callable[[Any], object] = lambda _: True,
        period: float = ASKING_PERIOD,
    ) -> Question:
        """Return a question to a service; wait for its ``answer``. Infinite period: ask once."""
        service = self.service(service_type, name)
        return Question(service, request or service_type.Request(), accept, period)

    def call(
        self,
        service_type: Any,
        name: str,
        request: Any = None,
        *,
        timeout: float = TIMEOUT,
        **asking: Any,
    ) -> Any:
        """Ask as ``ask`` does and return the answer; SilenceError after ``timeout`` [s]."""
        question = self.ask(service_type, name, request, **asking)
        return self._expect(question.answer, name, timeout)

    def wait_to_be_known(self, node: str, timeout: float = TIMEOUT) -> None:
        """
        Wait until a node of this project knows everything that this client has made so far.

        SilenceError if it does not answer within ``timeout`` [s].
        """
        name = f"{node}/ready"
        self._services.pop(name, None)  # to be made again, after everything else
        self._expect(self.ask(Ready, name).answer, name, timeout)

    def send_goal(
        self,
        action_type: Any,
        name: str,
        goal: Any,
        *,
        on_feedback: Callable[[Any], object] | None = None,
        timeout: float = TIMEOUT,
    ) -> Any:
        """Return the handle of a goal, accepted or not; SilenceError after ``timeout`` [s]."""
        action = self.action(action_type, name)
        self._expect(action.server_is_ready, name, timeout)
        answer = action.send_goal_async(goal, feedback_callback=on_feedback)
        self._expect(answer.done, name, timeout)
        return answer.result()

    def result(self, handle: Any, timeout: float = math.inf) -> Any:
        """Wait for status and result of an accepted goal; None if they do not arrive in time."""
        answer = handle.get_result_async()
        return answer.result() if self.wait(answer.done, timeout) else None

    def _expect(self, condition: Callable[[], Any], name: str, timeout: float) -> Any:
        if not (value := self.wait(condition, timeout)):
            raise SilenceError(name, timeout)
        return value
