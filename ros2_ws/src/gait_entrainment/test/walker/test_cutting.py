# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""However a run is requested, its result is the same, bit for bit."""

from itertools import pairwise

import numpy as np
from driving import SECOND, TABLE_1, promise, pulse_trains, toe_offs, walked
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.walker import Walker

RUN = 6 * SECOND
SETTINGS = settings(derandomize=True, deadline=None, max_examples=40)
CUTS = st.lists(st.integers(1, RUN - 1), max_size=30, unique=True)
TORQUES = st.floats(-150, 60)


def walk_uncut(pulses, grid):
    walker = Walker(TABLE_1)
    promise(walker, pulses, RUN)
    events = walker.advance(RUN)
    return walker, events, walker.sample(grid[grid <= walker.time_reached])


def pieces(pulses, begin, end):
    """The part of a train that lies in [begin, end), as pieces that begin at `begin`."""
    borders = sorted({begin} | {t for a, b, _ in pulses for t in (a, b) if begin < t < end})
    level = [sum(torque for a, b, torque in pulses if a <= t < b) for t in borders]
    return borders, [float(torque) for torque in level]


def assert_same(first, second):
    for name in vars(first):
        a, b = getattr(first, name), getattr(second, name)
        assert np.array_equal(a, b), name


@SETTINGS
@given(left=pulse_trains(TORQUES), right=pulse_trains(TORQUES), cuts=CUTS, data=st.data())
def test_cutting_promises_and_advances_changes_nothing(left, right, cuts, data):
    grid = np.arange(0, RUN, 37_000_017)
    reference, events, samples = walk_uncut((left, right), grid)

    walker, cut_events, cut_samples, begin = Walker(TABLE_1), [], [], 0
    for end in [*sorted(cuts), RUN]:
        for side, train in zip(Side, (left, right), strict=True):
            # Promises run ahead of the walk by different times, cut at different places.
            ahead = data.draw(st.sampled_from([0, 1, 10_000_000, 900_000_000]))
            until = max(walker._promises[side].valid_until, min(RUN, end + ahead))
            since = walker._promises[side].valid_until
            if until > since:
                walker.extend_torque(side, *pieces(train, since, until), until)
        cut_events += walker.advance(end)
        inside = grid[(grid >= begin) & (grid < end) & (grid <= walker.time_reached)]
        cut_samples.append(walker.sample(inside))
        begin = end
    assert cut_events == events
    assert walker.ending == reference.ending
    for name in vars(samples):
        joined = np.concatenate([getattr(part, name) for part in cut_samples])
        assert np.array_equal(joined, getattr(samples, name)), name


def test_a_promise_that_ends_where_the_walk_stops_is_not_a_switch():
    """Torque zero past a promise is provisional until it has been walked through."""
    train = [(0, RUN - 1, 7.0)]
    _, events, _ = walk_uncut(((), train), np.empty(0, np.int64))
    walker, cut_events = Walker(TABLE_1), []
    for begin in range(0, RUN, 20_000_000):
        walker.extend_torque(Side.RIGHT, [begin], [7.0], begin + 20_000_000)
        cut_events += walker.advance(begin + 20_000_000)
    assert cut_events == events


@SETTINGS
@given(right=pulse_trains(TORQUES), order=st.randoms(use_true_random=False))
def test_a_sample_does_not_depend_on_the_others(right, order):
    grid = np.arange(0, RUN, 61_000_003)
    walker, _, samples = walk_uncut(((), right), grid)
    shuffled = list(range(samples.leading.size))
    order.shuffle(shuffled)
    assert_same(
        walker.sample(grid[shuffled]),
        type(samples)(**{name: value[shuffled] for name, value in vars(samples).items()}),
    )
    if shuffled:
        alone = walker.sample(grid[shuffled[:1]])
        assert np.array_equal(alone.position[0], samples.position[shuffled[0]])


@SETTINGS
@given(right=pulse_trains(st.floats(-5, 25)))
def test_equal_neighbours_are_merged(right):
    """A profile that repeats its torque piece by piece is the profile without the repeats."""
    _, events, _ = walk_uncut(((), right), np.empty(0, np.int64))
    walker = Walker(TABLE_1)
    borders, torques = pieces(right, 0, RUN)
    fine = sorted({*borders, *range(0, RUN, 10_000_000)})
    levels = [torques[np.searchsorted(borders, t, "right") - 1] for t in fine]
    walker.extend_torque(Side.RIGHT, fine, levels, RUN)
    assert walker.advance(RUN) == events


def test_events_are_returned_once_when_their_stamps_are_reached():
    walker = Walker(TABLE_1)
    first = walker.advance(0)
    assert [(e.kind, e.step, e.stamp, e.side) for e in first] == [(0, 0, 0, Side.RIGHT)]
    toe_off = toe_offs(walked()[1])[0]
    stamp = nanoseconds(toe_off)
    assert walker.advance(stamp - 1) == []
    (event,) = walker.advance(stamp)
    assert (event.kind, event.side, event.step, event.stamp) == (1, Side.LEFT, 1, stamp)
    assert walker.advance(stamp) == []


def test_steps_and_sides_alternate():
    walker = Walker(TABLE_1, Side.LEFT)
    events = walker.advance(10 * SECOND)
    strikes = [e for e in events if e.kind == 0]
    assert [e.step for e in strikes] == list(range(len(strikes)))
    assert [e.side for e in strikes] == [Side(n % 2) for n in range(len(strikes))]
    for before, after in pairwise(events):
        assert before.time < after.time
        assert after.stamp == nanoseconds(after.time)
        if after.kind == 1:
            assert after.side == before.side.other
            assert after.step == before.step + 1
