# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What the gyroscope detectors for foot and shank share: mounting, filter, and the swing.

Rates are positive when the toes turn down and the shank leans forward, so negative in swing.
"""

import math
from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, Detector, DetectorSettings, OwnMedian
from gait_entrainment_sensors.mounting import Mounting, find_mounting, usual_mounting

# Lean of the swing axis above which the toes turn in [rad]: 9 degrees.
_TOES_IN = 0.15
# Time constant of one of two poles with -3 dB at one hertz [s].
_TWO_POLES = math.sqrt(math.sqrt(2) - 1) / (2 * math.pi)


@dataclass(frozen=True)
class GyroscopeSettings(DetectorSettings):
    """Settings of a gyroscope detector."""

    axis_x: float = setting(0.0, "axis about which the toes turn down, x", "1", (-1.0, 1.0))
    axis_y: float = setting(0.0, "the same, y; all zero: found in the first steps", "1", (-1, 1))
    axis_z: float = setting(0.0, "the same, z", "1", (-1.0, 1.0))
    calibration: float = setting(5.0, "time for finding or checking the axis", "s", (2, 60))
    cutoff: float = setting(30.0, "cutoff frequency of the filter", "Hz", (5.0, 200.0))
    least_peak: float = setting(1.0, "least peak of a swing, and of a push-off", "rad/s", (0, 10))
    peak_share: float = setting(0.5, "least peak / own median peak", "1", (0.0, 0.9))
    shortest_swing: float = setting(0.15, "shortest swing", "s", (0.01, 1.0))
    shortest_stance: float = setting(0.25, "shortest stance", "s", (0.01, 1.0))
    decision: float = setting(0.03, "longest time to decide an event", "s", (5e-3, 0.2))

    @property
    def axis(self) -> tuple[float, float, float] | None:
        """The axis, of unit length; None if it is to be found."""
        length = math.hypot(self.axis_x, self.axis_y, self.axis_z)
        if length == 0.0:
            return None
        return self.axis_x / length, self.axis_y / length, self.axis_z / length


class Peaks(OwnMedian):
    """Peaks of the person's own steps, and the threshold that follows from them."""

    def __init__(self, least: float, share: float) -> None:
        super().__init__()
        self._least, self._share = least, share

    @property
    def threshold(self) -> float:
        """The value that a step's peak exceeds."""
        return max(self._least, self._share * self.value)

    def is_step(self, peak: float) -> bool:
        """Add a peak; return whether it is a step's. One that is not also moves the median."""
        step = peak >= self.threshold
        if peak >= self._least:
            self.add(peak)
        return step


class GyroscopeDetector(Detector):
    """
    The rate about one axis, filtered, and whether the leg stands or swings.

    The filter has two equal poles, with a coefficient for each interval between samples, so
    irregular sampling does no harm; its delay is subtracted from each event. A derived class
    defines which features of the rate are the events.
    """

    signals: ClassVar[tuple[str, ...]] = ("gyro_x", "gyro_y", "gyro_z")
    Settings: ClassVar[type[DetectorSettings]] = GyroscopeSettings
    moving = 1.0
    impossible = 100.0  # rad/s, summed over three axes: twice what a kick reaches
    reached = 1.0
    suspicion = "angular velocities in rad/s are expected, not in degrees per second"
    foot: ClassVar[bool]  # on the foot, not on the shank

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._mountings: deque[Mounting] = deque(maxlen=2)  # found in the latest steps
        self._recorded: list[tuple[float, Sequence[float]]] = []
        self._searched = -math.inf  # when they were last searched [s]
        self._axis = self.settings.axis
        self._pole = _TWO_POLES / self.settings.cutoff
        self._interval = self._keep = math.nan
        self._delay = 0.0
        self._swings = Peaks(self.settings.least_peak, self.settings.peak_share)
        self._restart()

    @classmethod
    def calibrated(cls, settings: Any, walk: Sequence[Any]) -> Any:
        """Return settings with the axis found in a recorded walk, unless they give one."""
        if settings.axis is not None:
            return settings
        found = usual_mounting(walk, settings.calibration, foot=cls.foot)
        axis = found.axis if found else (0.0, 0.0, 0.0)
        return replace(settings, axis_x=axis[0], axis_y=axis[1], axis_z=axis[2])

    @property
    def latency(self) -> float:
        """The filter delay plus the time to decide an event."""
        return float(2 * self._pole + self.settings.decision)

    def _restart(self) -> None:
        self._first_pole = self._rate = math.nan
        self._enter(swinging=False, time=self._time)

    def troubles(self, now: float | None = None) -> tuple[str, ...]:
        """Add what the calibration found."""
        lines = super().troubles(now)
        where = f"{self.side.name.lower()} {self.name}"
        axis, found = self._axis, self._mountings
        if axis is None:
            return (*lines, f"{where}: the axis is not known yet: walk straight ahead")
        if not found:
            return lines
        if self.foot and axis[1] > 0.9 and all(m.toes_out(self.side) < -_TOES_IN for m in found):
            lines = (*lines, f"{where}: if x points forward, the toes turn in: sensors swapped?")
        agreement = max(sum(a * b for a, b in zip(m.axis, axis, strict=True)) for m in found)
        if agreement < -0.5:
            return (*lines, f"{where}: mounted the other way round: set {found[-1].text}")
        if agreement < 0.7:
            return (*lines, f"{where}: turns about another axis: set {found[-1].text}")
        return lines

    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        self._calibrate(time, values)
        axis = self._axis
        if axis is None:
            return []
        rate = axis[0] * values[0] + axis[1] * values[1] + axis[2] * values[2]
        if rate == 0.0 and not any(values) and abs(self._value) > self.moving:  # a lost sample
            self.counts.lost += 1
            rate, self._value = self._value, 0.0
        else:
            self._watch(time, rate)
        interval = time - self._before
        if interval != self._interval:
            self._interval = interval
            keep = self._keep = math.exp(-interval / self._pole)
            self._delay = 2 * interval * keep / (1 - keep) if interval > 0.0 else 0.0
        before = self._rate
        if before != before:
            self._first_pole = self._rate = rate
            return []
        self._first_pole = first = rate + self._keep * (self._first_pole - rate)
        self._rate = filtered = first + self._keep * (before - first)
        if self._swinging:
            return self._swing(time, before, filtered)
        return self._stance(time, before, filtered)

    def _calibrate(self, time: float, values: Sequence[float]) -> None:
        """Record some steps, find the axis in the first, and check it against later ones."""
        recorded, longest = self._recorded, self.settings.calibration
        if recorded and time <= recorded[-1][0]:  # the clock has jumped
            recorded.clear()
        if not recorded:
            self._searched = time
        recorded.append((time, tuple(values)))
        if time - self._searched < longest:
            return
        latest = [sample for sample in recorded if time - sample[0] <= longest]
        found = find_mounting(latest, foot=self.foot)
        if self._axis is None:  # slow strides are few in that time
            found = found or find_mounting(recorded, foot=self.foot)
            self._axis = found.axis if found else None
        if found:
            self._mountings.append(found)
        self._recorded = [sample for sample in recorded if time - sample[0] <= 2 * longest]
        # Until the axis is known, search again soon.
        self._searched = time - (0.8 * longest if self._axis is None else 0.0)

    def _crossing(self, before: float, rate: float, level: float) -> float:
        """Return when the rate crossed a level between two samples, minus the filter delay."""
        return self._passed(level, before, rate) - self._delay

    def _enter(self, *, swinging: bool, time: float) -> None:
        """Start a stance or a swing."""
        self._swinging, self._changed = swinging, time
        self._peak = 0.0  # of push-off; of a swing, its magnitude [rad/s]

    def _land(self, strike: float, time: float) -> list[Detection]:
        """End a swing; return the strike if it was a step's."""
        peak = self._peak
        self._enter(swinging=False, time=time)
        if self._swings.is_step(peak):
            return self._found(EventKind.HEEL_STRIKE, strike, time)
        self.counts.rejected += 1
        return []

    @abstractmethod
    def _stance(self, time: float, before: float, rate: float) -> list[Detection]:
        """Process the rate in stance, which toe-off ends."""

    @abstractmethod
    def _swing(self, time: float, before: float, rate: float) -> list[Detection]:
        """Process the rate in swing, which heel strike ends."""
