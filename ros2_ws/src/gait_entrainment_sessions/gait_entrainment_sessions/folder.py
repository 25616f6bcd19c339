# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The folder of a session: what was planned, what happened, and the key of a blinded one.

    STUDY/sub-P01/ses-1/session.yaml    the session file as it was when the session began
                        session.json    what a resumption has to match
                        key.json        only if blinded: which block is which
                        ledger.tsv      what happened, a line each; only ever appended to
                        bags/           a bag per run

Nothing is overwritten. A block that is repeated has another bag; the latest one that ended well
stands for it.
"""

import fcntl
import hashlib
import json
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from gait_entrainment_bags import BagReader
from gait_entrainment_sessions.session_file import Session, SessionError

KEY_HASH = "session_key"  # what a bag's custom data call it
PLAN = "session.json"
_KEY, _LEDGER, _COPY, _PART = "key.json", "ledger.tsv", "session.yaml", "session.part"


class Entry(NamedTuple):
    """A line of the ledger; ``what``: begun, done, failed, repeat, rest, pause, go on, note..."""

    time: str
    what: str
    block: str
    bag: str
    text: str


@dataclass(frozen=True)
class SessionFolder:
    """A session that was begun."""

    path: Path

    @classmethod
    def begin(cls, study: Path, session: Session) -> "SessionFolder":
        """
        Make the folder of a session in that of its study, or find it as this session left it.

        Raises SessionError if another session is there, or this one was changed meanwhile.
        """
        person = f"sub-{session.person.code}"
        folder = cls(study / person / f"ses-{session.session}")
        with _alone_in(study):
            if (folder.path / PLAN).exists():
                folder._check_same(session)
                return folder
            left = {file.name for file in folder.path.glob("*")}
            if left - {_KEY, _LEDGER, _COPY, _PART}:
                raise SessionError(
                    f"{folder.path}: holds something else; nothing is overwritten: give --out"
                )
            cls._check_number(study, session)
            for name in left:  # of a beginning that a crash cut short
                (folder.path / name).unlink()
            folder._begin(session)
        return folder

    def _begin(self, session: Session) -> None:
        """Write what was planned."""
        self.path.mkdir(parents=True, exist_ok=True)
        names = [block.name for block in session.ordered]
        key = self._seal(session, names) if session.blind else ""
        plan = {
            "study": session.study,
            "session": session.session,
            "person": asdict(session.person),
            "order": session.order,
            "seed": session.seed,
            "blind": session.blind,
            "count": len(names),
            "blocks": None if session.blind else names,
            "protocols": session.fingerprints,
            "key": key,
        }
        _write(self.path / _COPY, session.text)
        _write(self.path / _LEDGER, "\t".join(Entry._fields) + "\n")
        # The last of all, and at once: without it the session has not begun.
        _write(self.path / _PART, json.dumps(plan, indent=1) + "\n")
        (self.path / _PART).rename(self.path / PLAN)

    @cached_property
    def plan(self) -> dict[str, Any]:
        """What was planned; raises SessionError if this is no session."""
        try:
            return dict(json.loads((self.path / PLAN).read_text(encoding="utf-8")))
        except (OSError, ValueError):
            raise SessionError(f"{self.path}: no session: no readable {PLAN} in it") from None

    @property
    def ledger(self) -> list[Entry]:
        """What happened so far."""
        text = (self.path / _LEDGER).read_text(encoding="utf-8", errors="replace")
        lines = text.splitlines()[1:]
        # A line that a crash cut short says nothing.
        entries = (line.split("\t") for line in lines)
        return [Entry(*cells) for cells in entries if len(cells) == len(Entry._fields)]

    def note(self, what: str, block: int = 0, bag: str = "", text: str = "") -> None:
        """Append a line to the ledger, safe on the disk when this returns."""
        now = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
        cells = (now, what, str(block or ""), bag, " ".join(text.split()))
        ledger = self.path / _LEDGER
        broken = ledger.read_bytes()[-1:] != b"\n"
        with ledger.open("a", encoding="utf-8") as file:
            file.write("\n" * broken + "\t".join(cells) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def runs(self) -> dict[int, Path]:
        """Return the bag that stands for each block that is done."""
        ledger = self.ledger
        repeated = {entry.bag for entry in ledger if entry.what == "repeat"}
        done = {
            int(entry.block): self.path / "bags" / entry.bag
            for entry in ledger
            if entry.what == "done" and entry.bag not in repeated
        }
        return dict(sorted(done.items()))

    def repeat(self, reason: str, block: int = 0) -> int:
        """
        Have a block that is done walked again, or the one that was begun last; return its number.

        Raises SessionError if there is no such block, it failed, or it is to be repeated already.
        """
        ledger, done = self.ledger, self.runs()
        begun = [entry for entry in ledger if entry.what == "begun"]
        if block:
            bag = done[block].name if block in done else ""
        else:
            block, bag = (int(begun[-1].block), begun[-1].bag) if begun else (0, "")
        ended = {entry.bag for entry in ledger if entry.what in ("failed", "repeat")}
        if not bag or bag in ended:
            allowed = ", ".join(map(str, done)) or "none yet"
            what = f"block {block} is not done" if block else "no block has begun"
            raise SessionError(f"repeat: {what}; allowed: {allowed}")
        if not reason:
            raise SessionError("repeat: a repetition needs a reason")
        self.note("repeat", block, bag, reason)
        return block

    @property
    def paused(self) -> str | None:
        """Why the operator has the session wait before its next block; None if it goes on."""
        last = self._last("pause", "go on")
        return last.text if last is not None and last.what == "pause" else None

    def standing(self) -> str:
        """Return how the session stands, in words."""
        last, paused = self._last("begun", "done", "failed", "rest"), self.paused
        goes_on = last is not None and last.what == "begun"
        number = int(last.block) if last is not None and goes_on else self.next_block()
        name = f"block {number} of {self.plan['count']}" if number else "the end"
        if number and not self.plan["blind"]:
            name += f" ({self.plan['blocks'][number - 1]})"
        if goes_on:
            return name if paused is None else f"{name}, then a pause: {paused}"
        if paused is not None:
            return f"paused before {name}: {paused}"
        if last is not None and last.what == "rest":
            passed = datetime.now(timezone.utc) - datetime.fromisoformat(last.time)
            rest = float(last.text.split()[0])
            left = min(max(rest - passed.total_seconds(), 0), rest)  # the clock may be set back
            return f"rest before {name}: {left:.0f} s"
        return f"next: {name}"

    def _last(self, *what: str) -> Entry | None:
        return next((entry for entry in reversed(self.ledger) if entry.what in what), None)

    def next_block(self) -> int | None:
        """Return the first block, from 1, that is not done; None if all are."""
        left = set(range(1, int(self.plan["count"]) + 1)) - self.runs().keys()
        return min(left, default=None)

    def new_bag(self, block: int) -> Path:
        """Return where the next run of a block is recorded."""
        path, number = self.path / "bags" / f"block-{block:02d}", 1
        while path.exists():
            number += 1
            path = path.with_name(f"block-{block:02d}_run-{number}")
        return path

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other processes from conducting this session; SessionError if one does."""
        with (self.path / _LEDGER).open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise SessionError(
                    f"{self.path}: another entrain session conducts it; end that one first"
                ) from None
            yield

    @property
    def sealed(self) -> bool:
        """Whether it is not to be told yet which block is which."""
        return self.plan["blind"] and all(entry.what != "unblinded" for entry in self.ledger)

    def names(self) -> list[str]:
        """Return the names of the blocks in their order; neutral ones while it is sealed."""
        if self.sealed:
            return [f"block {number + 1}" for number in range(self.plan["count"])]
        return list(self._key()["blocks"] if self.plan["blind"] else self.plan["blocks"])

    def unblind(self) -> list[str]:
        """
        Break the seal; return the names of the blocks in their order.

        Raises SessionError if it is not blinded, or the key is not the one that each bag names.
        """
        if not self.plan["blind"]:
            raise SessionError(f"{self.path}: not blinded: {PLAN} says which block is which")
        names = list(self._key()["blocks"])
        if self.sealed:
            self.note("unblinded")
        return names

    def _key(self) -> dict[str, Any]:
        key = self.path / _KEY
        try:
            data = key.read_bytes()
        except OSError as error:
            raise SessionError(f"{key}: cannot be read: {error.strerror}") from None
        found, told = hashlib.sha256(data).hexdigest(), {str(self.path / PLAN): self.plan["key"]}
        for bag in self.runs().values():
            with BagReader(bag) as reader:
                told[str(bag)] = reader.custom_data.get(KEY_HASH, "")
        for place, expected in told.items():
            if found != expected:
                raise SessionError(
                    f"{key}: its SHA-256 is {found[:12]}..., not {expected[:12] or 'any'}... as "
                    f"{place} says; allowed: the key as it was sealed"
                )
        return dict(json.loads(data))

    def _seal(self, session: Session, names: list[str]) -> str:
        """Write the key, which nobody can guess from its hash; return that."""
        key = {
            "person": session.person.code,
            "session": session.session,
            "blocks": names,
            "nonce": secrets.token_hex(32),
        }
        text = json.dumps(key, indent=1) + "\n"
        _write(self.path / _KEY, text)
        (self.path / _KEY).chmod(0o400)
        return hashlib.sha256(text.encode()).hexdigest()

    @classmethod
    def _check_number(cls, study: Path, session: Session) -> None:
        """Raise SessionError if another person has this number: orders would not be balanced."""
        for file in sorted(study.glob(f"sub-*/ses-*/{PLAN}")):
            other, person = cls(file.parent).plan["person"], session.person
            if (other["code"] == person.code) != (other["number"] == person.number):
                raise SessionError(
                    f"{session.file}: person.number: {person.number} of {person.code}; allowed: "
                    f"one number for each person, and {other['code']} has {other['number']}"
                )

    def _check_same(self, session: Session) -> None:
        copy = self.path / _COPY
        why = "allowed: no change in a session that was begun; another needs another label"
        then, now = copy.read_text(encoding="utf-8").splitlines(), session.text.splitlines()
        for line, (old, new) in enumerate(zip_longest(then, now, fillvalue=""), start=1):
            if old != new:
                field = (new or old).strip(" -{").partition(":")[0][:40]
                raise SessionError(
                    f"{session.file}:{line}: {field}: {new.strip()[:60]!r} was "
                    f"{old.strip()[:60]!r} when the session began ({copy}); {why}"
                )
        pairs = zip(session.blocks, session.fingerprints, self.plan["protocols"], strict=True)
        for block, found, expected in pairs:
            if found != expected:
                raise SessionError(
                    f"{block.place}: protocol: that of {block.name} is not what it was when the "
                    f"session began, by its file or by another version of this program; {why}"
                )


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Let no other process begin a session in the folder of a study meanwhile."""
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _write(path: Path, text: str) -> None:
    """Write a new file, safe on the disk when this returns."""
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
