# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope on the shank."""

from collections import deque
from dataclasses import dataclass
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, DetectorSettings
from gait_entrainment_sensors.gyroscope import GyroscopeDetector, GyroscopeSettings

# Share of a peak below which the rate has certainly passed it.
_PAST = 0.75
# Longest time from the push-off peak to the swing [s].
_PUSH_OFF = 0.3


@dataclass(frozen=True)
class ShankGyroscopeSettings(GyroscopeSettings):
    """Settings of the detector."""

    decision: float = setting(0.1, "longest time from toe-off to swing", "s", (0.03, 0.3))
    strike_decision: float = setting(0.03, "time from zero crossing to peak", "s", (5e-3, 0.1))


class ShankGyroscopeDetector(GyroscopeDetector):
    """
    Events from the sagittal rate of the shank.

    The shank leans forward through stance, fastest at push-off, and swings back to a peak at
    mid-swing (Aminian et al., J. Biomech. 35, 2002; Catalfamo et al., Sensors 10, 2010). Push-off
    is a plateau that toe-off ends: toe-off is taken when the rate has fallen to three quarters of
    its peak. Heel strike lies between the zero crossing after swing and the forward peak after
    that: it is taken when the rate has risen to half of that peak or, without a peak, of the
    highest rate in ``strike_decision``.

    Latency: the filter delay plus ``decision``, for toe-off, which the zero crossing decides.
    Uncertainty: published errors are up to 25 ms for strikes and 75 ms for toe-offs (Catalfamo
    2010), taken as twice the standard deviation; no licensed record with a reference was found to
    measure it here.
    Fails: no toe-off if the fall begins more than ``decision`` before the swing, as with a stiff
    knee or in very slow walking.
    """

    name = "shank_gyroscope"
    Settings: ClassVar[type[DetectorSettings]] = ShankGyroscopeSettings
    uncertainty = (0.0125, 0.0375)
    foot = False

    def __init__(self, side: Side, settings: Any = None) -> None:
        self._latest: deque[tuple[float, float]] = deque()  # forward rates, times: around a swing
        super().__init__(side, settings)

    def _enter(self, *, swinging: bool, time: float) -> None:
        super()._enter(swinging=swinging, time=time)
        self._latest.clear()

    def _stance(self, time: float, before: float, rate: float) -> list[Detection]:
        latest = self._latest
        if rate < -self._swings.threshold:
            self._enter(swinging=True, time=time)
            return []
        if rate >= 0.0 or before >= 0.0:
            latest.append((rate, time - self._delay))
            if latest[0][1] < latest[-1][1] - _PUSH_OFF:
                latest.popleft()
        return self._leave(time) if rate < 0.0 <= before else []

    def _leave(self, time: float) -> list[Detection]:
        """Find toe-off at the zero crossing to swing: it is where the rate finally fell."""
        latest = [*self._latest]
        self._latest.clear()
        peak, _ = max(latest)
        if peak < self.settings.least_peak or time - self._changed < self.settings.shortest_stance:
            return []
        fallen = max(i for i, (rate, _) in enumerate(latest, 1) if rate >= _PAST * peak)
        toe_off = _when(latest[fallen - 1], latest[fallen], _PAST * peak)
        if time - toe_off > self.latency:  # the knee did not bend
            return []
        return self._found(EventKind.TOE_OFF, toe_off, time)

    def _swing(self, time: float, before: float, rate: float) -> list[Detection]:
        latest = self._latest
        if rate < 0.0:
            self._peak = max(self._peak, -rate)
            latest.clear()
            return []
        if not latest:
            latest.append((before, self._before - self._delay))
        latest.append((rate, time - self._delay))
        forward, _ = max(latest)
        crossed = _when(latest[0], latest[1], 0.0)
        past = forward >= self.settings.least_peak and rate < _PAST * forward
        certain = past or time - crossed >= self.settings.strike_decision
        if not certain or time - self._changed < self.settings.shortest_swing:
            return []
        risen = next(i for i, (reached, _) in enumerate(latest) if reached >= 0.5 * forward)
        strike = _when(latest[risen - 1], latest[risen], 0.5 * forward)
        return self._land(strike, time)


def _when(before: tuple[float, float], after: tuple[float, float], level: float) -> float:
    """Return when [s] the rate passed a level between two samples (rate, time)."""
    share = (level - before[0]) / (after[0] - before[0])
    return before[1] + share * (after[1] - before[1])
