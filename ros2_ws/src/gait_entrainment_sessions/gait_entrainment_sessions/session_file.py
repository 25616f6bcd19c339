# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Session files: read YAML into a validated Session; errors give the line of the mistake.

    study: ankle_pilot
    session: "1"
    person: {code: P01, number: 1, mass: 72, leg_length: 0.91}
    limits: {torque: 15}                     # the person's, in every block
    order: balanced                          # or written, permuted
    protocol: {side: left, pulses: {count: 50}}        # common to all blocks: fields or a file
    blocks:
      - {name: faster, protocol: {pulses: {period_offset: -0.05}}}
      - {name: slower, protocol: slower.yaml, rest: 120}

A block's fields replace the common ones; either of ``period`` and ``period_offset`` also replaces
the other. The walker has the person's mass and leg length, in the paper's proportions.
"""

import hashlib
from dataclasses import dataclass, replace
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
from gait_entrainment.protocol.reader import Entry, composed, entries_in, value_of
from gait_entrainment.robot import DeviceError, DeviceLimits, Dose, LimitError, find_driver
from gait_entrainment.settings import Setting, setting, settings_of
from gait_entrainment_sessions.order import ORDERS, block_order


class SessionError(UsageError):
    """A session that cannot be conducted; one line with file, line, field and what is allowed."""


@dataclass(frozen=True)
class Person:
    """The person in the session, with nothing that identifies them to others."""

    code: str = setting("", "code of the person, not a name: letters and digits")
    number: int = setting(1, "number of the person in the study, for the order", within=(1, 10**6))
    mass: float = setting(WalkerParameters.mass, "mass", "kg", (5.0, 500.0))
    leg_length: float = setting(WalkerParameters.leg_length, "leg length", "m", (0.2, 2.0))

    @property
    def walker(self) -> dict[str, float]:
        """The walker of this size: the paper's, with foot and stiffness in proportion."""
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

    name: str = setting("", "name of the block, unique in the session", plain=True)
    rest: float = setting(60.0, "rest before the block, except the first", "s", (0.0, 86_400.0))
    protocol: Protocol = DEFAULT_PROTOCOL
    place: str = ""  # file and line


@dataclass(frozen=True)
class Session:
    """A complete session."""

    study: str = setting("study", "name of the study", plain=True)
    session: str = setting("1", "label of the person's session: letters and digits")
    order: str = setting("written", "order of the blocks", choices=ORDERS)
    seed: int = setting(0, "seed of the order", within=(0, 2**63 - 1))
    blind: bool = setting(False, "whether the operator sees only the numbers of the blocks")
    rest: float = setting(60.0, "rest before each block, except the first", "s", (0.0, 86_400.0))
    person: Person = Person()
    blocks: tuple[Block, ...] = ()  # as written
    file: Path = Path()
    text: str = ""

    @cached_property
    def ordered(self) -> list[Block]:
        """The blocks in this person's order."""
        number, count = self.person.number, len(self.blocks)
        places = block_order(
            self.order, count, seed=self.seed, person=number, session=self.session
        )
        return [self.blocks[place] for place in places]

    def shown(self, number: int) -> str:
        """Return what the operator sees of a block, counted from 1: its name or its number."""
        return f"block {number}" if self.blind else self.ordered[number - 1].name

    @property
    def fingerprints(self) -> list[str]:
        """The SHA-256 of each block's protocol, as written."""
        texts = (write_protocol(block.protocol) for block in self.blocks)
        return [hashlib.sha256(text.encode()).hexdigest() for text in texts]


_LABELS = ("person.code", "session")
_REQUIRED = ("person.code", "person.mass", "person.leg_length")
_PART = Setting("a part of the file", yaml.Node)
_SECTIONS = {"person": Person, "limits": DeviceLimits}
_FIELDS = settings_of(Session) | {"protocol": _PART, "blocks": _PART}
for _section, _kind in _SECTIONS.items():
    _FIELDS |= {f"{_section}.{name}": rule for name, rule in settings_of(_kind).items()}
_BLOCK_FIELDS = settings_of(Block) | {"protocol": _PART}
_Entries = dict[str, Entry]  # by field


def read_session(path: Path) -> Session:
    """Read and validate a session file; raises SessionError."""
    try:
        _, text, root = composed(path)
        if root is None:
            raise SessionError(f"{path}: empty; allowed: at least person and blocks")
        return replace(_Reader(path).session(root), text=text)
    except (ProtocolError, LimitError, DeviceError) as error:
        raise SessionError(str(error)) from None


class _Reader:
    def __init__(self, path: Path) -> None:
        self._path = path

    def session(self, root: yaml.Node) -> Session:
        given = dict(entries_in(root, str(self._path), _FIELDS))
        about = [entry.where for key, entry in given.items() if key.startswith("person.")]
        for needed, found in ("person", about), ("blocks", "blocks" in given):
            if not found:
                raise SessionError(f"{self._path}: {needed}: missing; every session needs it")
        for needed in _REQUIRED:
            if needed not in given:
                allowed = _FIELDS[needed].allowed
                raise SessionError(f"{about[0]}: {needed}: missing; allowed: {allowed}")
        values = _values(given, _FIELDS)
        for name in _LABELS:
            if not (text := str(values.get(name, "1"))).isascii() or not text.isalnum():
                where = given[name].where
                raise SessionError(f"{where}: {name}: {text!r}; allowed: letters and digits")
        own = {name: value for name, value in values.items() if "." not in name}
        section = "person."
        person = Person(**{k.removeprefix(section): v for k, v in values.items() if section in k})
        fixed = {f"walker.{n}": Entry(v, about[0]) for n, v in person.walker.items()}
        fixed |= {key: entry for key, entry in given.items() if key.startswith("limits.")}
        common = self._protocol(given)
        node, where = given["blocks"]
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise SessionError(f"{where}: blocks: must be a list of blocks, at least one")
        rest = values.get("rest", Session.rest)
        blocks = tuple(self._block(item, fixed, common, rest) for item in node.value)
        for number, block in enumerate(blocks):
            if block.name in (other.name for other in blocks[:number]):
                raise SessionError(f"{block.place}: name: {block.name}: appears twice; keep one")
        doses = [block.protocol.dose for block in blocks]
        total = Dose(sum(dose.pulses for dose in doses), sum(dose.impulse for dose in doses))
        try:
            blocks[0].protocol.limits.check_dose(total, ())
        except LimitError as error:
            place = given[f"limits.{str(error).partition(':')[0]}"].where
            raise SessionError(f"{place}: limits.{error}") from None
        return Session(**own, person=person, blocks=blocks, file=self._path)

    def _block(self, node: yaml.Node, fixed: _Entries, common: _Entries, rest: float) -> Block:
        """Read a block; ``fixed`` is what follows from the person."""
        place = f"{self._path}:{node.start_mark.line + 1}"
        given = dict(entries_in(node, str(self._path), _BLOCK_FIELDS))
        values = {"rest": rest} | _values(given, _BLOCK_FIELDS)
        if "name" not in values:
            raise SessionError(f"{place}: name: missing; allowed: a plain name")
        own = self._protocol(given)
        fixed = {"name": Entry(values["name"], place), **fixed}
        over = {key: value for key, value in fixed.items() if key not in common} | own
        source = common
        if "blocks" in own:
            of_blocks = BLOCK_FIELDS.keys() - {"side"}
            if clash := next((key for key in common if key in of_blocks), ""):
                raise SessionError(
                    f"{common[clash].where}: {clash}: does not go with the blocks within the "
                    f"protocol of {values['name']}; give it in those blocks"
                )
            source, over = own, fixed | common
            over = {key: value for key, value in over.items() if key not in own}
        protocol = read_protocol(source, over, to_run=True)
        driver = find_driver(protocol.driver)
        if not driver.simulated and "limits.torque" not in fixed:
            raise SessionError(
                f"{place}: limits.torque: missing, and the driver {driver.name} applies real "
                "torque to a person; allowed: limits in the session, with the largest torque "
                "for this person [N m]"
            )
        return Block(**values, protocol=protocol, place=place)

    def _protocol(self, given: _Entries) -> _Entries:
        """Return the fields of the protocol, given in the file itself or in one that it names."""
        node: Any = given["protocol"].value if "protocol" in given else None
        name = str(self._path)
        if isinstance(node, yaml.ScalarNode):
            name, _, node = composed(self._path.parent / node.value)
        entries = dict(entries_in(node, name)) if node else {}
        read_protocol(entries)  # reports a mistake in the protocol itself with its own line
        for key, (_, where) in entries.items():
            if key.startswith("limits."):
                raise SessionError(
                    f"{where}: {key}: limits belong to the person; give them once, as limits of "
                    "the session"
                )
        return entries


def _values(entries: _Entries, rules: dict[str, Setting]) -> dict[str, Any]:
    """Return the values of the entries, without the parts of the file."""
    return {k: value_of(rules[k], k, e) for k, e in entries.items() if rules[k] is not _PART}
