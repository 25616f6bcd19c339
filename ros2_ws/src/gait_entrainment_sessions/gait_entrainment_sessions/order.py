# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The order of blocks: as written, permuted at random, or balanced across persons."""

from numpy.random import default_rng

from gait_entrainment.errors import UsageError

ORDERS = ("written", "permuted", "balanced")


def williams(count: int) -> list[list[int]]:
    """
    Return the rows of a Williams design (Aust. J. Sci. Res. A 2, 149, 1949).

    Each of the ``count`` treatments appears once in each row and equally often in each place, and
    follows every other one equally often. There are ``count`` rows, twice as many if it is odd.
    """
    # 0, 1, n - 1, 2, n - 2, ...: neighbours differ by each amount once.
    first = [0, *((k + 1) // 2 if k % 2 else count - k // 2 for k in range(1, count))]
    rows = [[(treatment + shift) % count for treatment in first] for shift in range(count)]
    return rows + [row[::-1] for row in rows] if count % 2 and count > 1 else rows


def block_order(kind: str, count: int, *, seed: int, person: int, session: str) -> list[int]:
    """
    Return the order of ``count`` blocks, as indices into the file.

    "balanced" gives persons 1, 2, ... the rows of a Williams design in turn, with treatments
    assigned by the ``seed``; "permuted" gives each person and session an independent order.
    """
    if kind == "balanced":
        dealt = default_rng(seed).permutation(count)
        rows = williams(count)
        return [int(dealt[treatment]) for treatment in rows[(person - 1) % len(rows)]]
    if kind == "permuted":
        own = (seed, person, *session.encode())
        return [int(place) for place in default_rng(own).permutation(count)]
    if kind == "written":
        return list(range(count))
    raise UsageError(f"order: {kind!r}; allowed: {', '.join(ORDERS)}")
