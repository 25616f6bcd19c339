# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Protocol files: YAML in, a validated Protocol out, with the line of whatever is wrong.

PyYAML's node graph keeps the line of every key, which its loaded dictionaries do not.
"""

import contextlib
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import ParameterError, WalkerParameters
from gait_entrainment.protocol.protocol import Protocol, ProtocolError, PulsePlan

DEFAULT_PROTOCOL = Protocol()


@dataclass(frozen=True)
class _Entry:
    value: object
    where: str  # file and line, or the command-line option that set it


@dataclass(frozen=True)
class _Range:
    """What a number may be: bounds, open or closed, with the unit for the message."""

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False
    unit: str = ""

    def __contains__(self, value: float) -> bool:
        above = value > self.low if self.low_open else value >= self.low
        below = value < self.high if self.high_open else value <= self.high
        return math.isfinite(value) and above and below

    def __str__(self) -> str:
        bounds = []
        if math.isfinite(self.low):
            bounds.append(("above " if self.low_open else "at least ") + f"{self.low:g}")
        if math.isfinite(self.high):
            bounds.append(("below " if self.high_open else "at most ") + f"{self.high:g}")
        unit = f" {self.unit}" if self.unit else ""
        return (" and ".join(bounds) or "any finite number") + unit


# Counts end where a run would last for days: a million strides are three weeks of walking. A pulse
# shorter than a nanosecond has no stamps, and a run is promised in steps of at most a pulse period
# until the stride period is known.
_COUNT = _Range(1, 1_000_000)
_RANGES = {
    "baseline": _COUNT,
    "washout": _Range(0, 1_000_000),
    "seed": _Range(0, 2**63 - 1),
    "pulses.count": _COUNT,
    "pulses.width": _Range(1e-9, 10, unit="s"),
    "pulses.torque": _Range(unit="N m"),
    "pulses.torque_fraction": _Range(-1, 1, unit="of the peak ankle torque"),
    "pulses.period": _Range(1e-3, 100, unit="s"),
    "pulses.period_offset": _Range(-100, 100, unit="s"),
    "pulses.initial_phase": _Range(0, 1, high_open=True),
}
_INTEGERS = {"baseline", "washout", "seed", "pulses.count"}
_TEXTS = {"name", "driver"}
_WALKER_FIELDS = [f"walker.{f.name}" for f in fields(WalkerParameters)]
_FIELDS = {*_RANGES, *_TEXTS, *_WALKER_FIELDS, "side"}
# Of two ways to say the same, the one that is given replaces the other.
_ALTERNATIVES = (
    ("pulses.torque", "pulses.torque_fraction"),
    ("pulses.period", "pulses.period_offset"),
)


def read_protocol(
    source: Path | str | None = None, overrides: Mapping[str, tuple[object, str]] | None = None
) -> Protocol:
    """
    Read and validate a protocol.

    Parameters
    ----------
    source
        Path of a YAML file, the text of one (with a line break), or None for the default.
    overrides
        Values that replace those of the file: dotted field name -> (value, who says so), for
        instance ``{"pulses.width": (0.2, "--width")}``.

    Raises
    ------
    ProtocolError
        One line: place, field, what is allowed.

    """
    entries = dict(_entries(source)) if source is not None else {}
    overrides = overrides or {}
    for pair in _ALTERNATIVES:
        if any(key in overrides for key in pair):
            for alternative in pair:
                entries.pop(alternative, None)
    entries |= {key: _Entry(*given) for key, given in overrides.items()}
    for pair in _ALTERNATIVES:
        if all(key in entries for key in pair):
            where = entries[pair[1]].where
            raise ProtocolError(
                f"{where}: {pair[1]}: give either {pair[0]} or {pair[1]}, not both"
            )
    return _build(entries)


def write_protocol(protocol: Protocol) -> str:
    """Return the text of a protocol file (YAML) that reads back as the same protocol."""
    content: dict[str, Any] = asdict(protocol)
    content["side"] = protocol.side.name.lower()
    content["pulses"] = {k: v for k, v in content["pulses"].items() if v is not None}
    text: str = yaml.safe_dump(content, sort_keys=False)
    return text


def _entries(source: Path | str) -> Iterator[tuple[str, _Entry]]:
    """Yield dotted field names with value and place from a YAML file or text."""
    if isinstance(source, str) and "\n" in source:
        name, text = "protocol", source
    else:
        name = str(source)
        try:
            text = Path(source).read_text(encoding="utf-8")
        except (OSError, ValueError) as error:  # a name with a null byte, or no UTF-8 in it
            reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
            raise ProtocolError(f"{name}: cannot be read: {reason}") from None
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "unreadable"
        raise ProtocolError(f"{name}{line}: not valid YAML: {problem}") from None
    except RecursionError:
        raise ProtocolError(f"{name}: nested too deeply for a protocol") from None
    if root is not None:
        yield from _walk(root, name, "")


def _walk(node: yaml.Node, name: str, prefix: str) -> Iterator[tuple[str, _Entry]]:
    if not isinstance(node, yaml.MappingNode):
        section = prefix.rstrip(".") or "a protocol"
        raise ProtocolError(
            f"{name}:{node.start_mark.line + 1}: {section} must be a mapping of fields to values"
        )
    seen: set[str] = set()
    for key_node, value_node in node.value:
        where = f"{name}:{key_node.start_mark.line + 1}"
        key = prefix + str(key_node.value)
        if key in seen:
            raise ProtocolError(f"{where}: {key}: appears twice; keep one")
        seen.add(key)
        if key in ("pulses", "walker"):
            yield from _walk(value_node, name, key + ".")
        elif key not in _FIELDS or "." in str(key_node.value):  # a section's field has one place
            known = ", ".join(
                sorted(f[len(prefix) :] for f in _FIELDS if f.startswith(prefix) and f != prefix)
                if prefix
                else sorted({f.split(".")[0] for f in _FIELDS})
            )
            raise ProtocolError(f"{where}: {key}: unknown field; allowed: {known}")
        elif not isinstance(value_node, yaml.ScalarNode):
            raise ProtocolError(f"{where}: {key}: must be a single value")
        else:
            try:
                value = yaml.SafeLoader("").construct_object(value_node)
            except Exception:  # an unknown tag, a month 13: PyYAML lets pass what it runs into
                raise ProtocolError(
                    f"{where}: {key}: {value_node.value[:40]!r} cannot be read as a value"
                ) from None
            yield key, _Entry(value, where)


def _build(entries: Mapping[str, _Entry]) -> Protocol:
    values = {key: _checked(key, entry) for key, entry in entries.items()}
    sections: dict[str, dict[str, Any]] = {"": {}, "pulses": {}, "walker": {}}
    for key, value in values.items():
        section, _, field_name = key.rpartition(".")
        sections[section][field_name] = value
    # A torque or a period that is given leaves no place for the default of its alternative.
    for pair in _ALTERNATIVES:
        for given, default in (pair, pair[::-1]):
            if given in values:
                sections["pulses"][default.partition(".")[2]] = None
    try:
        return Protocol(
            pulses=PulsePlan(**sections["pulses"]),
            walker=WalkerParameters(**sections["walker"]),
            **sections[""],
        )
    except ParameterError as error:
        # The message begins with the field; where that is a default, the others are at fault.
        named = f"walker.{str(error).split()[0]}"
        present = [key for key in _WALKER_FIELDS if key in entries]
        places = [entries[key].where for key in ([named] if named in present else present)]
        raise ProtocolError(f"{', '.join(places)}: walker: {error}") from None
    except ProtocolError as error:
        # What is wrong may lie in a default; then the field that does not go with it is at fault.
        suspects = (str(error).partition(":")[0], "pulses.period")
        place = next((entries[key].where + ": " for key in suspects if key in entries), "")
        raise ProtocolError(f"{place}{error}") from None


def _checked(key: str, entry: _Entry) -> object:
    value = entry.value
    if key == "side":
        if str(value).lower() not in ("left", "right"):
            raise ProtocolError(f"{entry.where}: side: {value!r}; allowed: left, right")
        return Side[str(value).upper()]
    if key in _TEXTS:
        # The name becomes a folder's: no separators, nothing hidden, nothing empty or unseen.
        plain = isinstance(value, str) and value.isprintable() and value.strip()
        if not plain or "/" in str(value) or str(value).startswith("."):
            raise ProtocolError(f"{entry.where}: {key}: {value!r}; allowed: a plain name")
        return value
    allowed = _RANGES.get(key, _Range())
    if isinstance(value, str):  # YAML 1.1 reads 1e-3, which has no dot, as text
        with contextlib.suppress(ValueError):
            value = float(value)
    elif isinstance(value, int) and abs(value) > sys.float_info.max:
        value = math.copysign(math.inf, 1 if value > 0 else -1)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ProtocolError(f"{entry.where}: {key}: {value!r} is not a number; allowed: {allowed}")
    if key in _INTEGERS and not isinstance(value, int):
        raise ProtocolError(f"{entry.where}: {key}: {value!r}; allowed: a whole number {allowed}")
    if value not in allowed:
        raise ProtocolError(f"{entry.where}: {key}: {value}; allowed: {allowed}")
    return value if key in _INTEGERS else float(value)
