# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The vertical force under one foot: force plate, belt of an instrumented treadmill, insole."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, Detector, DetectorSettings, OwnMedian

# Number of steps after which the person's own stances and swings are known.
_KNOWN_STEPS = 3
# Readings of a sensor that is not zeroed, for a foot in the air: highest and lowest [N].
_UNLOADED, _PULLED = 150.0, -100.0


@dataclass(frozen=True)
class VerticalForceSettings(DetectorSettings):
    """Settings of the detector."""

    hysteresis: ClassVar[tuple[str, ...]] = ("toe_off_force", "strike_force")
    sign: float = setting(1.0, "-1 if the foot's force on the ground is measured", "1", (-1, 1))
    strike_force: float = setting(40.0, "force that a foot on the ground exceeds", "N", (1, 500))
    toe_off_force: float = setting(20.0, "force at both events", "N", (0.5, 500.0))
    debounce: float = setting(8e-3, "shortest change that counts", "s", (0.0, 0.05))
    refractory: float = setting(0.1, "time after toe-off without a strike", "s", (0.0, 1.0))
    zeroing_time: float = setting(0.5, "time constant of zeroing in swing", "s", (0.01, 100.0))
    shortest_stance: float = setting(0.15, "shortest stance", "s", (0.01, 1.0))
    longest_stance: float = setting(2.0, "longest stance in walking", "s", (0.2, 10.0))
    least_share: float = setting(0.5, "shortest stance or swing / own median", "1", (0, 1))
    most_share: float = setting(1.4, "longest stance / own median", "1", (1.0, 10.0))


class VerticalForceDetector(Detector):
    """
    Events from the vertical force on one foot, upwards positive.

    A foot is on the ground once the force stays above ``strike_force`` for ``debounce``, and off
    it once the force stays below ``toe_off_force``. Both events are placed where the force crossed
    the lower threshold, interpolated between samples. 20 N is the usual threshold (Tirosh and
    Sparrow, J. Appl. Biomech. 19, 2003), far above the noise of a force plate; a belt vibrates
    more, hence the hysteresis. The zero follows the force in swing, and is reset if a foot that
    seems to stay on the ground is loaded again.

    Steps on the wrong belt: a strike after less than half of the own median swing, and a toe-off
    after a stance that is too short or too long, are taken for the other foot's and rejected.

    Latency: ``debounce``; for heel strike also the time from one threshold to the other, up to
    30 ms for a foot that is put down softly.
    Uncertainty: 3 ms, from a force slope of 10 N/ms and 20 N of doubt about the threshold.
    Fails: belts that are not zeroed within 150 N upwards and 100 N downwards, or both feet on one
    belt throughout, both of which are reported; a foot that scuffs in swing with more than
    ``strike_force``; insoles that are loaded in the air.
    """

    name = "vertical_force"
    signals: ClassVar[tuple[str, ...]] = ("force_z",)
    Settings: ClassVar[type[DetectorSettings]] = VerticalForceSettings
    moving = 100.0
    impossible = 10_000.0
    reached = 100.0
    suspicion = (
        "the ground's force on the foot is expected in N, upwards positive (else set sign=-1), "
        "not in kN or body weights"
    )
    uncertainty = (0.003, 0.003)

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._stances, self._swings = OwnMedian(_KNOWN_STEPS), OwnMedian(_KNOWN_STEPS)
        self._sign = math.copysign(1.0, self.settings.sign)
        self._zero = 0.0  # [N]
        self._downwards = 0  # samples that press the foot down
        self._unloaded = False  # the foot has been seen in the air
        self._restart()

    @classmethod
    def calibrated(cls, settings: Any, walk: Sequence[Any]) -> Any:
        """Return settings with the sign found in a recording: feet press down on the ground."""
        force = np.array([values[0] for _, values in walk])
        force = force[np.isfinite(force)]
        if not force.size:
            return settings
        loaded = np.abs(force) >= 0.5 * np.quantile(np.abs(force), 0.99)
        return replace(settings, sign=math.copysign(1.0, np.median(force[loaded])))

    @property
    def latency(self) -> float:
        """Longest time from the lower threshold to the upper one, plus ``debounce``."""
        return float(0.03 + self.settings.debounce)

    def _restart(self) -> None:
        self._on: bool | None = None  # on the ground; None before it is known
        self._own = True  # the contact in progress is this foot's
        self._force = math.nan
        self._rise = math.nan  # when the force rose through the lower threshold [s]
        self._strike = self._toe_off = math.nan  # of the contact or swing in progress [s]
        self._changed = self._fall = math.nan  # when it seemed to end; fell below the lower [s]
        self._highest = self._lowest = math.nan  # of the contact; since then [N]
        self._on_since = math.nan

    def troubles(self, now: float | None = None) -> tuple[str, ...]:
        """Add a force of the wrong sign, and one that never drops."""
        lines = super().troubles(now)
        where = f"{self.side.name.lower()} {self.name}"
        if self._downwards:
            lines += (f"{where}: {self._downwards} samples below {_PULLED:g} N: {self.suspicion}",)
        if self._walked_long and self._largest > self.reached and not self._unloaded:
            lines += (f"{where}: never unloaded: zero it; both feet on it, or nobody walking?",)
        return lines

    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        self._watch(time, values[0])
        settings, before = self.settings, self._force
        force = self._force = self._sign * values[0] - self._zero
        upper, lower = settings.strike_force, settings.toe_off_force
        if self._on:
            if force >= upper:
                self._changed = math.nan
                self._reset_zero(time, force)
            elif force < lower:
                if self._changed != self._changed:
                    self._changed, self._fall = time, self._passed(lower, before, force)
                if time - self._changed >= settings.debounce:
                    return self._leave(time)
            return []
        pulled = max(force, force + self._zero) <= _PULLED  # however the sensor was zeroed
        if force < lower:
            self._on, self._rise, self._changed = False, math.nan, math.nan
            self._unloaded = True
            self._downwards += pulled
        elif before < lower:
            self._rise = self._passed(lower, before, force)
        if force >= upper:
            if self._changed != self._changed:
                self._changed = time
            if time - self._changed >= settings.debounce:
                return self._meet(time)
        if force < upper and not pulled:  # in the air
            interval = time - self._before
            self._zero += force * interval / (settings.zeroing_time + interval)
        return []

    def _meet(self, time: float) -> list[Detection]:
        """Start a contact; return a strike if it is this foot's own."""
        rise, swing = self._rise, self._rise - self._toe_off
        seen_off = self._on is False
        self._on, self._on_since, self._changed = True, time, math.nan
        self._highest, self._strike = -math.inf, rise
        if not seen_off:
            self._strike = math.nan
            return []
        least = max(self.settings.refractory, self.settings.least_share * self._swings.value)
        self._own = not swing < least
        if self.settings.refractory <= swing < self.settings.longest_stance:
            self._swings.add(swing)
        if not self._own:
            self.counts.rejected += 1
            return []
        return self._found(EventKind.HEEL_STRIKE, rise, time)

    def _leave(self, time: float) -> list[Detection]:
        """End a contact; return a toe-off if it was this foot's own stance."""
        settings, toe_off = self.settings, self._fall
        stance = toe_off - self._strike
        least = max(settings.shortest_stance, settings.least_share * self._stances.value)
        most = settings.most_share * self._stances.value or math.inf
        walks = stance < settings.longest_stance  # otherwise the person stood
        # The strike of a contact that was there at the start is unknown.
        believed = self._own and not stance < least and not (walks and stance > most)
        self._on, self._unloaded = False, True
        self._rise = self._changed = math.nan
        if self._own:  # otherwise the swing in progress continues
            self._toe_off = toe_off if believed else math.nan
        if self._own and walks and stance >= settings.shortest_stance:
            self._stances.add(stance)
        if not believed:
            self.counts.rejected += 1
            return []
        return self._found(EventKind.TOE_OFF, toe_off, time)

    def _reset_zero(self, time: float, force: float) -> None:
        """Reset the zero after an unseen swing: the force fell far from its peak, and rose."""
        if force > self._highest:
            self._highest = self._lowest = force
        elif force < self._lowest:
            self._lowest = force
        longest = self.settings.longest_stance
        if self._lowest < _UNLOADED <= force and time - self._on_since > longest:
            self._zero += self._lowest
            self._on = None
