# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How late messages were sent in real time: a histogram that does not grow with the run."""

import math

# Bins per factor of ten: neighbours differ by 6 %, finer than lateness is repeatable.
BINS_PER_DECADE = 40
# Below a microsecond everything counts as on time, above 100 s as equally late [s].
SHORTEST, LONGEST = 1e-6, 100.0


class Lateness:
    """Counts how late messages were [s]; quantiles are upper bin edges."""

    def __init__(self) -> None:
        self.count = 0
        self.worst = 0.0  # [s]
        decades = math.log10(LONGEST / SHORTEST)
        self._bins = [0] * (round(decades * BINS_PER_DECADE) + 1)

    def add(self, late: float) -> None:
        """Count one message that was published ``late`` [s] after it was due."""
        late = min(max(late, SHORTEST), LONGEST)
        self._bins[math.ceil(math.log10(late / SHORTEST) * BINS_PER_DECADE)] += 1
        self.count += 1
        self.worst = max(self.worst, late)

    def quantile(self, fraction: float) -> float:
        """Return the lateness [s] that ``fraction`` of messages did not exceed; NaN if none."""
        passed = 0
        for number, messages in enumerate(self._bins):
            passed += messages
            if messages and passed >= fraction * self.count:
                return float(min(SHORTEST * 10 ** (number / BINS_PER_DECADE), self.worst))
        return math.nan
