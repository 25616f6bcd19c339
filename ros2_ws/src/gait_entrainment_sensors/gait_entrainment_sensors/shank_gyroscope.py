# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope on the shank."""

import math
from typing import Any

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import Detection
from gait_entrainment_sensors.gyroscope import GyroscopeDetector

# Share of a peak below which the rate is past it for certain.
_PAST = 0.75


class ShankGyroscopeDetector(GyroscopeDetector):
    """
    Events from the sagittal rate of the shank.

    The shank leans forward through stance, fastest at push-off, and swings back to a peak at
    mid-swing. Toe-off is the forward peak before the swing, heel strike the first one after it,
    the rate having crossed zero (Aminian et al., J. Biomech. 35, 2002; Catalfamo et al., Sensors
    10, 2010). A forward peak is certain once the rate has fallen to three quarters of it.

    Latency: the delay of the filter and ``decision``; a heel strike without a peak in that time
    after the zero crossing is put at the highest rate in it.
    Uncertainty: published errors are up to 25 ms for strikes and 75 ms for toe-offs (Catalfamo
    2010), taken as twice the standard deviation; no licensed record with a reference was found to
    measure it here.
    Fails: where the knee stays stiff (no peaks: as on the simulated walker, whose toe-offs it
    finds late); on slow walking, where the forward peak of push-off is flat.
    """

    name = "shank_gyroscope"
    uncertainty = (0.0125, 0.0375)
    foot = False

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._crossed = math.nan

    def _restart(self) -> None:
        super()._restart()
        self._peak, self._at = 0.0, math.nan  # forward in stance, backward in swing [rad/s], [s]
        self._crossed = math.nan  # when the rate crossed zero after swing [s]

    def _stance(self, time: float, before: float, rate: float) -> list[Detection]:
        if rate < -self._swings.threshold:
            self._enter(swinging=True, time=time)
            self._peak, self._crossed = 0.0, math.nan
            return []
        if time - self._changed < self.settings.shortest_stance:
            return []
        if rate > self._peak:
            self._peak, self._at = rate, time - self._delay
        elif self._peak >= self.settings.least_peak and rate < _PAST * self._peak:
            at, self._peak = self._at, math.inf  # one toe-off a stance
            return self._found(EventKind.TOE_OFF, at, time)
        return []

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
        certain = past or time - self._crossed >= self.settings.decision
        if not certain or time - self._changed < self.settings.shortest_swing:
            return []
        peak = self._peak
        self._enter(swinging=False, time=time)
        self._peak = 0.0
        if not self._swings.add(peak):
            self.counts.rejected += 1
            return []
        return self._found(EventKind.HEEL_STRIKE, self._at, time)
