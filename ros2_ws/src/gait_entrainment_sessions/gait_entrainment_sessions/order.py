# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The order of blocks: as written, permuted at random, or balanced across persons."""

from numpy.random import default_rng

from gait_entrainment.errors import UsageError

ORDERS = ("written", "permuted", "balanced")


def williams(count: int) -> list[list[int]]:
    """
    Return the rows of a Williams design (Aust. J. Sci. Res. A 2, 149, 1949) of so many treatments.

    Each treatment stands once in each row and as often in each place; each follows each other one
    equally often. An even number takes as many rows, an odd one twice as many.
    """
    # 0, 1, n - 1, 2, n - 2, ...: neighbours differ by each amount once.
    first = [0, *((k + 1) // 2 if k % 2 else count - k // 2 for k in range(1, count))]
    rows = [[(one + shift) % count for one in first] for shift in range(count)]
    return rows + [row[::-1] for row in rows] if count % 2 and count > 1 else rows


def block_order(kind: str, count: int, *, seed: int, person: int, session: str) -> list[int]:
    """
    Return in which order so many blocks come, as places in the file from 0.

    Balanced, persons 1, 2, ... take one row of a Williams design after the other, whose treatments
    the ``seed`` deals out; permuted, each person and session has an order of its own.
    """
    if kind == "balanced":
        dealt = default_rng(seed).permutation(count)
        rows = williams(count)
        return [int(dealt[one]) for one in rows[(person - 1) % len(rows)]]
    if kind == "permuted":
        own = (seed, person, *session.encode())
        return [int(one) for one in default_rng(own).permutation(count)]
    if kind == "written":
        return list(range(count))
    raise UsageError(f"order: {kind!r}; allowed: {', '.join(ORDERS)}")
