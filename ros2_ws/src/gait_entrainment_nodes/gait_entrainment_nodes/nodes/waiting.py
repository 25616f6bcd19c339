# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for conditions in a coroutine of a node, on steady time.

The node's loop resumes the coroutine once a condition holds or has timed out. rclpy's executor
would resume it over and over for as long as it waits, and keep a processor busy.
"""

import math
import time
import types
from collections.abc import Callable, Coroutine, Generator
from typing import Any

# How often to check what is waited for [s].
TICK = 0.02
# A tick that is late by this share of the longest silence shows that this process was held up, so
# no other node is to blame.
HELD_UP = 1 / 3


class Waiting:
    """What a coroutine of a node waits for; the node's loop checks it at every deadline."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._tick_at = clock() + TICK
        self._coroutine: Coroutine[Any, Any, None] | None = None
        self._condition: Callable[[], bool] = _nothing
        self._give_up = math.inf

    @property
    def busy(self) -> bool:
        """Whether a coroutine has started and not ended."""
        return self._coroutine is not None

    @property
    def deadline(self) -> float:
        """The steady time [s] of the next check: a tick, or now if the condition holds."""
        return min(self._tick_at, self._clock()) if self._condition() else self._tick_at

    def begin(self, coroutine: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine that waits only here; one at a time."""
        assert not self.busy
        self._coroutine = coroutine
        self._tick_at = self._clock()

    async def until(
        self,
        condition: Callable[[], bool],
        timeout: float = math.inf,
        overdue: Exception | None = None,
    ) -> None:
        """Wait until a condition holds; after ``timeout`` [s] raise ``overdue``, if given."""
        self._condition, self._give_up = condition, self._clock() + timeout
        try:
            while not condition():
                if self._clock() > self._give_up:
                    if overdue is None:
                        return
                    raise overdue
                await self.tick()
        finally:
            self._condition = _nothing

    @types.coroutine
    def tick(self) -> Generator[None, None, None]:
        """Wait for the next check by the node's loop."""
        yield

    def look_after(self, silence: float) -> bool:
        """
        Resume the coroutine, if other nodes may be silent for at most a time [s].

        Returns whether this process was held up. The timeout is then extended, because what
        arrived in the meantime has not been read yet.
        """
        now = self._clock()
        late, self._tick_at = now - self._tick_at, now + TICK
        held_up = late > HELD_UP * silence
        if held_up:
            self._give_up += late
        if self._coroutine is not None:
            try:
                self._coroutine.send(None)
            except StopIteration:
                self._coroutine = None
        return held_up


def _nothing() -> bool:
    return False
