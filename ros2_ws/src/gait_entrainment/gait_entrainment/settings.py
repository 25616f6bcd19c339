# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What can be set, and to what: one type for every number, word and switch that a user may choose.

A field of a frozen dataclass made by ``setting`` carries its meaning, unit and range. Protocol
files, command-line options, driver options and ROS parameters are all read by ``Setting.check`` or
``Setting.parse``, so that the same mistake gets the same answer everywhere.
"""

import math
from dataclasses import dataclass, field, fields
from typing import Any

from gait_entrainment.errors import UsageError


class SettingError(UsageError):
    """A value that is not allowed; the message is one line: name, value, what is allowed."""


@dataclass(frozen=True)
class Setting:
    """What may be set: a number within bounds, a whole number, a switch, or a text."""

    meaning: str
    kind: type = float  # float, int, bool or str
    unit: str = ""  # "1" if the number has none
    least: float = -math.inf
    most: float = math.inf
    least_excluded: bool = False
    most_excluded: bool = False
    choices: tuple[str, ...] = ()  # the texts that are allowed; empty allows any

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is bool:
            return "true, false"
        if self.kind is str:
            return "a text"
        bounds = []
        if self.least > -math.inf:
            bounds.append(f"{'above' if self.least_excluded else 'at least'} {self.least:g}")
        if self.most < math.inf:
            bounds.append(f"{'below' if self.most_excluded else 'at most'} {self.most:g}")
        number = "a whole number " if self.kind is int else ""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return number + (" and ".join(bounds) or "any finite number") + unit

    def check(self, name: str, value: object) -> Any:
        """
        Return a value as the setting's kind; whole numbers pass for real ones.

        Raises
        ------
        SettingError
            if it is of another kind, not finite, or out of range.

        """
        given = value
        if self.kind is float and isinstance(value, int) and not isinstance(value, bool):
            # A whole number too large for a float is beyond every bound.
            value = float(value) if abs(value) < 2**1000 else math.copysign(math.inf, value)
        if type(value) is not self.kind or not self._within(value):
            raise SettingError(f"{name}: {given!r}; allowed: {self.allowed}")
        return value

    def parse(self, name: str, text: str) -> Any:
        """Return the value that a text stands for; raises SettingError as ``check`` does."""
        value: object = text
        if self.kind is bool:
            value = {"true": True, "false": False}.get(text, text)
        elif self.kind is not str:
            try:
                value = self.kind(text)
            except ValueError:
                value = text
        return self.check(name, value)

    def _within(self, value: Any) -> bool:
        if self.kind is str:
            return not self.choices or value in self.choices
        if self.kind is bool:
            return True
        above = value > self.least if self.least_excluded else value >= self.least
        below = value < self.most if self.most_excluded else value <= self.most
        return math.isfinite(value) and above and below


def setting(
    default: Any,
    meaning: str,
    unit: str = "",
    within: tuple[float, float] = (-math.inf, math.inf),
    **more: Any,
) -> Any:
    """Return a field of a dataclass that can be set; ``more`` are further fields of Setting."""
    least, most = within
    kind = more.pop("kind", type(default))
    told = Setting(meaning, kind, unit, least, most, **more)
    return field(default=default, metadata={"setting": told})


def settings_of(dataclass_type: Any) -> dict[str, Setting]:
    """Return what can be set of a dataclass, by the names of its fields."""
    return {f.name: f.metadata["setting"] for f in fields(dataclass_type)}


def check_settings(instance: Any) -> None:
    """Check every field of a dataclass, as its ``__post_init__``; floats become floats."""
    for name, told in settings_of(type(instance)).items():
        object.__setattr__(instance, name, told.check(name, getattr(instance, name)))
