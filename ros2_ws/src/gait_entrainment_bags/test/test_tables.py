# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gait_entrainment_bags import BagError, BagExistsError, BagWriter, TopicInfo, export

pytest.importorskip("pyarrow", reason="tables need pyarrow: pip install pyarrow")

TEXT = (
    "# Torque at both ankles [N m].\n"
    "uint8 LEFT=0\n"
    "builtin_interfaces/Time stamp  # instant of the sample\n"
    "float64[2] torque\n"
    "float64 angle  # ankle angle [rad], in [0, 1)\n"
    "float64[] forces  # [N]\n"
    "builtin_interfaces/Time[] onsets\n"
    "string[] faults\n"
    "bool last\n"
    "uint64 samples\n"
    "Part[] parts\n"
    "\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    "\n" + "=" * 80 + "\nMSG: p/Part\nint32 x\n"
)
ROW = {
    "stamp": {"sec": 2, "nanosec": 5},
    "torque": [1.5, -2.0],
    "angle": math.nan,
    "forces": [3.0, 4.0],
    "onsets": [{"sec": 1, "nanosec": 1}],
    "faults": ["hot", "a,b"],
    "last": True,
    "samples": 2**64 - 1,
    "parts": [{"x": 1}, {"x": -1}],
}


@pytest.fixture
def bag(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
) -> Path:
    """Write a bag with JointStates, a message with every kind of field and an empty topic."""
    from mcap_ros2._dynamic import serialize_dynamic

    encode = serialize_dynamic("p/msg/All", TEXT)["p/msg/All"]
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(topic("/joint_states", "sensor_msgs/msg/JointState"))
        writer.add_topic(topic("/silent", "rosgraph_msgs/msg/Clock"))
        writer.add_topic(TopicInfo("/gait/all", "p/msg/All", TEXT))
        for number in range(3):
            writer.write("/joint_states", joint_state(number, [number, 0.5]), number, number + 1)
        writer.write("/gait/all", encode(ROW), 7, 8)
    return tmp_path / "walk"


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_joints_become_columns_with_units(bag: Path, tmp_path: Path) -> None:
    files = export(bag, tmp_path / "out", "csv")
    assert {path.name for path in files.values()} == {"joint_states.csv", "gait.all.csv"}
    rows = rows_of(files["/joint_states"])
    assert rows[2] == {
        "log_time [ns]": "2",
        "publish_time [ns]": "3",
        "header.stamp [ns]": "2",
        "header.frame_id": "",
        "position.l_hip [rad]": "2",
        "position.r_hip [rad]": "0.5",
        "velocity.l_hip [rad/s]": "4",
        "velocity.r_hip [rad/s]": "1",
        "effort.l_hip [N m]": "-2",
        "effort.r_hip [N m]": "-0.5",
    }
    assert len(rows) == 3


def test_every_kind_of_field_in_csv(bag: Path, tmp_path: Path) -> None:
    files = export(bag, tmp_path / "out", "csv", ["/gait/all"])
    assert rows_of(files["/gait/all"]) == [
        {
            "log_time [ns]": "7",
            "publish_time [ns]": "8",
            "stamp [ns]": "2000000005",
            "torque.0 [N m]": "1.5",
            "torque.1 [N m]": "-2",
            "angle [rad]": "",
            "forces [N]": "[3.0, 4.0]",
            "onsets [ns]": "[1000000001]",
            "faults": '["hot", "a,b"]',
            "last": "true",
            "samples": str(2**64 - 1),
            "parts": '[{"x": 1}, {"x": -1}]',
        }
    ]


def test_every_kind_of_field_in_parquet(bag: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    files = export(bag, tmp_path / "out", "parquet")
    table = parquet.read_table(files["/gait/all"])
    (row,) = table.to_pylist()
    assert math.isnan(row.pop("angle"))
    assert row == {
        "log_time": 7,
        "publish_time": 8,
        "stamp": 2_000_000_005,
        "torque.0": 1.5,
        "torque.1": -2.0,
        "forces": [3.0, 4.0],
        "onsets": [1_000_000_001],
        "faults": '["hot", "a,b"]',
        "last": True,
        "samples": 2**64 - 1,
        "parts": '[{"x": 1}, {"x": -1}]',
    }
    units = {field.name: (field.metadata or {}).get(b"unit") for field in table.schema}
    assert units["torque.0"] == b"N m"
    assert units["angle"] == b"rad"
    assert units["forces"] == b"N"
    assert units["stamp"] == b"ns"
    assert units["last"] is None
    states = parquet.read_table(files["/joint_states"])
    assert states.column("position.l_hip").to_pylist() == [0.0, 1.0, 2.0]


def test_export_overwrites_nothing_and_leaves_nothing_half_written(
    bag: Path,
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
) -> None:
    with pytest.raises(BagExistsError):
        export(bag, tmp_path, "csv")
    with pytest.raises(BagError, match="format 'xlsx'"):
        export(bag, tmp_path / "out", "xlsx")
    with pytest.raises(BagError, match="no topic /x"):
        export(bag, tmp_path / "out", "csv", ["/x"])
    with BagWriter(tmp_path / "odd", ros_distro="jazzy") as writer:
        writer.add_topic(topic("/joint_states", "sensor_msgs/msg/JointState"))
        for positions in ([1.0, 2.0], [1.0]):
            writer.write("/joint_states", joint_state(1, positions), 1, 1)
    with pytest.raises(BagError, match="/joint_states: the names of its elements change"):
        export(tmp_path / "odd", tmp_path / "out", "csv")
    with pytest.raises(BagError, match="no messages on /silent"):
        export(bag, tmp_path / "out", "csv", ["/silent"])
    with BagWriter(tmp_path / "short", ros_distro="jazzy") as writer:
        writer.add_topic(TopicInfo("/id", "p/msg/Id", "uint8[4] id\n"))
        writer.write("/id", bytes([0, 1, 0, 0, 1, 2, 3]), 1, 1)
    with pytest.raises(BagError, match="/id: not a p/msg/Id in CDR"):
        export(tmp_path / "short", tmp_path / "out", "csv")
    assert not (tmp_path / "out").exists()


def test_each_topic_has_its_own_table(tmp_path: Path) -> None:
    names = ("/a/b", "/a.b", "/")
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        for number, name in enumerate(names):
            writer.add_topic(TopicInfo(name, "p/msg/Byte", "uint8 data\n"))
            writer.write(name, bytes([0, 1, 0, 0, number]), 1, 1)
    files = export(tmp_path / "walk", tmp_path / "out", "csv")
    assert [rows_of(files[name])[0]["data"] for name in names] == ["0", "1", "2"]


def test_names_without_matching_values_stay_in_the_table(
    tmp_path: Path,
) -> None:
    from mcap_ros2._dynamic import serialize_dynamic

    text = "string[] name\nT stamp\n" + "=" * 80 + "\nMSG: p/msg/T\nint32 sec\n"
    encode = serialize_dynamic("p/msg/Found", text.replace("p/msg/T", "p/T"))["p/msg/Found"]
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(TopicInfo("/found", "p/msg/Found", text))
        writer.write("/found", encode({"name": ["l_hip", "ü"], "stamp": {"sec": 3}}), 1, 1)
    files = export(tmp_path / "walk", tmp_path / "out", "csv")
    (row,) = rows_of(files["/found"])
    assert json.loads(row["name"]) == ["l_hip", "ü"]
    assert row["stamp.sec"] == "3"


@pytest.mark.parametrize(
    "value", [0.1, 1 / 3, -0.0, 5e-324, 1e22, 123456789012345680.0, 0.1 + 0.2, math.inf]
)
def test_floats_in_csv_are_exact(
    tmp_path: Path,
    topic: Callable[..., TopicInfo],
    joint_state: Callable[[int, list[float]], bytes],
    value: float,
) -> None:
    with BagWriter(tmp_path / "walk", ros_distro="jazzy") as writer:
        writer.add_topic(topic("/joint_states", "sensor_msgs/msg/JointState"))
        writer.write("/joint_states", joint_state(1, [value]), 1, 1)
    files = export(tmp_path / "walk", tmp_path / "out", "csv")
    (row,) = rows_of(files["/joint_states"])
    assert float(row["position.l_hip [rad]"]).hex() == value.hex()


@pytest.mark.parametrize("format_name", ["csv", "parquet"])
def test_without_pyarrow_the_export_says_what_is_missing(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format_name: str
) -> None:
    def absent(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr("gait_entrainment_bags.tables.import_module", absent)
    with pytest.raises(BagError, match="needs pyarrow"):
        export(bag, tmp_path / "out", format_name)
    assert not (tmp_path / "out").exists()
