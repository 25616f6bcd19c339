# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The folder of a session: its plan, its ledger, its bags, and its key if it is blinded.

    STUDY/sub-P01/ses-1/session.yaml    the session file as it was when the session began
                        session.json    the plan, which must match when the session is resumed
                        key.json        only if blinded: which block is which
                        ledger.tsv      what happened, one line each; only ever appended to
                        bags/           one bag per run

Nothing is overwritten: a repeated block gets another bag, and the latest that ended well counts.
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

KEY_HASH = "session_key"  # its name in a bag's custom data
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
    """A session that has started."""

    path: Path

    @classmethod
    def begin(cls, study: Path, session: Session) -> "SessionFolder":
        """
        Create a session's folder in its study's folder, or return it if the session has started.

        Raises SessionError if the folder holds something else, the session was changed since it
        started, or the person's number is not unique.
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
                    f"{folder.path}: holds something else, and nothing is overwritten; give --out"
                )
            cls._check_number(study, session)
            for name in left:  # files of a start that a crash cut short
                (folder.path / name).unlink()
            folder._begin(session)
        return folder

    def _begin(self, session: Session) -> None:
        """Write the plan, the session file, the empty ledger and, if blinded, the key."""
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
        # Written last, and atomically: without it the session has not started.
        _write(self.path / _PART, json.dumps(plan, indent=1) + "\n")
        (self.path / _PART).rename(self.path / PLAN)

    @cached_property
    def plan(self) -> dict[str, Any]:
        """The plan; raises SessionError if this is not a session."""
        try:
            return dict(json.loads((self.path / PLAN).read_text(encoding="utf-8")))
        except (OSError, ValueError):
            raise SessionError(f"{self.path}: not a session: no readable {PLAN} in it") from None

    @property
    def ledger(self) -> list[Entry]:
        """What has happened so far."""
        text = (self.path / _LEDGER).read_text(encoding="utf-8", errors="replace")
        lines = text.splitlines()[1:]
        # A line that a crash cut short is ignored.
        entries = (line.split("\t") for line in lines)
        return [Entry(*cells) for cells in entries if len(cells) == len(Entry._fields)]

    def note(self, what: str, block: int = 0, bag: str = "", text: str = "") -> None:
        """Append a line to the ledger; it is safely on disk when this returns."""
        now = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
        cells = (now, what, str(block or ""), bag, " ".join(text.split()))
        ledger = self.path / _LEDGER
        broken = ledger.read_bytes()[-1:] != b"\n"
        with ledger.open("a", encoding="utf-8") as file:
            file.write("\n" * broken + "\t".join(cells) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def runs(self) -> dict[int, Path]:
        """Return the bag that counts for each block that is done."""
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
        Have a completed block, or the one started last, walked again; return its number.

        Raises SessionError if there is no such block, it failed, or it is already to be repeated.
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
            what = f"block {block} is not done" if block else "no block has started"
            raise SessionError(f"repeat: {what}; allowed: {allowed}")
        if not reason:
            raise SessionError("repeat: a repetition needs a reason")
        self.note("repeat", block, bag, reason)
        return block

    @property
    def paused(self) -> str | None:
        """Why the operator paused the session before its next block; None if it is not paused."""
        last = self._last("pause", "go on")
        return last.text if last is not None and last.what == "pause" else None

    def standing(self) -> str:
        """Return the state of the session, as text."""
        last, paused = self._last("begun", "done", "failed", "rest"), self.paused
        running = last is not None and last.what == "begun"
        number = int(last.block) if last is not None and running else self.next_block()
        name = f"block {number} of {self.plan['count']}" if number else "the end"
        if number and not self.plan["blind"]:
            name += f" ({self.plan['blocks'][number - 1]})"
        if running:
            return name if paused is None else f"{name}, then a pause: {paused}"
        if paused is not None:
            return f"paused before {name}: {paused}"
        if last is not None and last.what == "rest":
            passed = datetime.now(timezone.utc) - datetime.fromisoformat(last.time)
            rest = float(last.text.split()[0])
            left = min(max(rest - passed.total_seconds(), 0), rest)  # a clock may be set back
            return f"rest before {name}: {left:.0f} s"
        return f"next: {name}"

    def _last(self, *what: str) -> Entry | None:
        return next((entry for entry in reversed(self.ledger) if entry.what in what), None)

    def next_block(self) -> int | None:
        """Return the first block, from 1, that is not done; None if all are."""
        left = set(range(1, int(self.plan["count"]) + 1)) - self.runs().keys()
        return min(left, default=None)

    def new_bag(self, block: int) -> Path:
        """Return the path of the bag for the next run of a block."""
        path, number = self.path / "bags" / f"block-{block:02d}", 1
        while path.exists():
            number += 1
            path = path.with_name(f"block-{block:02d}_run-{number}")
        return path

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other processes from conducting this session; SessionError if one already does."""
        with (self.path / _LEDGER).open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise SessionError(
                    f"{self.path}: another entrain session is conducting it; end that one first"
                ) from None
            yield

    @property
    def sealed(self) -> bool:
        """Whether it must stay hidden which block is which."""
        return self.plan["blind"] and all(entry.what != "unblinded" for entry in self.ledger)

    def names(self) -> list[str]:
        """Return the blocks' names in order; neutral ones while the session is sealed."""
        if self.sealed:
            return [f"block {number + 1}" for number in range(self.plan["count"])]
        return list(self._key()["blocks"] if self.plan["blind"] else self.plan["blocks"])

    def unblind(self) -> list[str]:
        """
        Break the seal; return the blocks' names in order.

        Raises SessionError if the session is not blinded, or the key does not match every bag.
        """
        if not self.plan["blind"]:
            raise SessionError(f"{self.path}: not blinded: {PLAN} names the blocks")
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
        found, hashes = hashlib.sha256(data).hexdigest(), {str(self.path / PLAN): self.plan["key"]}
        for bag in self.runs().values():
            with BagReader(bag) as reader:
                hashes[str(bag)] = reader.custom_data.get(KEY_HASH, "")
        for place, expected in hashes.items():
            if found != expected:
                raise SessionError(
                    f"{key}: its SHA-256 starts with {found[:12]}, but {place} has "
                    f"{expected[:12] or 'none'}; allowed: the key as it was sealed"
                )
        return dict(json.loads(data))

    def _seal(self, session: Session, names: list[str]) -> str:
        """Write the key, which cannot be guessed from its hash; return the hash."""
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
        """Raise SessionError if another person has this number, which would unbalance orders."""
        for file in sorted(study.glob(f"sub-*/ses-*/{PLAN}")):
            other, person = cls(file.parent).plan["person"], session.person
            if (other["code"] == person.code) != (other["number"] == person.number):
                raise SessionError(
                    f"{session.file}: person.number: {person.number} of {person.code}; allowed: "
                    f"one number for each person, and {other['code']} has {other['number']}"
                )

    def _check_same(self, session: Session) -> None:
        copy = self.path / _COPY
        why = "allowed: no change to a session that has started; give a new session a new label"
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
                    f"session began: its file or the version of this program has changed; {why}"
                )


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Keep other processes from starting a session in the folder of a study."""
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _write(path: Path, text: str) -> None:
    """Write a new file; it is safely on disk when this returns."""
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
