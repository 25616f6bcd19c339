# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope on the shank."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, DetectorSettings
from gait_entrainment_sensors.gyroscope import GyroscopeDetector, GyroscopeSettings

# Share of a peak below which the rate is past it for certain.
_PAST = 0.75


@dataclass(frozen=True)
class ShankGyroscopeSettings(GyroscopeSettings):
    """What the detector can be told."""

    decision: float = setting(0.1, "longest time from toe-off to swing", "s", (0.03, 0.3))
    strike_decision: float = setting(0.03, "from the zero crossing to the peak", "s", (5e-3, 0.1))


class ShankGyroscopeDetector(GyroscopeDetector):
    """
    Events from the sagittal rate of the shank.

    The shank leans forward through stance, fastest at push-off, and swings back to a peak at
    mid-swing. Toe-off is the forward peak before the zero crossing to swing, heel strike the first
    one after the zero crossing that ends it (Aminian et al., J. Biomech. 35, 2002; Catalfamo et
    al., Sensors 10, 2010).

    Latency: the delay of the filter and ``decision``, for toe-off; a strike is told as soon as the
    rate has fallen to three quarters of the peak, and without a peak put at the highest rate in
    ``strike_decision`` after the zero crossing.
    Uncertainty: published errors are up to 25 ms for strikes and 75 ms for toe-offs (Catalfamo
    2010), taken as twice the standard deviation; no licensed record with a reference was found to
    measure it here.
    Fails: where no forward peak precedes the swing within ``decision``, as with a stiff knee or in
    very slow walking: no toe-off. So none on the simulated walker, whose knee does not bend.
    """

    name = "shank_gyroscope"
    Settings: ClassVar[type[DetectorSettings]] = ShankGyroscopeSettings
    uncertainty = (0.0125, 0.0375)
    foot = False

    def __init__(self, side: Side, settings: Any = None) -> None:
        self._latest: deque[tuple[float, float]] = deque()  # rates of the last moments, times
        super().__init__(side, settings)

    def _restart(self) -> None:
        super()._restart()
        self._latest.clear()
        self._peak = 0.0  # of the swing, its magnitude [rad/s]
        self._forward, self._at = 0.0, math.nan  # the peak after it [rad/s], [s]
        self._crossed = math.nan  # when the rate crossed zero after the swing [s]

    def _stance(self, time: float, before: float, rate: float) -> list[Detection]:
        if rate < -self._swings.threshold:
            self._enter(swinging=True, time=time)
            self._peak, self._crossed = 0.0, math.nan
            return []
        if rate >= 0.0:
            latest = self._latest
            latest.append((rate, time - self._delay))
            if latest[0][1] < latest[-1][1] - self.settings.decision:
                latest.popleft()
        elif before >= 0.0:
            return self._leave(time)
        return []

    def _leave(self, time: float) -> list[Detection]:
        """Look back at the zero crossing to swing: toe-off was the forward peak before it."""
        latest = list(self._latest)
        self._latest.clear()
        peak, at = max(latest, default=(0.0, math.nan))
        if peak < self.settings.least_peak or time - self._changed < self.settings.shortest_stance:
            return []
        if at == latest[0][1]:  # higher before: no peak
            self.counts.rejected += 1
            return []
        return self._found(EventKind.TOE_OFF, at, time)

    def _swing(self, time: float, before: float, rate: float) -> list[Detection]:
        if rate < 0.0:
            self._peak = max(self._peak, -rate)
            self._crossed = math.nan
            return []
        if self._crossed != self._crossed:
            self._crossed = self._crossing(time, before, rate, 0.0)
            self._forward = 0.0
        if rate > self._forward:
            self._forward, self._at = rate, time - self._delay
        past = self._forward >= self.settings.least_peak and rate < _PAST * self._forward
        certain = past or time - self._crossed >= self.settings.strike_decision
        if not certain or time - self._changed < self.settings.shortest_swing:
            return []
        peak, self._peak = self._peak, 0.0
        self._enter(swinging=False, time=time)
        if not self._swings.is_step(peak):
            self.counts.rejected += 1
            return []
        return self._found(EventKind.HEEL_STRIKE, self._at, time)
