# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Tables of runs contain what the analysis found, with units, and words instead of numbers."""

import csv
import json
import math
import re
from dataclasses import replace
from itertools import groupby

import pytest
from pyarrow import parquet

from gait_entrainment.protocol import read_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_sessions.findings import Findings, StudyFindings
from gait_entrainment_sessions.report import page
from gait_entrainment_sessions.report.checks import checks_of
from gait_entrainment_sessions.runs import Place, PlacedRun, is_sealed, places_in, read_runs
from gait_entrainment_sessions.tables import TABLES, write_tables


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


@pytest.fixture(scope="module")
def bag(request):
    return request.path.parents[4] / "bags/paper_example"


def test_tables_contain_the_results_of_the_analysis(bag, tmp_path):
    run = read_run(bag)
    paths = write_tables(read_runs(bag), tmp_path)
    assert [path.name for path in paths] == [f"{name}.tsv" for name in TABLES]
    strides, pulses = rows(tmp_path / "strides.tsv"), rows(tmp_path / "pulses.tsv")
    assert [float(row["period"]) for row in strides] == [s.period for s in run.strides]
    assert [row["part"] for row in strides] == ["baseline"] * 15 + ["pulses"] * 49 + [
        "washout"
    ] * 16
    assert {row["side"] for row in strides} == {"right"}
    assert sum(int(row["pulses"]) for row in strides) == 50
    lags = [pulse.phase_lag for pulse in run.analysis.pulses]
    assert [float(row["phase_lag"]) for row in pulses] == lags
    assert {row["trial_type"] for row in rows(tmp_path / "events.tsv")} == {
        "heel_strike",
        "toe_off",
        "pulse",
    }
    (block,) = rows(tmp_path / "blocks.tsv")
    assert (block["verdict"], block["person"]) == ("entrained", "n/a")


@pytest.mark.parametrize("name", TABLES)
def test_each_column_is_described_in_json_and_in_parquet(bag, tmp_path, name):
    runs = list(read_runs(bag))
    write_tables(runs, tmp_path)
    write_tables(runs, tmp_path, "parquet")
    about = json.loads((tmp_path / f"{name}.json").read_text())
    table = parquet.read_table(tmp_path / f"{name}.parquet")
    texts = rows(tmp_path / f"{name}.tsv")
    assert list(about) == table.column_names == list(texts[0])
    for field in table.schema:
        entry = about[field.name]
        metadata = field.metadata
        assert metadata[b"description"].decode() == entry["Description"]
        assert metadata.get(b"unit", b"").decode() == entry.get("Units", "")
        words = entry.get("Levels")
        assert not words or {row[field.name] for row in texts} <= set(words)
    for row, text in zip(table.to_pylist(), texts, strict=True):
        shown = ["n/a" if value is None else str(value) for value in row.values()]
        assert shown == list(text.values())


def test_runs_of_a_study_are_ordered_by_person_session_and_block(done, tmp_path):
    done()
    done(("code: P01, number: 2", "code: P02, number: 3"))
    found = [(p.person, p.session, p.block, p.name) for p in places_in(tmp_path / "study")]
    assert found == [
        ("P01", "1", 1, "faster"),
        ("P01", "1", 2, "slower"),
        ("P02", "1", 1, "faster"),
        ("P02", "1", 2, "slower"),
    ]
    sealed = done(("rest: 30", "blind: true"), study="blind")
    assert [place.name for place in places_in(sealed.path)] == ["block 1", "block 2"]
    for path in (sealed.path / "bags/block-01", *sealed.path.glob("bags/block-02/*.mcap")):
        assert is_sealed(path)
        (place,) = places_in(path)
        assert place.sealed


def test_no_table_reveals_the_pulses_of_a_sealed_run(done, tmp_path):
    sealed = done(("rest: 30", "blind: true"))
    write_tables(read_runs(sealed.path), tmp_path)
    events, strides = (rows(tmp_path / f"{name}.tsv") for name in ("events", "strides"))
    assert {row["trial_type"] for row in events} == {"heel_strike", "toe_off"}
    assert {(row["part"], row["pulses"]) for row in strides} == {("n/a", "n/a")}
    assert len(strides) == 160
    for name in ("pulses", "blocks"):
        assert rows(tmp_path / f"{name}.tsv") == []


def test_each_block_of_a_protocol_has_its_own_row_and_parts(tmp_path):
    slower = "{name: slower, pulses: {period: 1.95, width: 0.2, torque: 5, catch_pulses: 1}}"
    protocol = read_protocol(f"blocks:\n- {{name: faster, rest: 5}}\n- {slower}")
    placed = PlacedRun(Place(tmp_path), simulate(protocol))
    write_tables([placed], tmp_path / "out")
    parts = [
        part for part, _ in groupby(row["part"] for row in rows(tmp_path / "out/strides.tsv"))
    ]
    block = ["baseline", "pulses", "washout"]
    assert parts == [*block, "rest", *block]
    given = [row for row in rows(tmp_path / "out/events.tsv") if row["trial_type"] == "pulse"]
    assert [row["duration"] for row in given] == ["0.1"] * 50 + ["0.2"] * 50
    pulses = rows(tmp_path / "out/pulses.tsv")
    assert [(row["part"], row["pulse"]) for row in pulses[49:51]] == [
        ("faster", "50"),
        ("slower", "1"),
    ]
    assert [row["torque"] for row in pulses[50:52]] == ["0.0", "5.0"]
    # Weaker pulses, like those of a sham, say nothing about the basin of the stronger ones.
    (person,) = StudyFindings.of(Findings.of(placed)).persons
    assert (person.entrained, person.testable, person.slower.beyond) == (1, 2, math.inf)
    found = rows(tmp_path / "out/blocks.tsv")
    assert [(row["part"], row["verdict"]) for row in found] == [
        ("faster", "entrained"),
        ("slower", "drifting"),
    ]
    assert [round(float(row["offset"]), 2) for row in found] == [-2.59, 0.87]


@pytest.mark.parametrize(
    ("given", "finding"), [(0, "none was requested"), (1, "1 of 1 pulses compared")]
)
def test_torque_is_compared_only_if_some_was_requested(bag, given, finding):
    run = read_run(bag)
    sham = [(side, replace(timing, torque=0.0)) for side, timing in run.delivered]
    run = replace(run, delivered=tuple(sham[given:]) + run.delivered[:given])
    with BagReader(bag) as reader:
        (check,) = (c for c in checks_of(run, reader) if c.name == "torque")
    assert (check.state, check.finding.endswith(finding)) == ("good", True)


@pytest.mark.parametrize("text", ["pulses: {count: 0}\n", "baseline: 1\npulses: {period: 1.8}\n"])
def test_an_unknown_statistic_is_not_shown_as_a_number(text, tmp_path):
    (found,) = Findings.of(PlacedRun(Place(tmp_path), simulate(read_protocol(text))))
    shown = " ".join(value for _, value in page.statistics_of(found))
    assert "unknown" in shown
    assert not re.search("nan|million", shown)


def test_a_folder_without_runs_is_reported(done, tmp_path):
    with pytest.raises(BagError, match="no recorded run; give a bag, a session"):
        places_in(tmp_path)
    folder = done()
    folder.repeat("why", 1)
    folder.repeat("why", 2)
    with pytest.raises(BagError, match="no recorded run; no block is done yet"):
        places_in(folder.path)
