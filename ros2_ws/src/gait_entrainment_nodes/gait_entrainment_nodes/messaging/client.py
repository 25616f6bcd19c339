# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A place in the ROS graph for processes that are not nodes: commands, launch files, tests.

A node can answer only those it has discovered; what it sends to anyone else is lost. So a question
is asked again and again (``Client.call``, ``Client.ask``), and what must not be asked twice waits
until the node is known to answer (``Client.wait_to_be_known``). Discovery announces the endpoints
of a process in the order in which they were made: whoever answers the latest one knows them all.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.exceptions import InvalidServiceNameException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from gait_entrainment.errors import UsageError
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.errors import SilenceError
from gait_entrainment_nodes.messaging.topics import Topic

# How long to wait for a node before it counts as silent [s].
PATIENCE = 60.0
# When to ask again [s].
ASKING_PERIOD = 0.1
# How long to listen before a condition is looked at again, even if nothing arrives [s].
ROUND = 0.02


class Question:
    """
    A request that is repeated until its answer is acceptable.

    Attributes
    ----------
    accepted
        The first acceptable answer, None before it.
    latest
        The latest answer, acceptable or not; None before the first one.
    answered_at
        When it came, on the steady clock [s].

    """

    def __init__(
        self, service: Any, request: Any, accept: Callable[[Any], object], period: float
    ) -> None:
        self.accepted: Any = None
        self.latest: Any = None
        self.answered_at = -math.inf
        self._service, self._request, self._accept, self._period = service, request, accept, period
        self._asked_at = -math.inf
        self._pending: list[Any] = []

    def answer(self) -> Any:
        """Return the first acceptable answer, None before it; ask if it is time to."""
        for call in [call for call in self._pending if call.done()]:
            self._pending.remove(call)
            self.latest, self.answered_at = call.result(), time.monotonic()
            if self.accepted is None and self._accept(self.latest):
                self.accepted = self.latest
        now = time.monotonic()
        due = self.accepted is None and now - self._asked_at >= self._period
        if due and self._service.service_is_ready():
            self._asked_at = now
            self._pending.append(self._service.call_async(self._request))
        return self.accepted


class Client:
    """
    A node with a context and an executor of its own.

    Parameters
    ----------
    name
        Of the node.
    namespace
        That relative names belong to, from the root on.
    domain
        The ROS domain; None for that of the environment.
    each_round
        Called over and over while anything is waited for; ends the waiting by an exception, for
        instance when a process that should answer has ended.

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
        rclpy.init(args=[], context=self._context, domain_id=domain)
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
        self, topic: Topic, callback: Callable[[Any], None], *, raw: bool = False
    ) -> None:
        """Hear a topic; ``raw`` gives the callback serialized messages."""
        self.node.create_subscription(topic.type, topic.name, callback, topic.qos, raw=raw)

    def wait(self, condition: Callable[[], Any], patience: float = math.inf) -> Any:
        """Serve ROS until a condition holds, at most ``patience`` [s]; return its last value."""
        give_up = time.monotonic() + patience
        while not (value := condition()) and time.monotonic() < give_up:
            self._executor.spin_once(timeout_sec=ROUND)
            self.each_round()
        return value

    def service(self, service_type: Any, name: str) -> Any:
        """Return the client of a service, made once; UsageError if it cannot have that name."""
        if name not in self._services:
            try:
                self._services[name] = self.node.create_client(service_type, name)
            except InvalidServiceNameException as error:
                raise UsageError(" ".join(str(error).split())) from None
        return self._services[name]

    def action(self, action_type: Any, name: str) -> Any:
        """Return the client of an action; it is made once."""
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
        """
        Return a question to a service, to be waited for by its ``answer``.

        It is asked each ``period`` [s] until ``accept`` is true of an answer; infinite: only once.
        """
        request = request or service_type.Request()
        return Question(self.service(service_type, name), request, accept, period)

    def call(
        self,
        service_type: Any,
        name: str,
        request: Any = None,
        *,
        accept: Callable[[Any], object] = lambda _: True,
        period: float = ASKING_PERIOD,
        patience: float = PATIENCE,
    ) -> Any:
        """
        Ask a service, see ``ask``, and wait for the first acceptable answer.

        Raises
        ------
        SilenceError
            There was none within ``patience`` [s].

        """
        question = self.ask(service_type, name, request, accept=accept, period=period)
        return self._expect(question.answer, name, patience)

    def wait_to_be_known(self, node: str, patience: float = PATIENCE) -> None:
        """
        Wait until a node of this project knows everything that this client has made so far.

        Raises
        ------
        SilenceError
            It does not answer within ``patience`` [s].

        """
        name = f"{node}/ready"
        self._services.pop(name, None)  # to be made anew, behind everything else
        self._expect(self.ask(Ready, name).answer, name, patience)

    def send_goal(
        self,
        action_type: Any,
        name: str,
        goal: Any,
        *,
        on_feedback: Callable[[Any], object] | None = None,
        patience: float = PATIENCE,
    ) -> Any:
        """
        Send a goal to an action server; return its handle, accepted or not.

        Raises
        ------
        SilenceError
            There was no answer within ``patience`` [s].

        """
        action = self.action(action_type, name)
        self._expect(action.server_is_ready, name, patience)
        answer = action.send_goal_async(goal, feedback_callback=on_feedback)
        self._expect(answer.done, name, patience)
        return answer.result()

    def result(self, handle: Any, patience: float = math.inf) -> Any:
        """Wait for status and result of an accepted goal; None if they do not come in time."""
        answer = handle.get_result_async()
        return answer.result() if self.wait(answer.done, patience) else None

    def _expect(self, condition: Callable[[], Any], name: str, patience: float) -> Any:
        value = self.wait(condition, patience)
        if not value:
            raise SilenceError(name, patience)
        return value
