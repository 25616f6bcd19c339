# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Protocol files: YAML in, a validated Protocol out; errors give the line.

PyYAML's node graph keeps the line of every key, which its loaded dictionaries do not.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml

from gait_entrainment.parameters import ParameterError
from gait_entrainment.protocol.block import HEIGHTS, TIMINGS, Block, ProtocolError
from gait_entrainment.protocol.protocol import (
    BLOCK_FIELDS,
    FIELDS,
    SECTIONS,
    Protocol,
    changes,
    content_of,
)
from gait_entrainment.robot import DeviceError, LimitError, find_driver
from gait_entrainment.settings import Setting, SettingError

DEFAULT_PROTOCOL = Protocol()

# Of alternative fields, the one that is given replaces the others.
_ALTERNATIVES = tuple([f"pulses.{name}" for name in group] for group in (HEIGHTS, TIMINGS))


_SUSPECTS = ("pulses.period", "pulses.phase", "pulses.shape", "pulses.count")
_B = TypeVar("_B", bound=Block)


class Entry(NamedTuple):
    """The value given for a field."""

    value: object
    where: str  # file and line, or the command-line option that set it


def read_protocol(
    source: Path | str | Mapping[str, Entry] | None = None,
    overrides: Mapping[str, tuple[object, str]] | None = None,
    *,
    to_run: bool = False,
) -> Protocol:
    """
    Read and validate a protocol: the default, or one given as entries, a YAML file or its text.

    A text contains a line break. ``overrides`` replace values of the source: dotted field name
    -> (value, origin), as ``{"pulses.width": (0.2, "--width")}``; a value given as text is parsed.
    Raises ProtocolError: one line with place, field, and what is allowed. ``to_run`` also checks
    that the driver loads and the pulses are within limits, else raises DeviceError or LimitError.
    """
    if isinstance(source, str | Path):
        name, _, root = composed(source)
        source = dict(entries_in(root, name)) if root else {}
    entries = dict(source or {})
    replacing = dict(_spelled_out(key, Entry(*given)) for key, given in (overrides or {}).items())
    blocks = entries.pop("blocks", None)
    if blocks is None:
        entries = _merged(entries, replacing)
        return _checked(_build(Protocol, entries), [entries], to_run=to_run)
    # Fields outside the blocks apply to every block that does not set them itself.
    of_blocks = BLOCK_FIELDS.keys() - {"name", "side"}
    common = {key: entries.pop(key) for key in BLOCK_FIELDS if key in of_blocks & entries.keys()}
    in_blocks = {k: e for k, e in replacing.items() if k in of_blocks}
    listed: Any = blocks.value
    merged = [_merged(_merged(common, of_block), in_blocks) for of_block in listed]
    made = [_build(Block, of_block) for of_block in merged]
    entries |= {k: e for k, e in replacing.items() if k not in in_blocks}
    if "side" in replacing:
        made = [replace(block, side=None) for block in made]
    protocol = _build(Protocol, entries, blocks=tuple(made))
    return _checked(protocol, [of_block | entries for of_block in merged], to_run=to_run)


def _checked(protocol: Protocol, each: Sequence[Mapping[str, Entry]], *, to_run: bool) -> Protocol:
    """Return a protocol, checked if it is ``to_run``, with the entries of each block."""
    for block, entries in zip(protocol.sequence if to_run else (), each, strict=False):
        try:
            find_driver(protocol.driver, protocol.side)
            protocol.check_limits(block)
        except (LimitError, DeviceError) as error:
            field, heights = str(error).partition(":")[0], (f"pulses.{name}" for name in HEIGHTS)
            suspects = (field, f"pulses.{field}", f"limits.{field}", *heights)
            raise type(error)(f"{_place(suspects, entries)}{error}") from None
    return protocol


def _place(suspects: Iterable[str], entries: Mapping[str, Entry]) -> str:
    """Return the place of the first suspect that was given, else of the first field given."""
    found = (entries[key].where + ": " for key in (*suspects, *entries) if key in entries)
    return next(found, "")


def write_protocol(protocol: Protocol) -> str:
    """Return the text of a protocol file (YAML) that reads back as the same protocol."""
    content = content_of(protocol)
    for block in content.get("blocks", [content]):
        block["pulses"] = {k: v for k, v in block["pulses"].items() if v is not None}
    content["limits"] = changes(protocol.limits)
    text: str = yaml.safe_dump({k: v for k, v in content.items() if v != {}}, sort_keys=False)
    return text


def composed(source: Path | str) -> tuple[str, str, yaml.Node | None]:
    """Return name, text and content of a YAML file or text; raises ProtocolError."""
    if isinstance(source, str) and "\n" in source:
        name, text = "protocol", source
    else:
        name = str(source)
        try:
            text = Path(source).read_text(encoding="utf-8")
        except (OSError, ValueError) as error:  # a null byte in the name, or not UTF-8
            reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
            raise ProtocolError(f"{name}: cannot be read: {reason}") from None
    try:
        return name, text, yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "unreadable"
        raise ProtocolError(f"{name}{line}: not valid YAML: {problem}") from None
    except RecursionError:
        raise ProtocolError(f"{name}: nested too deeply for a protocol") from None


def entries_in(
    node: yaml.Node, name: str, allowed: Mapping[str, Setting] = FIELDS, prefix: str = ""
) -> Iterator[tuple[str, Entry]]:
    """Yield dotted field names with value and place from a node of the file ``name``."""
    if not isinstance(node, yaml.MappingNode):
        section = prefix.rstrip(".") or "a protocol"
        raise ProtocolError(
            f"{name}:{node.start_mark.line + 1}: {section} must be a mapping of fields to values"
        )
    seen: set[str] = set()
    for key_node, value_node in node.value:
        where = f"{name}:{key_node.start_mark.line + 1}"
        key = prefix + (key_node.value if isinstance(key_node, yaml.ScalarNode) else "?")
        if key in seen:
            raise ProtocolError(f"{where}: {key}: appears twice; keep one")
        seen.add(key)
        if key == "blocks" and allowed is FIELDS:
            if not isinstance(value_node, yaml.SequenceNode) or not value_node.value:
                raise ProtocolError(f"{where}: blocks: must be a list of at least one block")
            blocks = [dict(entries_in(block, name, BLOCK_FIELDS)) for block in value_node.value]
            yield key, Entry(blocks, where)
        elif key in allowed and allowed[key].kind is yaml.Node:  # for the caller to read
            yield key, Entry(value_node, where)
        elif any(field.startswith(f"{key}.") for field in allowed):
            yield from entries_in(value_node, name, allowed, f"{key}.")
        elif key not in allowed or "." in str(key_node.value):  # no dotted keys in a file
            inside = [field.removeprefix(prefix) for field in allowed if field.startswith(prefix)]
            known = ", ".join(sorted({field.partition(".")[0] for field in inside}))
            raise ProtocolError(f"{where}: {key}: unknown field; allowed: {known}")
        elif isinstance(value_node, yaml.SequenceNode) and allowed[key].kind is str:
            yield key, Entry(", ".join(str(item.value) for item in value_node.value), where)
        elif not isinstance(value_node, yaml.ScalarNode):
            raise ProtocolError(f"{where}: {key}: must be a single value")
        elif allowed[key].kind is str:  # as written, even if it is a number in YAML
            yield key, Entry(value_node.value, where)
        else:
            value = _meant(f"{where}: {key}", allowed[key].kind, value_node)
            yield _spelled_out(key, Entry(value, where))


def _spelled_out(key: str, entry: Entry) -> tuple[str, Entry]:
    """Return an entry, with "side: both" as the field that it is short for."""
    both = (key, entry.value) == ("side", "both")
    return ("both_legs", entry._replace(value=True)) if both else (key, entry)


def _meant(where: str, kind: type, node: yaml.ScalarNode) -> object:
    """Return a value as people mean it, else as written; ProtocolError if YAML 1.1 differs."""
    if kind in (int, float) and node.style in ("'", '"'):
        raise ProtocolError(f"{where}: {node.value!r} is text: remove the quotes")
    try:
        value = yaml.SafeLoader("").construct_object(node)
    except Exception:  # an unknown tag, month 13: PyYAML lets any exception through
        raise ProtocolError(f"{where}: {node.value[:40]!r} cannot be read as a value") from None
    same = node.value.isdigit() and int(node.value) == value
    other_base = isinstance(value, int) and re.match(r"[-+]?0[0-9_box]", node.value) and not same
    if other_base or (isinstance(value, int | float) and ":" in node.value):
        raise ProtocolError(f"{where}: {node.value} is {value} in YAML; write a decimal number")
    fits = isinstance(value, int | float) and isinstance(value, bool) is (kind is bool)
    return value if fits or value is None else node.value


def _merged(entries: Mapping[str, Entry], replacing: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return entries with some replaced; what replaces a field also replaces its alternatives."""
    replaced = {
        k for group in _ALTERNATIVES if not replacing.keys().isdisjoint(group) for k in group
    }
    merged = {k: e for k, e in entries.items() if k not in replaced} | dict(replacing)
    for group in _ALTERNATIVES:
        if len(given := [key for key in group if key in merged]) > 1:
            raise ProtocolError(
                f"{merged[given[1]].where}: {given[1]}: give either {' or '.join(given)}, not both"
            )
    return merged


def value_of(rule: Setting, key: str, entry: Entry) -> Any:
    """Return the checked value of an entry; raises ProtocolError."""
    value, where = entry
    try:
        # YAML 1.1 reads 1e-3, which has no dot, as text.
        return rule.parse(key, value) if isinstance(value, str) else rule.check(key, value)
    except SettingError as error:
        also = ", both" if key == "side" else ""
        raise ProtocolError(f"{where}: {error}{also}") from None


def _build(kind: type[_B], entries: Mapping[str, Entry], **more: Any) -> _B:
    """Return a block or a whole protocol made from its entries."""
    sections: dict[str, dict[str, Any]] = {"": {}}
    rules = BLOCK_FIELDS if kind is Block else FIELDS
    for key, entry in entries.items():
        section, _, name = key.rpartition(".")
        sections.setdefault(section, {})[name] = value_of(rules[key], key, entry)
    # A given field overrides the default of its alternative.
    for group in _ALTERNATIVES:
        if any(key in entries for key in group):
            unset = {key.partition(".")[2]: None for key in group}
            sections["pulses"] = unset | sections["pulses"]
    values = sections.pop("") | more
    try:
        values |= {name: SECTIONS[name](**content) for name, content in sections.items()}
        return kind(**values)
    except ParameterError as error:
        # The message begins with the field; if that is a default, the others are at fault.
        named = f"walker.{str(error).partition(':')[0]}"
        present = [key for key in entries if key.startswith("walker.")]
        places = [entries[key].where for key in ([named] if named in present else present)]
        raise ProtocolError(f"{', '.join(dict.fromkeys(places))}: walker: {error}") from None
    except ProtocolError as error:
        # The wrong value may be a default; then the field that conflicts with it is at fault.
        suspects = (str(error).partition(":")[0], *_SUSPECTS)
        raise ProtocolError(f"{_place(suspects, entries)}{error}") from None
