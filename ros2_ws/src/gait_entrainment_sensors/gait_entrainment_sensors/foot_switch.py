# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Switches or force-sensing resistors under heel and toes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.settings import setting
from gait_entrainment_sensors.detection import Detection, Detector, DetectorSettings


@dataclass(frozen=True)
class FootSwitchSettings(DetectorSettings):
    """What the detector can be told; levels are shares of a closed contact."""

    hysteresis: ClassVar[tuple[str, ...]] = ("open_below", "closed_above")
    closed_above: float = setting(0.6, "a contact closes above", "1", (0.0, 1.0))
    open_below: float = setting(0.4, "a contact opens below", "1", (0.0, 1.0))
    debounce: float = setting(0.02, "a change must last for", "s", (0.0, 0.2))
    longest_constant: float = setting(5.0, "longest time without change", "s", (0.1, 60.0))


class FootSwitchDetector(Detector):
    """
    Events from two contacts, a Schmitt trigger each; a foot is on the ground while one is closed.

    An event is the first of the changes that lasts: half a sample before it was seen, interpolated
    where the contact is graded. Hanlon and Anderson (Gait Posture 30, 2009) found 2.4 +/- 2.1 ms
    beside force plates, a later study 17.7 +/- 11.7 ms.

    Latency: ``debounce``.
    Uncertainty: 6 ms, between the two published; measure it with your own insoles.
    Fails: worn or shifted insoles, whose toe-off comes early if only heel and toes are covered; a
    contact that stays closed in the shoe: neither strike nor toe-off, which is told.
    """

    name = "foot_switch"
    signals: ClassVar[tuple[str, ...]] = ("heel", "toe")
    Settings: ClassVar[type[DetectorSettings]] = FootSwitchSettings
    impossible = 4.0
    reached = 0.6
    suspicion = "0 for an open contact to 1 for a closed one are expected, not volts"
    uncertainty = (0.006, 0.006)

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._restart()

    @property
    def latency(self) -> float:
        """The time that a change must last, and the half sample before it."""
        return float(self.settings.debounce)

    def _restart(self) -> None:
        self._contacts = [False, False]
        self._down: bool | None = None  # on the ground; None before it is known
        self._changed = math.nan  # when that seemed to change [s]; NaN if it does not

    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        settings, contacts = self.settings, self._contacts
        for i in (0, 1):
            if values[i] > settings.closed_above:
                contacts[i] = True
            elif values[i] < settings.open_below:
                contacts[i] = False
        down = contacts[0] or contacts[1]
        if self._down is None:
            self._down = down
        if down == self._down:
            self._changed = math.nan
            return []
        if self._changed != self._changed:
            self._changed = 0.5 * (time + self._before)
        if time - self._changed < settings.debounce:
            return []
        self._down, changed, self._changed = down, self._changed, math.nan
        return self._found(EventKind.HEEL_STRIKE if down else EventKind.TOE_OFF, changed, time)
