# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Settings and what they allow: one type for every number, word and switch that a user may choose.

A field of a frozen dataclass made by ``setting`` carries its meaning, unit and range. Protocol
files, command-line options, driver options and ROS parameters are all read by ``Setting.check`` or
``Setting.parse``, so that the same mistake gives the same message everywhere.
"""

import contextlib
import math
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any

from gait_entrainment.errors import UsageError


class SettingError(UsageError):
    """A value that is not allowed; the message is one line: name, value, what is allowed."""


@dataclass(frozen=True)
class Setting:
    """One setting: a number within bounds, a whole number, a switch, a choice or text."""

    meaning: str
    kind: type = float  # float, int, bool, str or an enumeration
    unit: str = ""  # "1" if the number has none
    least: float = -math.inf
    most: float = math.inf
    least_excluded: bool = False
    most_excluded: bool = False
    choices: tuple[str, ...] = ()  # the allowed texts; empty allows any
    plain: bool = False  # whether the text must be usable as the name of a folder
    optional: bool = False  # whether None is allowed

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        if issubclass(self.kind, Enum):
            return ", ".join(member.name.lower() for member in self.kind)
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is bool:
            return "true, false"
        if self.kind is str:
            return "a plain name" if self.plain else "any text"
        number = "a whole number " if self.kind is int else ""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return number + self._bounds() + unit

    def _bounds(self) -> str:
        least, most = (f"{b}" if isinstance(b, int) else f"{b:g}" for b in (self.least, self.most))
        bounds = []
        if self.least > -math.inf:
            bounds.append(f"{'above' if self.least_excluded else 'at least'} {least}")
        if self.most < math.inf:
            bounds.append(f"{'below' if self.most_excluded else 'at most'} {most}")
        if len(bounds) == 2 and not (self.least_excluded or self.most_excluded):
            return f"from {least} to {most}" if self.kind is int else f"{least} to {most}"
        return " and ".join(bounds) or "any finite number"

    def check(self, name: str, value: object) -> Any:
        """
        Return a value as the setting's kind; whole numbers are accepted for real ones.

        Raises SettingError if it is of another kind, not finite, or out of range.
        """
        if value is None and self.optional:
            return None
        switch = isinstance(value, bool)  # which Python counts as a whole number
        if self.kind is float and isinstance(value, int | float) and not switch:
            try:
                value = float(value)
            except OverflowError:  # a whole number with hundreds of digits
                value = math.inf if value > 0 else -math.inf
        fits = isinstance(value, self.kind) and switch == (self.kind is bool)
        if not fits or not self._within(value):
            raise SettingError(f"{name}: {value!r}; allowed: {self.allowed}")
        return value

    def parse(self, name: str, text: str) -> Any:
        """Return the value that a text represents; raises SettingError as ``check`` does."""
        kind: Any = self.kind
        value: Any = None
        if kind is str:
            value = text
        elif kind is bool:
            value = {"true": True, "false": False}.get(text)
        elif issubclass(kind, Enum):
            value = kind.__members__.get(text.upper())
        else:
            with contextlib.suppress(ValueError):
                value = kind(text)
        try:
            return self.check(name, text if value is None else value)
        except SettingError:
            raise SettingError(f"{name}: {text!r}; allowed: {self.allowed}") from None

    def _within(self, value: Any) -> bool:
        if self.choices:
            return value in self.choices
        if self.plain:  # no separator, not hidden, nothing invisible
            return bool(value.isprintable() and value.strip()) and not (
                "/" in value or value.startswith(".")
            )
        if self.kind not in (int, float):
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
    """Return a dataclass field with a setting; ``more`` are further fields of Setting."""
    least, most = within
    kind = more.pop("kind", type(default))
    rule = Setting(meaning, kind, unit, least, most, **more)
    return field(default=default, metadata={"setting": rule})


def settings_of(dataclass_type: Any) -> dict[str, Setting]:
    """Return the settings of a dataclass by field name."""
    return {
        f.name: f.metadata["setting"] for f in fields(dataclass_type) if "setting" in f.metadata
    }


class Checked:
    """A frozen dataclass of settings that are checked when it is made; raises SettingError."""

    def __post_init__(self) -> None:
        """Check every setting; whole numbers become real ones if that is the setting's kind."""
        for name, rule in settings_of(type(self)).items():
            object.__setattr__(self, name, rule.check(name, getattr(self, name)))
