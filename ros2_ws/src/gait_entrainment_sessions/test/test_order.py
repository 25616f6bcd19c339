# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Block orders: balanced like a Williams design, the same for the same seed."""

from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gait_entrainment.errors import UsageError
from gait_entrainment_sessions.order import block_order, williams


def orders(kind, count, persons, seed=3):
    return [
        block_order(kind, count, seed=seed, person=person, session="1")
        for person in range(1, persons + 1)
    ]


@pytest.mark.parametrize("count", range(1, 10))
def test_each_block_has_each_place_and_follows_each_other_block_equally_often(count):
    rows = williams(count)
    assert len(rows) == (count if count % 2 == 0 or count == 1 else 2 * count)
    assert all(sorted(row) == list(range(count)) for row in rows)
    places = Counter((place, block) for row in rows for place, block in enumerate(row))
    assert len(places) == count**2
    assert len(set(places.values())) == 1
    pairs = Counter(pair for row in rows for pair in pairwise(row))
    assert len(pairs) == count * (count - 1)
    assert len(set(pairs.values())) <= 1


def test_persons_take_the_rows_in_turn():
    found = orders("balanced", 4, 8)
    assert len({tuple(row) for row in found[:4]}) == 4
    assert found[4:] == found[:4]
    assert {row[0] for row in found[:4]} == {0, 1, 2, 3}


@given(st.integers(1, 12), st.integers(1, 50), st.integers(0, 2**63 - 1))
def test_a_permutation_is_the_same_for_the_same_seed_person_and_session(count, person, seed):
    given_twice = [
        block_order("permuted", count, seed=seed, person=person, session="a") for _ in range(2)
    ]
    assert given_twice[0] == given_twice[1]
    assert sorted(given_twice[0]) == list(range(count))


def test_persons_and_seeds_get_different_orders():
    assert len({tuple(row) for row in orders("permuted", 6, 20)}) > 15
    assert orders("permuted", 6, 20, seed=4) != orders("permuted", 6, 20)
    assert orders("written", 3, 2) == [[0, 1, 2]] * 2
    with pytest.raises(UsageError, match="order: 'best'; allowed: written, permuted, balanced"):
        orders("best", 3, 1)
