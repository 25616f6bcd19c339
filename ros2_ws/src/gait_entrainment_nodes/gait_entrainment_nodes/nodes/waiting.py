# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for conditions in a coroutine of a node, on steady time.

The node's loop resumes the coroutine, once a condition holds or its time is over: rclpy's executor
would resume it over and over for as long as it waits, and keep a processor busy.
"""

import math
import time
import types
from collections.abc import Callable, Coroutine, Generator
from typing import Any

# How often waiting is looked after [s].
TICK = 0.02
# A tick that is late by this share of the longest silence shows that this process was held up:
# nobody else is to blame for it.
HELD_UP = 1 / 3


class Waiting:
    """What a coroutine of a node waits for; the node's loop looks after it at every deadline."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._tick_at = clock() + TICK
        self._coroutine: Coroutine[Any, Any, None] | None = None
        self._condition: Callable[[], bool] = _nothing
        self._give_up = math.inf

    @property
    def busy(self) -> bool:
        """Whether a coroutine has begun and not ended."""
        return self._coroutine is not None

    @property
    def deadline(self) -> float:
        """The steady time [s] at which to look after it: a tick, or now if a condition holds."""
        return min(self._tick_at, self._clock()) if self._condition() else self._tick_at

    def begin(self, coroutine: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine that waits here only; one at a time."""
        assert not self.busy
        self._coroutine = coroutine
        self._tick_at = self._clock()

    async def until(
        self,
        condition: Callable[[], bool],
        timeout: float = math.inf,
        overdue: Exception | None = None,
    ) -> None:
        """Wait until a condition holds, at most for a time [s]; then raise what is overdue."""
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
        """Wait until the node's loop comes by again."""
        yield

    def look_after(self, silence: float) -> bool:
        """
        Go on with what is due, when others may be silent for a time [s].

        Returns whether this process was held up: then all waiting begins anew, since what arrived
        meanwhile has not been heard yet.
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
