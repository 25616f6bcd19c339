# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A session run by nodes: killed, resumed, valid as BIDS, unblinded."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from harness import TIMEOUT

from gait_entrainment_bags import BagReader
from gait_entrainment_sessions.folder import SessionFolder

EXAMPLE = Path(__file__).parents[2] / "examples/sessions/blinded_sham.yaml"
FOLDER = "sub-P03/ses-1"


def shortened(folder):
    """Write the blinded example, with few strides, into a folder; return its path."""
    text = EXAMPLE.read_text().replace("count: 50", "count: 4").replace("side: left", "washout: 1")
    path = folder / "session.yaml"
    path.write_text(re.sub("washout: 1", "washout: 1\n  baseline: 3", text))
    return path


def entrain(*words, **more):
    command = ["entrain", *map(str, words)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more
    )


def ended(process):
    out, err = process.communicate(timeout=TIMEOUT)
    return process.returncode, out, err


@pytest.fixture(scope="module")
def conducted(tmp_path_factory):
    """Return the folder of a session whose process was killed in its first block, then resumed."""
    short = shortened(tmp_path_factory.mktemp("session"))
    study = short.parent / "study"
    first = entrain("session", short, "--out", study, stdin=subprocess.DEVNULL)
    assert first.stdout.readline().startswith("block 1 of 2")
    first.kill()
    first.communicate(timeout=TIMEOUT)
    code, out, err = ended(entrain("session", short, "--out", study, stdin=subprocess.DEVNULL))
    assert (code, err) == (0, "")
    assert f"session          {study / FOLDER}" in out
    return SessionFolder(study / FOLDER)


def test_a_killed_session_is_resumed_at_its_block(conducted):
    steps = [(entry.what, entry.block) for entry in conducted.ledger]
    assert steps == [("begun", "1"), ("begun", "1"), ("done", "1"), ("begun", "2"), ("done", "2")]
    assert list(conducted.runs()) == [1, 2]


def test_bags_name_the_session_key_and_not_the_block(conducted):
    for number, bag in conducted.runs().items():
        with BagReader(bag) as reader:
            data = reader.custom_data
        assert (data["person"], data["block_name"]) == ("P03", f"block {number}")
        assert data["session_key"] == conducted.plan["key"]
        assert not re.search(
            "sham|name: pulses", " ".join(data.values()).replace("blinded_sham", "")
        )


def test_the_folder_is_a_valid_bids_dataset(conducted):
    command = ["bids-validator-deno", "--format", "json", str(conducted.path.parents[1])]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIMEOUT)
    issues = json.loads(done.stdout)["issues"]["issues"]
    errors = [issue for issue in issues if issue["severity"] == "error"]
    assert errors == []
    assert len(list(conducted.path.glob("motion/*_motion.tsv"))) == 2


def test_a_sealed_session_is_unblinded_on_request(conducted):
    assert "block 2" in (conducted.path / "strides.tsv").read_text()
    for name in ("pulses", "blocks"):  # lags and verdicts
        assert len((conducted.path / f"{name}.tsv").read_text().splitlines()) == 1
    code, out, err = ended(entrain("session", "unblind", conducted.path))
    assert (code, err) == (0, "")
    names = [line.split()[-1] for line in out.splitlines() if line.startswith("block ")]
    assert sorted(names) == ["pulses", "sham"]
    rows = (conducted.path / "blocks.tsv").read_text().splitlines()[1:]
    assert [row.split("\t")[3] for row in rows] == names


def test_tables_of_a_whole_study_are_exported(conducted, tmp_path):
    words = ("session", "export", conducted.path.parents[1], "--out", tmp_path)
    code, out, err = ended(entrain(*words, "--format", "parquet"))
    assert (code, err) == (0, "")
    assert out.count("table ") == len(list(tmp_path.glob("*.parquet"))) == 4
