# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How well detected events agree with a reference."""

import bisect
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

# An event further from the reference than this is another one [s].
TOLERANCE = 0.1


@dataclass(frozen=True)
class Score:
    """Detected events of one kind beside a reference."""

    reference: int  # events in the reference
    found: int  # of those, the ones that were detected
    false: int  # detected between the first and the last of the reference, and not in it
    errors: tuple[float, ...]  # detected minus reference [s]

    @property
    def missed(self) -> int:
        """Events of the reference that were not detected."""
        return self.reference - self.found

    @property
    def bias(self) -> float:
        """Mean error [s]; NaN without events."""
        return statistics.fmean(self.errors) if self.errors else float("nan")

    @property
    def median_size(self) -> float:
        """Median of the sizes of the errors [s]; NaN without events."""
        sizes = [abs(error) for error in self.errors]
        return statistics.median(sizes) if sizes else float("nan")

    @property
    def deviation(self) -> float:
        """Standard deviation of the errors [s]; NaN with fewer than two events."""
        return statistics.stdev(self.errors) if len(self.errors) > 1 else float("nan")


def score(
    sides: Iterable[tuple[Sequence[float], Sequence[float]]], tolerance: float = TOLERANCE
) -> Score:
    """
    Hold detected events against a reference: pairs (reference, detected) of times [s], one a foot.

    Each event of the reference takes the nearest detected one within the tolerance, if no other
    has it. Nothing is said of what was detected before or after the reference.
    """
    total, false, errors = 0, 0, list[float]()
    for reference, detected in sides:
        times, taken = sorted(detected), set[int]()
        total += len(reference)
        for instant in sorted(reference):
            place = bisect.bisect_left(times, instant)
            near = [i for i in (place - 1, place) if 0 <= i < len(times) and i not in taken]
            best = min(near, key=lambda i: abs(times[i] - instant), default=None)
            if best is not None and abs(times[best] - instant) <= tolerance:
                taken.add(best)
                errors.append(times[best] - instant)
        if reference:
            first, last = min(reference) - tolerance, max(reference) + tolerance
            inside = [i for i, t in enumerate(times) if first <= t <= last]
            false += sum(i not in taken for i in inside)
    return Score(total, len(errors), false, tuple(errors))
