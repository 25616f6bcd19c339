# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""An action server that has one goal at a time and executes it when its result is there."""

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse

from gait_entrainment_nodes.nodes.participant import Participant


class OneGoalServer:
    """
    Serves an action whose results have an ``outcome``: 0 if all is well, CANCELLED or another.

    rclpy's executor resumes a coroutine that waits over and over, and would keep a processor busy
    for as long as a goal takes: so a goal is executed only once it has ended.

    ``accept`` says whether to accept a request; it must refuse one while a goal is under way.
    ``begin`` takes the request that was accepted; ``cancel`` is called if the client cancels it.
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
        self._goal: Any = None  # under way
        self._result: Any = None
        self._server = ActionServer(
            node,
            action,
            name,
            execute_callback=self._execute,
            goal_callback=node.guarded(self._on_goal),
            handle_accepted_callback=node.guarded(self._on_accepted),
            cancel_callback=node.guarded(self._on_cancel),
        )

    @property
    def busy(self) -> bool:
        """Whether a goal is under way."""
        return self._goal is not None

    @property
    def cancelled(self) -> bool:
        """Whether the client has cancelled the goal that is under way."""
        return self._goal is not None and bool(self._goal.is_cancel_requested)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the client, if there is one."""
        if self._goal is not None:
            self._goal.publish_feedback(feedback)

    def end(self, result: Any) -> None:
        """End the goal that is under way with its result."""
        self._result = result
        self._goal.execute()

    def _on_goal(self, request: Any) -> GoalResponse:
        return GoalResponse.ACCEPT if self._accept(request) else GoalResponse.REJECT

    def _on_accepted(self, goal: Any) -> None:
        self._goal = goal
        self._begin(goal.request)

    def _on_cancel(self, _: Any) -> CancelResponse:
        self._cancel()
        return CancelResponse.ACCEPT

    def _execute(self, goal: Any) -> Any:
        result, self._goal = self._result, None
        if result.outcome == 0:
            goal.succeed()
        elif result.outcome == result.CANCELLED:
            goal.canceled()
        else:
            goal.abort()
        return result
