# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for answers in a coroutine of a node, on steady time.

The node's loop resumes the coroutine: rclpy's executor would do so over and over, for as long as
it waits, and keep a processor busy.
"""

import time
from collections.abc import Coroutine
from typing import Any

from rclpy.task import Future

# How often waiting is looked after [s].
TICK = 0.02
# A tick that is so late [s] says that this process was held up: others are not blamed for it.
HELD_UP = 1.0


class OverdueError(Exception):
    """Somebody owes an answer for too long; the message says who, and what is amiss."""


class Waiting:
    """What a coroutine of a node waits for; the node's loop looks after it at every deadline."""

    def __init__(self) -> None:
        self.deadline = time.monotonic() + TICK  # when it is looked after next, steady time [s]
        self._coroutine: Coroutine[Any, Any, None] | None = None
        self._waits: list[tuple[Future, float, str]] = []  # what, until when, why it matters
        self._ticks: list[Future] = []

    def begin(self, coroutine: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine that waits here only; one at a time."""
        assert self._coroutine is None
        self._coroutine = coroutine
        self._hasten()

    async def until(self, future: Future) -> Any:
        """Return the result of a future."""
        future.add_done_callback(lambda _: self._hasten())
        return await future

    async def within(self, future: Future, reason: str, timeout: float) -> Any:
        """Return the result of a future; OverdueError with the reason after a time [s]."""
        self._waits.append((future, time.monotonic() + timeout, reason))
        return await self.until(future)

    async def tick(self) -> None:
        """Wait for the next tick."""
        future = Future()
        self._ticks.append(future)
        await future

    def look_after(self) -> bool:
        """
        Go on with what is due.

        Returns whether this process was held up: then all waiting begins anew, since what came
        meanwhile has not been heard yet.
        """
        now = time.monotonic()
        late, self.deadline = now - self.deadline, now + TICK
        held_up = late > HELD_UP
        waits, self._waits = self._waits, []
        for future, until, reason in waits:
            latest = until + late if held_up else until
            if future.done():
                continue
            if now > latest:
                future.set_exception(OverdueError(reason))
            else:
                self._waits.append((future, latest, reason))
        ticks, self._ticks = self._ticks, []
        for future in ticks:
            future.set_result(None)
        if self._coroutine is not None:
            try:
                self._coroutine.send(None)
            except StopIteration:
                self._coroutine = None
        return held_up

    def _hasten(self) -> None:
        """Let the loop look after it at once; a deadline that has passed stays as it is."""
        self.deadline = min(self.deadline, time.monotonic())
