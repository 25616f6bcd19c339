# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Waiting in a coroutine: conditions, times that are over, and a process that was held up."""

import pytest

from gait_entrainment_nodes.nodes.waiting import HELD_UP, TICK, Waiting

SILENCE = 3.0


class Bench:
    """A loop as a node's, on a clock of its own."""

    def __init__(self):
        self.now = 100.0
        self.waiting = Waiting(lambda: self.now)
        self.happened = []

    def run(self, until, step=TICK):
        while self.now < until:
            self.now += step
            if self.now >= self.waiting.deadline:
                self.waiting.look_after(SILENCE)


@pytest.fixture
def bench():
    return Bench()


def test_coroutine_goes_on_once_its_condition_holds(bench):
    answer = []

    async def wait():
        await bench.waiting.until(lambda: bool(answer), 5.0, TimeoutError())
        bench.happened.append(answer[0])

    bench.waiting.begin(wait())
    assert bench.waiting.busy
    bench.run(102.0)
    assert bench.happened == []
    answer.append("here")
    assert bench.waiting.deadline <= bench.now  # at once, not at the next tick
    bench.waiting.look_after(SILENCE)
    assert bench.happened == ["here"]
    assert not bench.waiting.busy
    assert bench.waiting.deadline > bench.now


def test_what_is_overdue_is_raised_or_let_go(bench):
    async def wait():
        await bench.waiting.until(lambda: False, 1.0)
        bench.happened.append("let go")
        try:
            await bench.waiting.until(lambda: False, 1.0, TimeoutError("nobody"))
        except TimeoutError as error:
            bench.happened.append(str(error))

    bench.waiting.begin(wait())
    bench.run(101.5)
    assert bench.happened == ["let go"]
    bench.run(103.0)
    assert bench.happened == ["let go", "nobody"]


def test_nobody_is_to_blame_while_this_process_was_held_up(bench):
    async def wait():
        await bench.waiting.until(lambda: False, 3.0, TimeoutError())

    bench.waiting.begin(wait())
    bench.run(101.0)
    bench.now += 10.0  # the loop did not come by
    assert bench.waiting.look_after(SILENCE)
    bench.run(bench.now + 1.5)
    assert bench.waiting.busy
    with pytest.raises(TimeoutError):
        bench.run(bench.now + 1.0)


def test_tick_that_is_a_little_late_is_none(bench):
    bench.waiting.look_after(SILENCE)
    bench.now += HELD_UP * SILENCE
    assert not bench.waiting.look_after(SILENCE)
