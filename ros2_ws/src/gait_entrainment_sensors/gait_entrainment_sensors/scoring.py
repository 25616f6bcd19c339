# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How well detected events agree with a reference."""

import statistics
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

# Events further apart than this do not match [s].
TOLERANCE = 0.1


@dataclass(frozen=True)
class Score:
    """Detected events of one kind compared with a reference."""

    events: int  # in the reference
    found: int  # of those, the detected ones
    missed: int
    false: int  # detected between the first and the last of the reference, but not in it
    bias: float | None  # mean error [s]; None without one
    deviation: float | None  # standard deviation of the errors [s]; None with fewer than two
    errors: tuple[float, ...]  # detected minus reference [s]


def score(
    feet: Iterable[tuple[Sequence[float], Sequence[float]]], tolerance: float = TOLERANCE
) -> Score:
    """
    Compare detected events with a reference: pairs (reference, detected) of times [s] per foot.

    Each event of the reference is matched with the nearest detected one within the tolerance that
    is not matched yet. Events detected before or after the reference do not count.
    """
    events, false, errors = 0, 0, list[float]()
    for reference, detected in feet:
        times, taken = sorted(detected), set[int]()
        events += len(reference)
        for time in sorted(reference):
            place = bisect_left(times, time)
            near = [i for i in (place - 1, place) if 0 <= i < len(times) and i not in taken]
            best = min(near, key=lambda i: abs(times[i] - time), default=None)
            if best is not None and abs(times[best] - time) <= tolerance:
                taken.add(best)
                errors.append(times[best] - time)
        if reference:
            first, last = min(reference) - tolerance, max(reference) + tolerance
            false += sum(first <= t <= last and i not in taken for i, t in enumerate(times))
    bias = statistics.fmean(errors) if errors else None
    deviation = statistics.stdev(errors) if len(errors) > 1 else None
    found = len(errors)
    return Score(events, found, events - found, false, bias, deviation, tuple(errors))
