# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Which gait events are plausible, and whether the person is walking at all.

A sensor may count twice, miss an event or be knocked, and torque follows from the events accepted
here. The stride tracker checks every event, in a node, in a simulation and in an analysis.
"""

import math
import statistics
from collections import deque
from dataclasses import dataclass, replace

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.settings import Checked, setting, settings_of

# Number of strides in the person's own median: enough that two wrong ones do not move it.
_OWN_STRIDES = 7
# The median is known from this many strides on.
_KNOWN_STRIDES = 3


@dataclass(frozen=True)
class GaitLimits(Checked):
    """
    Limits of plausible strides.

    The absolute bounds are those of slow walking after stroke and of running, with a margin
    (Perry and Burnfield, Gait Analysis, 2010). From stride to stride a healthy adult varies by 1
    to 3 %, patients by up to 10 % (Hausdorff, J. NeuroEng. Rehabil. 2, 19, 2005).
    """

    stride_least: float = setting(0.3, "shortest stride", "s", (1e-6, 1e6))
    stride_most: float = setting(5.0, "longest stride", "s", (1e-6, 1e6))
    stride_change: float = setting(0.4, "change from the person's median", "1", (0.01, 1.0))
    silence: float = setting(1.5, "strides without a strike that end a gait", "1", (1.05, 10.0))
    baseline_spread: float = setting(0.15, "deviation of baseline strides", "1", (0.001, 1.0))

    def scaled(self, factor: float) -> "GaitLimits":
        """Return the limits with their times multiplied, as far as the settings allow."""
        bounds = settings_of(type(self))
        times = {
            name: min(max(getattr(self, name) * factor, bounds[name].least), bounds[name].most)
            for name in ("stride_least", "stride_most")
        }
        return replace(self, **times)


class GaitWatch:
    """Tracks the strides of a person's leg: which are plausible, and when the gait has stopped."""

    def __init__(self, side: Side, limits: GaitLimits) -> None:
        self.side, self.limits = side, limits
        self._latest: int | None = None  # the latest accepted heel strike of the leg [ns]
        self._own: deque[float] = deque(maxlen=_OWN_STRIDES)  # accepted periods [s]

    @property
    def median(self) -> float:
        """The person's own stride period [s]; NaN before it is known."""
        return statistics.median(self._own) if len(self._own) >= _KNOWN_STRIDES else math.nan

    def believes(self, strides: float, elapsed: int) -> bool:
        """Whether this many strides, not necessarily whole ones, can have taken this long [ns]."""
        limits, median, seconds = self.limits, self.median, elapsed / NANOSECONDS_PER_SECOND
        least, most = limits.stride_least, limits.stride_most
        if not math.isnan(median):
            factor = max(1 - limits.stride_change, 1e-9)
            least, most = max(least, factor * median), min(most, median / factor)
        # Less than a stride is bounded only from above: how its parts are timed is individual.
        return (strides < 1 or least * strides <= seconds) and seconds <= most * max(strides, 1)

    def add(self, strike: int, period: float | None) -> None:
        """Take an accepted heel strike [ns], and the period [s] of the stride that it closes."""
        self._latest = strike
        if period is not None:
            self._own.append(period)

    def stopped(self, now: int, expected: float = math.inf) -> str:
        """Return why the gait has stopped, or ""; the first stride may take ``expected`` [s]."""
        if self._latest is None:
            return ""
        stride = statistics.median(self._own or [min(self.limits.stride_most, expected)])
        silent = (now - self._latest) / NANOSECONDS_PER_SECOND
        if silent <= self.limits.silence * stride:
            return ""
        leg = self.side.name.lower()
        return (
            f"the gait has stopped: no heel strike of the {leg} leg for {silent:.2f} s; allowed: "
            f"{self.limits.silence:g} strides of {stride:.3g} s"
        )
