# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Session files: YAML in, a validated Session out, with the line of whatever is wrong.

    study: ankle_pilot
    session: "1"
    person: {code: P01, number: 1, mass: 72, leg_length: 0.91}
    limits: {torque: 15}                     # the person's; of any protocol
    order: balanced                          # or written, permuted
    protocol: {side: left, pulses: {count: 50}}        # what all blocks have: fields or a file
    blocks:
      - {name: faster, protocol: {pulses: {period_offset: -0.05}}}
      - {name: slower, protocol: slower.yaml, rest: 120}

A block's fields replace those that all blocks have; one of ``period`` and ``period_offset``, for
instance, the other. The walker has the person's mass and legs, in the paper's proportions.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import (
    DEFAULT_PROTOCOL,
    Protocol,
    ProtocolError,
    read_protocol,
    write_protocol,
)
from gait_entrainment.protocol.protocol import BLOCK_FIELDS
from gait_entrainment.robot import DeviceError, DeviceLimits, LimitError, find_driver
from gait_entrainment.settings import Setting, SettingError, setting, settings_of
from gait_entrainment_sessions.order import ORDERS, block_order


class SessionError(UsageError):
    """A session that cannot be conducted; one line: file, line, field, what is allowed."""


@dataclass(frozen=True)
class Person:
    """Whom the session is with: nothing by which anybody else would know."""

    code: str = setting("", "code of the person, no name: letters and digits")
    number: int = setting(1, "place of the person in the study, for the order", within=(1, 10**6))
    mass: float = setting(WalkerParameters.mass, "mass", "kg", (5.0, 500.0))
    leg_length: float = setting(WalkerParameters.leg_length, "leg length", "m", (0.2, 2.0))

    @property
    def walker(self) -> dict[str, float]:
        """The walker of this size: the paper's, its foot and stiffness in proportion."""
        paper = WalkerParameters()
        size = self.mass * self.leg_length / (paper.mass * paper.leg_length)
        return {
            "mass": self.mass,
            "leg_length": self.leg_length,
            "foot_length": paper.foot_length * self.leg_length / paper.leg_length,
            "ankle_stiffness": paper.ankle_stiffness * size,
        }


@dataclass(frozen=True)
class Block:
    """One run of a session."""

    name: str = setting("", "name of the block, once in a session", plain=True)
    rest: float = setting(60.0, "rest before the block, but for the first", "s", (0.0, 86_400.0))
    protocol: Protocol = DEFAULT_PROTOCOL
    place: str = ""  # file and line


@dataclass(frozen=True)
class Session:
    """One session, complete."""

    study: str = setting("study", "name of the study", plain=True)
    session: str = setting("1", "label of the session of this person: letters and digits")
    order: str = setting("written", "order of the blocks", choices=ORDERS)
    seed: int = setting(0, "seed of the order", within=(0, 2**63 - 1))
    blind: bool = setting(False, "whether the operator learns only the numbers of the blocks")
    rest: float = setting(60.0, "rest before each block, but for the first", "s", (0.0, 86_400.0))
    person: Person = Person()
    blocks: tuple[Block, ...] = ()  # as written
    file: Path = Path()
    text: str = ""

    @cached_property
    def ordered(self) -> list[Block]:
        """The blocks in the order in which this person has them."""
        number, count = self.person.number, len(self.blocks)
        places = block_order(
            self.order, count, seed=self.seed, person=number, session=self.session
        )
        return [self.blocks[place] for place in places]

    def shown(self, number: int) -> str:
        """Return what the operator learns of a block, from 1: its name or only its number."""
        return f"block {number}" if self.blind else self.ordered[number - 1].name

    @property
    def fingerprints(self) -> list[str]:
        """The SHA-256 of each block's protocol, as written."""
        texts = (write_protocol(block.protocol) for block in self.blocks)
        return [hashlib.sha256(text.encode()).hexdigest() for text in texts]


_LABELS = ("person.code", "session")
_REQUIRED = ("code", "mass", "leg_length")  # of a person
_Fields = dict[str, tuple[yaml.Node, str]]  # by name: value, and file with line
_Said = dict[str, tuple[object, str]]  # by field of a protocol: value, and file with line


def read_session(path: Path) -> Session:
    """Read and validate a session file; raises SessionError."""
    try:
        text = path.read_text(encoding="utf-8")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise SessionError(f"{path}: cannot be read: {reason}") from None
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "nested too deeply"
        raise SessionError(f"{path}{line}: not valid YAML: {problem}") from None
    if root is None:
        raise SessionError(f"{path}: empty; allowed: at least person and blocks")
    return _Reader(path, text).session(root)


@dataclass(frozen=True)
class _Piece:
    """Fields of a protocol: for read_protocol to take, and one by one."""

    source: Path | str | None
    said: _Said


def _said_in(root: Any, name: str) -> Iterator[tuple[str, tuple[object, str]]]:
    for key, value in root.value:
        inside = value.value if isinstance(value, yaml.MappingNode) else [(None, value)]
        for inner, item in inside:
            field = str(key.value) + (f".{inner.value}" if inner else "")
            where = f"{name}:{(inner or key).start_mark.line + 1}"
            value = yaml.SafeLoader("").construct_object(item, deep=True)
            if isinstance(item, yaml.SequenceNode) and field != "blocks":
                value = ", ".join(map(str, value))  # as read_protocol takes it
            yield field, (value, where)


class _Reader:
    def __init__(self, path: Path, text: str) -> None:
        self._path, self._text = path, text

    def session(self, root: yaml.Node) -> Session:
        own = settings_of(Session)
        given = self._fields(root, "a session", (*own, "person", "limits", "protocol", "blocks"))
        for needed in ("person", "blocks"):
            if needed not in given:
                raise SessionError(f"{self._path}: {needed}: missing; a session cannot do without")
        about = self._fields(given["person"][0], "person", settings_of(Person))
        for needed in _REQUIRED:
            if needed not in about:
                allowed = settings_of(Person)[needed].allowed
                raise SessionError(
                    f"{given['person'][1]}: person.{needed}: missing; allowed: {allowed}"
                )
        person = Person(**self._settings(Person, about, "person."))
        values = self._settings(Session, {n: v for n, v in given.items() if n in own}, "")
        limits: _Said = {}
        if "limits" in given:
            said = self._fields(given["limits"][0], "limits", settings_of(DeviceLimits))
            checked = self._settings(DeviceLimits, said, "limits.")
            limits = {f"limits.{n}": (v, said[n][1]) for n, v in checked.items()}
        common = _Piece(None, {})
        if "protocol" in given:
            common = self._piece(given["protocol"][0])
        told = {f"walker.{n}": (v, given["person"][1]) for n, v in person.walker.items()} | limits
        node, where = given["blocks"]
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise SessionError(f"{where}: blocks: must be a list of blocks, at least one")
        rest = values.get("rest", Session.rest)
        blocks = tuple(self._block(one, told, common, rest) for one in node.value)
        for number, block in enumerate(blocks):
            if block.name in (other.name for other in blocks[:number]):
                raise SessionError(f"{block.place}: name: {block.name}: appears twice; keep one")
        return Session(**values, person=person, blocks=blocks, file=self._path, text=self._text)

    def _block(self, node: yaml.Node, told: _Said, common: "_Piece", rest: float) -> Block:
        """Read a block; ``told`` is what follows from the person."""
        given = self._fields(node, "a block", ("name", "rest", "protocol"))
        place = self._where(node)
        values = self._settings(Block, {n: v for n, v in given.items() if n != "protocol"}, "")
        if "name" not in values:
            raise SessionError(f"{place}: name: missing; allowed: a plain name")
        own = self._piece(given["protocol"][0]) if "protocol" in given else _Piece(None, {})
        told = {"name": (values["name"], place), **told}
        over = {key: value for key, value in told.items() if key not in common.said} | own.said
        source = common.source
        if "blocks" in own.said:
            of_blocks = BLOCK_FIELDS.keys() - {"side"}
            if clash := next((key for key in common.said if key in of_blocks), ""):
                raise SessionError(
                    f"{common.said[clash][1]}: {clash}: does not go with the blocks that the "
                    f"protocol of {values['name']} has of its own; say it in them"
                )
            source, over = own.source, told | common.said
            over = {key: value for key, value in over.items() if key not in own.said}
        protocol = self._read(source, over, to_run=True)
        driver = find_driver(protocol.driver)
        if not driver.simulated and "limits.torque" not in told:
            raise SessionError(
                f"{place}: limits.torque: missing, and the driver {driver.name} applies real "
                "torque to a person; allowed: limits of the session, with the largest torque "
                "for this person [N m]"
            )
        return Block(values["name"], values.get("rest", rest), protocol, place)

    def _piece(self, node: yaml.Node) -> "_Piece":
        """Return what a part of the file, or the file that it names, says of a protocol."""
        source: Path | str
        if isinstance(node, yaml.ScalarNode):
            file = self._path.parent / node.value
            source, name = file, str(file)
            self._read(source, {})  # so that what is wrong by itself is told with its line
            root = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
        else:
            begin, end, root, name = node.start_mark, node.end_mark, node, str(self._path)
            # At its own place in the file, so that lines are those of the file.
            place = "\n" * begin.line + " " * begin.column
            source = place + self._text[begin.index : end.index] + "\n"
            self._read(source, {})
        said = dict(_said_in(root, name)) if root else {}
        for key, (_, where) in said.items():
            if key.startswith("limits."):
                raise SessionError(
                    f"{where}: {key}: limits are the person's; say them once, as limits of the "
                    "session"
                )
        return _Piece(source, said)

    def _read(self, source: Path | str | None, over: _Said, *, to_run: bool = False) -> Protocol:
        try:
            return read_protocol(source, over, to_run=to_run)
        except (ProtocolError, LimitError, DeviceError) as error:
            message = str(error)
            if message.startswith("protocol:") and not isinstance(source, Path):
                message = f"{self._path}{message.removeprefix('protocol')}"
            raise SessionError(message) from None

    def _settings(self, owner: Any, given: _Fields, prefix: str) -> dict[str, Any]:
        rules, values = settings_of(owner), {}
        for name, (node, where) in given.items():
            try:
                values[name] = _value(rules[name], prefix + name, node)
            except SettingError as error:
                raise SessionError(f"{where}: {error}") from None
        return values

    def _fields(self, node: yaml.Node, name: str, known: Any) -> _Fields:
        if not isinstance(node, yaml.MappingNode):
            raise SessionError(
                f"{self._where(node)}: {name} must be a mapping of fields to values"
            )
        found: _Fields = {}
        for key, value in node.value:
            where, field = self._where(key), str(key.value)
            if field not in known:
                raise SessionError(
                    f"{where}: {field}: unknown field of {name}; allowed: {', '.join(known)}"
                )
            if field in found:
                raise SessionError(f"{where}: {field}: appears twice; keep one")
            found[field] = value, where
        return found

    def _where(self, node: yaml.Node) -> str:
        return f"{self._path}:{node.start_mark.line + 1}"


def _value(rule: Setting, name: str, node: yaml.Node) -> Any:
    if not isinstance(node, yaml.ScalarNode):
        raise SettingError(f"{name}: must be a single value; allowed: {rule.allowed}")
    if rule.kind is not str:
        value = yaml.SafeLoader("").construct_object(node)
        return rule.parse(name, value) if isinstance(value, str) else rule.check(name, value)
    text = rule.check(name, node.value)
    if name in _LABELS and not (text.isascii() and text.isalnum()):
        raise SettingError(f"{name}: {text!r}; allowed: letters and digits")
    return text
