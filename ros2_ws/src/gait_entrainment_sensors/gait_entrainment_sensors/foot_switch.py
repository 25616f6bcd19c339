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
    """Settings of the detector; levels are shares of a closed contact."""

    hysteresis: ClassVar[tuple[str, ...]] = ("open_below", "closed_above")
    closed_above: float = setting(0.6, "level above which a contact closes", "1", (0.0, 1.0))
    open_below: float = setting(0.4, "level below which a contact opens", "1", (0.0, 1.0))
    debounce: float = setting(0.02, "shortest change that counts", "s", (0.0, 0.2))
    longest_constant: float = setting(5.0, "longest time without change", "s", (0.1, 60.0))


class FootSwitchDetector(Detector):
    """
    Events from two contacts, a Schmitt trigger each; a foot is on the ground while one is closed.

    An event is the start of a change that lasts, half a sample before it was seen. Hanlon and
    Anderson (Gait Posture 30, 2009) found 2.4 +/- 2.1 ms compared with force plates, a later study
    17.7 +/- 11.7 ms.

    Latency: ``debounce``.
    Uncertainty: 6 ms, between the two published values; measure it with your own insoles.
    Fails: worn or shifted insoles, whose toe-off comes early if only heel and toes are covered; a
    contact that stays closed in the shoe: neither strike nor toe-off, which is reported.
    """

    name = "foot_switch"
    signals: ClassVar[tuple[str, ...]] = ("heel", "toe")
    Settings: ClassVar[type[DetectorSettings]] = FootSwitchSettings
    impossible = 4.0
    reached = 0.6
    suspicion = "values from 0 (open) to 1 (closed) are expected, not volts"
    uncertainty = (0.006, 0.006)

    def __init__(self, side: Side, settings: Any = None) -> None:
        super().__init__(side, settings)
        self._restart()

    @property
    def latency(self) -> float:
        """Time that a change must last."""
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
