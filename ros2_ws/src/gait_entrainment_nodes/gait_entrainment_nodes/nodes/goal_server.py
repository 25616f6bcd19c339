# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""An action server whose goals end in order, each executed when its result is available."""

from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse

from gait_entrainment_nodes.nodes.participant import Participant


class GoalServer:
    """
    Serves an action whose results have an ``outcome``: 0 for success, CANCELLED or another.

    rclpy's executor resumes a waiting coroutine over and over, which would keep a processor busy
    for as long as a goal takes. A goal is therefore executed only once it has ended.

    ``accept`` returns whether to accept a request. ``begin`` takes an accepted request. ``cancel``
    is called if the client cancels it.
    """

    def __init__(
        self,
        node: Participant,
        action: Any,
        name: str,
        *,
        accept: Callable[[Any], bool],
        begin: Callable[[Any], None] = lambda _: None,
        cancel: Callable[[], None] = lambda: None,
    ) -> None:
        self._accept, self._begin, self._cancel = accept, begin, cancel
        self._goals: deque[Any] = deque()  # under way, in order
        self._server = ActionServer(
            node,
            action,
            name,
            execute_callback=lambda _: None,  # each goal has its own, see end
            goal_callback=node.guarded(self._on_goal),
            handle_accepted_callback=node.guarded(self._on_accepted),
            cancel_callback=node.guarded(self._on_cancel),
        )

    @property
    def cancelled(self) -> bool:
        """Whether the client has cancelled a goal that is under way."""
        return any(goal.is_cancel_requested for goal in self._goals)

    def publish_feedback(self, feedback: Any, side: int | None = None) -> None:
        """Send feedback to the client of the first goal under way, on ``side`` if given."""
        if goals := self._under_way(side):
            goals[0].publish_feedback(feedback)

    def end(self, result: Any, side: int | None = None) -> None:
        """End the first goal under way, on ``side`` if given, with its result."""
        goal = self._under_way(side)[0]
        self._goals.remove(goal)
        goal.execute(lambda goal: self._execute(goal, result))

    def _under_way(self, side: int | None) -> list[Any]:
        return [goal for goal in self._goals if side is None or goal.request.side == side]

    def _on_goal(self, request: Any) -> GoalResponse:
        return GoalResponse.ACCEPT if self._accept(request) else GoalResponse.REJECT

    def _on_accepted(self, goal: Any) -> None:
        self._goals.append(goal)
        self._begin(goal.request)

    def _on_cancel(self, _: Any) -> CancelResponse:
        self._cancel()
        return CancelResponse.ACCEPT

    def _execute(self, goal: Any, result: Any) -> Any:
        if result.outcome == 0:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result
