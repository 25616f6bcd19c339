# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Promises of torque: refused, late, provisional and cut ones."""

import numpy as np
import pytest
from driving import SECOND, TABLE_1, walked

from gait_entrainment.conventions import Side
from gait_entrainment.walker import Walker

ONSET, END = SECOND, SECOND + SECOND // 5


def delivered(walker, *stamps):
    return walker.sample(np.array(stamps)).delivered_torque[:, Side.RIGHT].tolist()


def test_without_a_promise_the_torque_is_zero():
    walker = Walker(TABLE_1)
    assert walker.advance(3 * SECOND) == walked(seconds=3.0)[1]
    assert walker.valid_until == 0


def test_valid_until_is_the_time_promised_for_both_ankles():
    walker = Walker(TABLE_1)
    walker.extend_torque(Side.RIGHT, [0], [0.0], 5)
    assert walker.valid_until == 0
    walker.extend_torque(Side.LEFT, [], [], 3)
    assert walker.valid_until == 3


def test_a_gap_between_promises_is_zero_torque():
    walker = Walker(TABLE_1)
    walker.extend_torque(Side.RIGHT, [0], [5.0], 10)
    walker.extend_torque(Side.RIGHT, [20], [5.0], 30)
    walker.advance(40)
    assert delivered(walker, 5, 10, 11, 20, 21, 30, 31) == [5, 5, 0, 0, 5, 5, 0]


def test_a_late_promise_acts_from_where_the_walker_is():
    walker = Walker(TABLE_1)
    walker.advance(ONSET + 100)
    late = walker.extend_torque(Side.RIGHT, [ONSET - 50, ONSET + 150], [7.0, 8.0], END)
    assert late == ONSET + 100
    walker.advance(END + 1)
    stamps = (ONSET + 100, ONSET + 101, ONSET + 150, ONSET + 151, END, END + 1)
    assert delivered(walker, *stamps) == [0, 7, 7, 8, 8, 0]
    assert walker.extend_torque(Side.RIGHT, [END + 1], [1.0], END + 2) == 1


def test_a_promise_that_is_over_when_it_arrives_changes_nothing():
    walker = Walker(TABLE_1)
    walker.advance(END)
    assert walker.extend_torque(Side.RIGHT, [0], [50.0], ONSET) == ONSET
    walker.advance(3 * SECOND)
    assert delivered(walker, END, END + 1) == [0, 0]


def test_stop_voids_the_promises_of_both_ankles():
    walker = Walker(TABLE_1)
    for side in Side:
        walker.extend_torque(side, [0, ONSET, END], [1.0, 9.0, 2.0], 3 * SECOND)
    walker.advance(ONSET)
    walker.cut_torque(ONSET + 1000)
    assert walker.valid_until == ONSET + 1000
    walker.advance(2 * SECOND)
    s = walker.sample(np.array([ONSET, ONSET + 1, ONSET + 1000, ONSET + 1001, END + 1]))
    assert s.delivered_torque.tolist() == [[1, 1], [9, 9], [9, 9], [0, 0], [0, 0]]
    # After the stop, torque can be promised again.
    assert walker.extend_torque(Side.LEFT, [2 * SECOND], [3.0], 3 * SECOND) == pytest.approx(
        SECOND - 1000
    )


def test_stop_does_not_change_what_has_been_walked():
    walker = Walker(TABLE_1)
    walker.extend_torque(Side.RIGHT, [0], [4.0], 3 * SECOND)
    walker.advance(SECOND)
    walker.cut_torque(10)
    walker.advance(2 * SECOND)
    assert delivered(walker, SECOND, SECOND + 1) == [4, 0]


@pytest.mark.parametrize(
    ("times", "torques", "until", "message"),
    [
        ([200, 300], [1.0], 400, "one each"),
        ([300, 200], [1.0, 2.0], 400, "not increasing"),
        ([200, 400], [1.0, 2.0], 400, "not increasing"),
        ([50], [1.0], 400, "contradicts the promise up to 100 ns"),
        ([200], [float("nan")], 400, "not all finite"),
        ([], [], 50, "before the promise"),
    ],
)
def test_promises_that_make_no_sense_are_refused(times, torques, until, message):
    walker = Walker(TABLE_1)
    walker.extend_torque(Side.RIGHT, [], [], 100)
    with pytest.raises(ValueError, match=message):
        walker.extend_torque(Side.RIGHT, times, torques, until)


def test_a_long_run_keeps_only_what_it_needs():
    walker = Walker(TABLE_1)
    for n in range(400):
        begin = n * SECOND // 4
        walker.extend_torque(Side.RIGHT, [begin], [float(n % 3)], begin + SECOND // 4)
        walker.advance(begin + SECOND // 4)
    assert walker._log.size <= 64
    assert len(walker._promises[Side.RIGHT].arrays()[0]) < 20
