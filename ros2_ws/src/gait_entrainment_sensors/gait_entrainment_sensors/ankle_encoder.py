# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The ankle angle from the robot's encoder: the fallback if there is no other sensor."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, Detector, DetectorSettings, OwnMedian


@dataclass(frozen=True)
class AnkleEncoderSettings(DetectorSettings):
    """Settings of the detector."""

    least_range: float = setting(0.1, "least change from peak to peak", "rad", (0.01, 1.0))
    strike_share: float = setting(
        0.38, "strides from the plantarflexion peak to heel strike", "1", (0.0, 0.9)
    )
    decision: float = setting(0.15, "longest time that a pulse may hide the peak", "s", (0.0, 0.5))
    blank_torque: float = setting(1.0, "torque above which the angle is not read", "N m", (0, 30))


class AnkleEncoderDetector(Detector):
    """
    Heel strikes, roughly, from the ankle angle, plantarflexion positive: a fallback.

    Once per stride, just after toe-off, plantarflexion peaks. The heel strike is placed a fixed
    share of the own median stride later: stance is 62 % of the stride in walking (Perry and
    Burnfield, Gait Analysis, 2010). So the stride *period* can be followed, but no more: the
    strikes have a bias of a few percent of the stride that differs between people, and there are
    no toe-offs, since the lag of a pulse must not rest on an assumed share. Pulses move this very
    angle; it is not read while the robot delivers more than ``blank_torque``.

    Latency: ``decision``: a strike is predicted, and reported at its time; but while a pulse hides
    the peak, nothing can be predicted.
    Uncertainty: 50 ms.
    Fails: pulses near toe-off hide or shift the peak, so with pulses even the period is doubtful.
    """

    name = "ankle_encoder"
    signals: ClassVar[tuple[str, ...]] = ("angle", "torque")
    Settings: ClassVar[type[DetectorSettings]] = AnkleEncoderSettings
    impossible = 200.0  # includes the magnitude of the torque
    uncertainty = (0.05, math.nan)
    lacks = (
        "a fallback: no toe-offs, and heel strikes to some 50 ms, from an angle that pulses move: "
        "phase lags count from these, and no entrainment verdict can rest on them"
    )

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._period, self._range = OwnMedian(), OwnMedian()
        self._rise = OwnMedian()  # from trough to peak, in strides
        self._restart()

    @property
    def latency(self) -> float:
        """Longest time that a pulse may hide the peak."""
        return float(self.settings.decision)

    def _restart(self) -> None:
        self._rising = True
        self._extreme, self._at = math.nan, math.nan  # [rad], [s]
        self._trough, self._trough_at = math.nan, math.nan
        self._peak = math.nan  # time of the latest [s]
        self._strike = math.nan  # predicted [s]

    def troubles(self, now: float | None = None) -> tuple[str, ...]:
        """Add that this is the fallback, and whether the angle's sign seems to be reversed."""
        where = f"{self.side.name.lower()} {self.name}"
        lines = [*super().troubles(now), f"{where}: {self.lacks}"]
        if self._rise.value > 0.6:  # push-off lasts a sixth of a stride (Perry and Burnfield)
            lines.append(
                f"{where}: the angle rises slowly and falls fast: plantarflexion must be positive"
            )
        return tuple(lines)

    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        found: list[Detection] = []
        if time >= self._strike:
            found = self._found(EventKind.HEEL_STRIKE, self._strike, time)
            self._strike = math.nan
        angle, torque = values
        self.counts.unlikely += abs(angle) > 2.0
        if abs(torque) > self.settings.blank_torque:
            return found
        extreme = self._extreme
        if extreme != extreme or (angle > extreme) == self._rising:
            self._extreme, self._at = angle, time
            return found
        if abs(angle - extreme) < max(self.settings.least_range, 0.5 * self._range.value):
            return found
        if self._rising:
            self._take_peak(extreme, self._at)
        else:
            self._trough, self._trough_at = extreme, self._at
        self._rising = not self._rising
        self._extreme, self._at = angle, time
        return found

    def _take_peak(self, angle: float, at: float) -> None:
        """Process a peak of plantarflexion; predict the strike after it."""
        if angle - self._trough >= self.settings.least_range:
            self._range.add(angle - self._trough)
        period = at - self._peak
        self._peak = at
        if 0.3 <= period <= 5.0:
            self._period.add(period)
            self._rise.add((at - self._trough_at) / period)
            self._strike = at + self.settings.strike_share * self._period.value
