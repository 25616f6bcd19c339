# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings made elsewhere: tables in, events.tsv out, one line for every refused input."""

import json
import math

import pytest
from walks import force, sampled

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.errors import EntrainmentError
from gait_entrainment_sensors.detection import find_detector
from gait_entrainment_sensors.offline import (
    COLUMNS,
    detect,
    read_events,
    read_onsets,
    write_events,
)
from gait_entrainment_sensors.recording import RecordingError, Stream, read_streams, read_table

STRIKE, TOE_OFF = EventKind


@pytest.fixture
def walk(tmp_path):
    """A table with the force under both feet."""
    rows = [
        f"{time:.3f},{force(time, Side.LEFT):.2f},{force(time, Side.RIGHT):.2f}"
        for time, _ in sampled(lambda _: (), 12.0)
    ]
    path = tmp_path / "walk.csv"
    path.write_text("\n".join(["time,left_force_z,right_force_z", *rows]))
    return path


def streams_of(path, **options):
    return read_streams(
        path, map(find_detector, ("vertical_force", "foot_gyroscope", "ankle_encoder")), **options
    )


def events_of(path, **options):
    return detect(*streams_of(path, **options))


def test_events_found_in_a_table_are_written_and_read_back(walk, tmp_path):
    events, troubles = events_of(walk)
    assert troubles == ("1 events were missed",)  # the left toe-off before the first strike
    out = tmp_path / "walk_events.tsv"
    write_events(out, events)
    assert [*read_table(out).columns] == [*COLUMNS]
    sidecar = json.loads((tmp_path / "walk_events.json").read_text())
    assert {name: column.get("Units") for name, column in sidecar.items()}["onset"] == "s"
    again = read_events(out)
    assert again == sorted((e.event for e in events), key=lambda e: e.stamp)
    assert {e.uncertainty for e in again} == {0.003}


def test_events_without_steps_are_numbered(walk, tmp_path):
    events, _ = events_of(walk)
    path = tmp_path / "theirs.csv"
    rows = [
        f"{e.event.stamp / 1e9:.9f};{e.event.kind.name};{e.event.side.name.title()}"
        for e in events
    ]
    path.write_text("\n".join(["onset;trial_type;side", *rows]))
    assert [(e.step, e.stamp) for e in read_events(path)] == [
        (e.event.step, e.event.stamp) for e in sorted(events, key=lambda e: e.event.stamp)
    ]


def test_columns_with_other_names_and_units_are_read(walk, tmp_path):
    text = walk.read_text().replace("time,left_force_z,right_force_z", "t,Fz1,Fz2")
    theirs = tmp_path / "theirs.csv"
    theirs.write_text(text)
    columns = {"time": "t", "left_force_z": "Fz1", "right_force_z": "Fz2"}
    assert events_of(theirs, columns=columns) == events_of(walk)
    theirs.write_text("left_ankle_angle_deg\n180\n90\n")
    chosen, (stream,) = streams_of(theirs, rate=100.0)
    assert (chosen.name, stream.times) == ("ankle_encoder", [0.0, 0.01])
    assert stream.values[0] == pytest.approx((3.14159265, 0.0))


def with_comma(text):
    return text.replace(",", ";").replace(".", ",")


def in_milliseconds(text):
    head, *rows = (line.split(",") for line in text.splitlines())
    rows = ["\t".join([f"{1e3 * float(row[0]):g}", *row[1:]]) for row in rows]
    return "\n".join(["\t".join(["Time (ms)", *head[1:]]), *rows])


def with_header(*lines):
    return lambda text: "\n".join([*lines, *text.splitlines()[1:]])


@pytest.mark.parametrize(
    "rewrite",
    [
        with_comma,
        in_milliseconds,
        with_header("# lab A", "subject;3", "TIME [s],Left_Force_Z [N],right_force_z (N)"),
        with_header("time,left_force_z,right_force_z", "s,N,N"),
        with_header("time,left,right", ",force_z,force_z", "s,,"),
        lambda text: text.replace("\n", "\r\n") + "\r\n \r\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_common_ways_of_writing_a_table_are_read(walk, rewrite, encoding):
    plain = events_of(walk)
    walk.write_text(rewrite(walk.read_text()), encoding=encoding)
    columns = {"left_force_z": "left force_z", "right_force_z": "right force_z"}
    two_rows = "left force_z" in read_table(walk).columns
    again = events_of(walk, columns=columns if two_rows else {})
    assert [(e.event.step, e.detection.kind) for e in again[0]] == [
        (e.event.step, e.detection.kind) for e in plain[0]
    ]
    assert [e.detection.time for e in again[0]] == pytest.approx(
        [e.detection.time for e in plain[0]], abs=1e-6
    )


def test_an_empty_line_in_a_single_column_is_a_missing_sample(tmp_path):
    path = tmp_path / "one.csv"
    path.write_text("left_force_z\n1.5\n\n3\n")
    _, (stream,) = streams_of(path, rate=100.0)
    assert stream.times == pytest.approx([0.0, 0.01, 0.02])
    assert [v for (v,) in stream.values] == pytest.approx([1.5, math.nan, 3.0], nan_ok=True)


def test_toe_offs_before_the_first_strike_are_written_but_not_read(walk, tmp_path):
    lines = walk.read_text().splitlines()
    walk.write_text("\n".join([lines[0], *lines[230:]]))  # both feet stand
    events, _ = events_of(walk)
    first, second, *_ = sorted(events, key=lambda e: e.detection.time)
    assert (first.event.kind, first.event.side, first.event.step) == (TOE_OFF, Side.RIGHT, 0)
    assert (second.event.kind, second.event.side, second.event.step) == (STRIKE, Side.RIGHT, 0)
    write_events(tmp_path / "e.tsv", events)
    assert read_events(tmp_path / "e.tsv")[0] == second.event


def test_a_sensor_that_dies_before_the_record_ends_is_reported(walk):
    chosen, (left, right) = streams_of(walk)
    dead = Stream(right.side, right.times[:1000], right.values[:1000])
    assert "right vertical_force: no sample for 7.00 s" in detect(chosen, [left, dead])[1]


def test_a_missing_sample_is_reported(walk):
    lines = walk.read_text().splitlines()
    lines[400] = lines[400].rpartition(",")[0] + ","
    walk.write_text("\n".join(lines))
    assert "right vertical_force: 1 samples are not numbers, skipped" in events_of(walk)[1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param(f"time\n{9:0200000}\n", "cannot be read: field larger", id="endless field"),
        ("", "has no rows"),
        ("time,left_force_z", "has no rows"),
        ("time,left_force_z\n0,1,2", "row 2 has 3 fields"),
        ("time,time\n0,1", "column time appears twice"),
        ("left_force_z\n1", "lacks the column time"),
        ("time,left_force_z\n0,x", "row 2, column left_force_z: 'x'"),
        ("0,1\n1,2", "row 1 has no names above it"),
        ("time,left_force_z\n0,1\n10,1\n20,1", "column time, or --rate: samples are 10 s apart"),
        ("time,left_force\n0,1", "lacks columns SIDE_force_z or"),
        ("time,left_foot_gyro_x\n0,1", "lacks column left_foot_gyro_y, left_foot_gyro_z"),
    ],
)
def test_a_refused_table_is_reported_in_one_line(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(RecordingError) as refused:
        streams_of(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("onset,side\n1,left", "lacks column trial_type"),
        ("onset,trial_type,side\n1,jump,left", "row 2, column trial_type: 'jump'; allowed: heel"),
        ("onset,trial_type,side\n1,toe_off,both", "row 2, column side: 'both'; allowed: left"),
        ("onset,trial_type,side\nn/a,toe_off,left", "row 2, column onset: 'n/a'"),
        ("onset,trial_type,side,step\n1,toe_off,left,", "row 2, column step: ''"),
        ("onset,trial_type,side,step\n1,toe_off,left,0.5", "'0.5'; allowed: a whole number"),
        ("onset,trial_type,side,uncertainty\n1,toe_off,left,-1", "'-1'; allowed: 0 to 1 s"),
    ],
)
def test_refused_events_are_reported_with_row_and_column(tmp_path, text, words):
    path = tmp_path / "bad.tsv"
    path.write_text(text)
    with pytest.raises(EntrainmentError) as refused:
        read_events(path)
    assert words in str(refused.value)


def test_pulses_are_read_from_the_column_onset(tmp_path):
    path = tmp_path / "pulses.tsv"
    path.write_text("onset\tduration\n2.5\t0.1\n1.25\t0.1\n")
    assert read_onsets(path) == [1_250_000_000, 2_500_000_000]
    path.write_text("start\n1\n")
    with pytest.raises(RecordingError, match="lacks column onset"):
        read_onsets(path)


def test_files_are_not_overwritten_and_unreadable_ones_are_refused(walk, tmp_path):
    events, _ = events_of(walk)
    out = tmp_path / "walk_events.tsv"
    write_events(out, events)
    with pytest.raises(RecordingError, match="already there"):
        write_events(out, events)
    with pytest.raises(RecordingError, match="cannot be read"):
        read_table(tmp_path / "none.csv")
    out.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecordingError, match="is not UTF-8 text"):
        read_table(out)
