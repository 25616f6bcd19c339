# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Waiting in a coroutine: conditions, timeouts, and a process that was held up."""

import pytest

from gait_entrainment_nodes.nodes.waiting import HELD_UP, TICK, Waiting

SILENCE = 3.0


class Bench:
    """A loop like a node's, on its own clock."""

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


def test_coroutine_resumes_once_its_condition_holds(bench):
    answer = []

    async def wait():
        await bench.waiting.until(lambda: bool(answer), 5.0, TimeoutError())
        bench.happened.append(answer[0])

    bench.waiting.begin(wait())
    assert bench.waiting.busy
    bench.run(102.0)
    assert bench.happened == []
    answer.append("here")
    assert bench.waiting.deadline <= bench.now  # now, not at the next tick
    bench.waiting.look_after(SILENCE)
    assert bench.happened == ["here"]
    assert not bench.waiting.busy
    assert bench.waiting.deadline > bench.now


def test_timeout_raises_if_an_error_is_given_and_returns_otherwise(bench):
    async def wait():
        await bench.waiting.until(lambda: False, 1.0)
        bench.happened.append("returned")
        try:
            await bench.waiting.until(lambda: False, 1.0, TimeoutError("overdue"))
        except TimeoutError as error:
            bench.happened.append(str(error))

    bench.waiting.begin(wait())
    bench.run(101.5)
    assert bench.happened == ["returned"]
    bench.run(103.0)
    assert bench.happened == ["returned", "overdue"]


def test_timeout_is_extended_if_this_process_was_held_up(bench):
    async def wait():
        await bench.waiting.until(lambda: False, 3.0, TimeoutError())

    bench.waiting.begin(wait())
    bench.run(101.0)
    bench.now += 10.0  # the loop did not run
    assert bench.waiting.look_after(SILENCE)
    bench.run(bench.now + 1.5)
    assert bench.waiting.busy
    with pytest.raises(TimeoutError):
        bench.run(bench.now + 1.0)


def test_slightly_late_tick_does_not_count_as_held_up(bench):
    bench.waiting.look_after(SILENCE)
    bench.now += HELD_UP * SILENCE
    assert not bench.waiting.look_after(SILENCE)
