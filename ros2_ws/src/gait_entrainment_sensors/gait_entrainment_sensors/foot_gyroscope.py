# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope on the foot or the shoe."""

import math
from typing import Any

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import Detection
from gait_entrainment_sensors.gyroscope import GyroscopeDetector, Peaks

# Rate that has certainly left zero [rad/s]: 14 deg/s, three times the offset that a consumer
# gyroscope may have.
_LEFT_ZERO = 0.25
# Rate at which a foot that came down on the heel is slapping flat [rad/s].
_SLAPPING = 1.0
# Shares of the push-off peak below which the rate is certainly falling; will not rise again.
_FALLING = 0.75
_FALLEN = 0.5


class FootGyroscopeDetector(GyroscopeDetector):
    """
    Events from the sagittal rate of the foot.

    The foot lies flat, turns toes down to a peak at push-off, swings back toes up, and turns down
    again as it slaps flat (Sabatini, IEEE Trans. Biomed. Eng. 52, 217, 2005; Kotiadis et al., Gait
    Posture 32, 2010; Mariani et al., IEEE Trans. Biomed. Eng. 60, 2013). Toe-off lies between the
    peak, a plateau of several tens of milliseconds, and the zero crossing after it. It is taken
    when the rate has fallen to three quarters of the peak, the start of the fall. Heel strike is
    when the rate leaves zero after swing or, if the foot lands flat, when it comes to rest.

    Latency: the filter delay plus ``decision``; events that take longer are not reported.
    Uncertainty: 6 ms each, measured against motion capture (docs/sensors.md).
    Fails: on steps whose swing turns the foot at less than half of the usual rate (turning on the
    spot, shuffling); if the foot is flat throughout (no push-off, so no toe-off).
    """

    name = "foot_gyroscope"
    uncertainty = (0.006, 0.006)
    foot = tells_sides = True

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._pushes = Peaks(self.settings.least_peak, self.settings.peak_share)

    def _enter(self, *, swinging: bool, time: float) -> None:
        super()._enter(swinging=swinging, time=time)
        self._fall = math.nan  # when the rate fell from the peak of push-off [s]
        self._rest = self._turn = math.nan  # when it came to zero, and left it [s]
        self._slaps = False

    def _stance(self, time: float, before: float, rate: float) -> list[Detection]:
        found: list[Detection] = []
        if self._slaps:  # until it lies flat
            self._peak = max(rate, self._peak)
            self._slaps = rate > _FALLEN * self._peak
            if not self._slaps:
                self._peak = 0.0
        elif time - self._changed >= self.settings.shortest_stance:
            found = self._push_off(time, before, rate)
        if not self._swinging and rate < -self._swings.threshold:  # its toe-off was not seen
            self._enter(swinging=True, time=time)
        return found

    def _push_off(self, time: float, before: float, rate: float) -> list[Detection]:
        """Follow the rate over its peak; the fall after that ends the stance."""
        level = _FALLING * self._peak
        if rate > self._peak:
            self._peak, self._fall = rate, math.nan
        elif rate > level:
            self._fall = math.nan
        elif before > level:
            self._fall = self._crossing(before, rate, level)
        if rate >= _FALLEN * self._peak:
            return []
        fall, peak = self._fall, self._peak
        self._peak, self._fall = 0.0, math.nan
        if not self._pushes.is_step(peak):
            return []
        self._enter(swinging=True, time=time)
        return self._found(EventKind.TOE_OFF, fall, time)

    def _swing(self, time: float, before: float, rate: float) -> list[Detection]:
        if rate < -_LEFT_ZERO:
            self._rest = self._turn = math.nan
            if -rate > self._peak:
                self._peak = -rate
            return []
        if self._peak < self.settings.least_peak:
            # Not swinging yet; or never, as when the heel was only lifted.
            if time - self._changed > 1.0:
                self._enter(swinging=False, time=time)
            return []
        if self._rest != self._rest:
            self._rest = self._crossing(before, rate, -_LEFT_ZERO)
        if rate <= 0.0:
            self._turn = math.nan
        elif before <= 0.0:
            self._turn = self._crossing(before, rate, 0.0)
        if before <= _LEFT_ZERO < rate:
            self._turn = self._crossing(before, rate, _LEFT_ZERO)
        turned = self._turn == self._turn
        certain = (turned and rate > _SLAPPING) or time - self._rest >= self.settings.decision
        if not certain or time - self._changed < self.settings.shortest_swing:
            return []
        found = self._land(self._turn if turned else self._rest, time)
        self._slaps = turned
        return found
