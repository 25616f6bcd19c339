# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A study's folder as a BIDS data set (bids.neuroimaging.io) with Motion-BIDS, as far as possible.

BIDS covers joint angles (motion) and events, but not strides, pulses, blocks and bags, which
``.bidsignore`` therefore excludes. No joint angles are recorded from a person, so a session with
one has only events.
"""

import json
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds_of
from gait_entrainment_bags import BagReader
from gait_entrainment_bags.topic_names import JOINT_STATES
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.runs import PlacedRun, read_runs, sessions_in
from gait_entrainment_sessions.tables import (
    TABLES,
    Column,
    rows_of,
    write_sidecar,
    write_tables,
    write_tsv,
)

_VERSION = "1.10.0"
_TASK = "entrainment"
_IGNORED = "**/bags/**\nbags\nsub-*/ses-*/*.*\n*.html\ntables\n"
_README = """A study with a robot at one ankle that delivers torque pulses near the stride period.

sub-*/ses-*/motion holds joint angles and events in Motion-BIDS. Next to it, outside BIDS: bags
(MCAP) with everything that was recorded, the session's tables of events, strides, pulses and
blocks, and its log, ledger.tsv. Written by gait_entrainment, an open testbed.
"""
_PARTICIPANTS = (
    Column("participant_id", "code of the person"),
    Column("number", "number of the person in the study, which decides the order of blocks"),
    Column("mass", "mass", "kg"),
    Column("leg_length", "leg length", "m"),
)
_CHANNELS = "name\tcomponent\ttype\ttracked_point\tunits\n"


def complete(folder: SessionFolder) -> list[Path]:
    """
    Write what is derived from a session's bags: its tables, and its part of the data set.

    Existing files are replaced. Returns the paths of the tables.
    """
    runs = list(read_runs(folder.path))
    for placed in runs:
        _write_motion(folder.path / "motion", placed)
    _describe(folder.path.resolve().parents[1])
    return write_tables(runs, folder.path)


def _describe(study: Path) -> None:
    """Write the data set's description and its list of persons."""
    plans = [folder.plan for folder in sessions_in(study)]
    about = {
        "Name": plans[0]["study"],
        "BIDSVersion": _VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "gait_entrainment"}],
    }
    (study / "dataset_description.json").write_text(json.dumps(about, indent=1) + "\n")
    (study / "README").write_text(_README)
    (study / ".bidsignore").write_text(_IGNORED)
    persons = {plan["person"]["code"]: plan["person"] for plan in plans}
    rows = [(f"sub-{code}", *list(p.values())[1:]) for code, p in sorted(persons.items())]
    write_tsv(study / "participants.tsv", _PARTICIPANTS, rows)
    write_sidecar(study / "participants.json", _PARTICIPANTS)
    write_sidecar(study / f"task-{_TASK}_events.json", TABLES["events"])


def _write_motion(out: Path, placed: PlacedRun) -> None:
    place = placed.place
    angles, names = _joint_angles(place.bag, placed.start)
    stem = f"sub-{place.person}_ses-{place.session}_task-{_TASK}"
    run = f"run-{place.block:02d}"
    out.mkdir(exist_ok=True)
    write_tsv(out / f"{stem}_{run}_events.tsv", TABLES["events"], rows_of(placed, "events"))
    if len(angles) < 2:
        return
    stem += f"_tracksys-walker_{run}"
    with (out / f"{stem}_motion.tsv").open("w") as file:
        file.writelines("\t".join(map(repr, row)) + "\n" for row in angles)
    channels = [("latency", "n/a", "LATENCY", "n/a", "s")]
    channels += [(name, "y", "JNTANG", name, "rad") for name in names]
    text = _CHANNELS + "".join("\t".join(channel) + "\n" for channel in channels)
    (out / f"{stem}_channels.tsv").write_text(text)
    about: dict[str, Any] = {
        "TaskName": _TASK,
        "TaskDescription": "walking under torque pulses at one ankle",
        "SamplingFrequency": round((len(angles) - 1) / (angles[-1][0] - angles[0][0]), 6),
        "TrackingSystemName": "simulated walker",
        "MotionChannelCount": len(channels),
        "JNTANGChannelCount": len(names),
        "LATENCYChannelCount": 1,
        "MissingValues": "n/a",
    }
    (out / f"{stem}_motion.json").write_text(json.dumps(about, indent=1) + "\n")


def _joint_angles(bag: Path, start: int) -> tuple[list[tuple[float, ...]], list[str]]:
    """Return each sample's time [s] and joint angles [rad], and the names of the joints."""
    rows, names = [], list[str]()
    with BagReader(bag) as reader:
        for message in reader.messages_of(JOINT_STATES):
            names = list(message.name)
            stamp = nanoseconds_of(message.header.stamp) - start
            rows.append((stamp / NANOSECONDS_PER_SECOND, *message.position))
    return rows, names
