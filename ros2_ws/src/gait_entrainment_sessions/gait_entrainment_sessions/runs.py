# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The recorded runs in a folder: a bag, a session, a study, or bags without a session."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from gait_entrainment.conventions import Side
from gait_entrainment.robot import PulseTiming
from gait_entrainment.run import JudgedBlock, Run
from gait_entrainment_bags import BagError
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_sessions.folder import PLAN, SessionFolder


@dataclass(frozen=True)
class Place:
    """Where a run is stored, and which person and block it belongs to."""

    bag: Path
    study: str = ""
    person: str = ""
    session: str = ""
    block: int = 1  # its place in the session, from 1
    name: str = ""  # of the block; neutral while the session is sealed
    folder: SessionFolder | None = None

    @property
    def sealed(self) -> bool:
        """Whether anything that identifies the block must stay hidden."""
        return self.folder is not None and self.folder.sealed


@dataclass(frozen=True)
class PlacedRun:
    """A run, simulated or recorded, and where it belongs."""

    place: Place
    run: Run

    @property
    def start(self) -> int:
        """The stamp from which its tables count [ns]."""
        first = [s.start for s in self.run.strides[:1]] or [e.stamp for e in self.run.events]
        return min(first, default=0)

    @cached_property
    def timings(self) -> dict[int, PulseTiming]:
        """The pulses by onset [ns], under both the commanded and the measured one."""
        return {
            at: timing for timing in self.run.timings for at in (timing.onset, timing.commanded)
        }

    @property
    def parts(self) -> tuple[JudgedBlock, ...]:
        """The blocks of its protocol, each judged separately; without blocks, the whole run."""
        run, strides = self.run, self.run.strides
        side, end = (strides[-1].side, strides[-1].end) if strides else (Side.RIGHT, math.inf)
        periods = run.measured_period, run.pulse_period
        return run.blocks or (JudgedBlock("", side, 1, None, end, *periods, run.analysis),)


def is_sealed(bag: Path) -> bool:
    """Whether a bag, or a file of it, belongs to a session that is still sealed."""
    folder = _session_around(bag)
    return folder is not None and folder.sealed


def sessions_in(path: Path) -> list[SessionFolder]:
    """Return the sessions in a folder, which may itself be one."""
    found = sorted(path.rglob(PLAN)) if path.is_dir() else []
    return [SessionFolder(file.parent) for file in found]


def _session_around(path: Path) -> SessionFolder | None:
    """Return the session that contains a path, if any."""
    around = (parent for parent in path.resolve().parents if (parent / PLAN).exists())
    return next(map(SessionFolder, around), None)


def places_in(path: Path) -> list[Place]:
    """
    Return the runs of a bag, a session, a study or a folder of bags, in order.

    Of a session, only the runs that count for its blocks. Raises BagError if there are no runs.
    """
    sessions = sessions_in(path)
    places = [place for folder in sessions for place in _of_session(folder)]
    if not sessions:
        is_bag = path.is_file() or (path / "metadata.yaml").exists() or any(path.glob("*.mcap"))
        bags = [path] if is_bag else sorted(f.parent for f in path.rglob("metadata.yaml"))
        places = [
            Place(bag, name=bag.stem, block=n, folder=_session_around(bag))
            for n, bag in enumerate(bags, start=1)
        ]
    if not places:
        why = "no block is done yet" if sessions else "give a bag, a session, or a folder of them"
        raise BagError(f"{path}: no recorded run; {why}")
    return places


def read_runs(path: Path) -> Iterator[PlacedRun]:
    """Yield the runs of places_in one by one, without the torques, which only figures show."""
    for place in places_in(path):
        yield PlacedRun(place, read_run(place.bag, torques=False))


def _of_session(folder: SessionFolder) -> Iterator[Place]:
    plan, names = folder.plan, folder.names()
    for block, bag in folder.runs().items():
        yield Place(
            bag=bag,
            study=plan["study"],
            person=plan["person"]["code"],
            session=plan["session"],
            block=block,
            name=names[block - 1],
            folder=folder,
        )
