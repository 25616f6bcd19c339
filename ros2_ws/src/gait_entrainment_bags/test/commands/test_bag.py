# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import csv
import json
import shutil
import struct

import pytest

from gait_entrainment_bags import BagWriter, TopicInfo
from gait_entrainment_commands import main

TEXT = "# C\nT clock\n" + "=" * 80 + "\nMSG: p/T\nint32 sec\nuint32 nanosec\n"
CLOCK = TopicInfo("/a", "p/msg/C", TEXT, "RIHS01_" + "0" * 64)


@pytest.fixture
def bag(tmp_path):
    folder = tmp_path / "walk"
    data = {"seed": "7", "protocol": "name: x\nside: left\n"}
    with BagWriter(folder, ros_distro="jazzy", custom_data=data) as writer:
        writer.add_topic(CLOCK)
        for second in (1, 2, 3):
            writer.write("/a", struct.pack("<4BiI", 0, 1, 0, 0, second, 0), second * 10**9, 0)
            writer.flush()
    return folder


def entrain(capsys, *arguments):
    code = main(["bag", *map(str, arguments)])
    return code, *capsys.readouterr()


def test_info_prints_topics_times_and_custom_data(capsys, bag):
    code, out, err = entrain(capsys, "info", bag)
    assert (code, err) == (0, "")
    for words in ("2.000 s", "messages   3", "/a p/msg/C", "seed: 7", "    side: left", "jazzy"):
        assert words in out
    answer = json.loads(entrain(capsys, "info", bag, "--json")[1])
    assert answer["topics"] == [{"name": "/a", "type": "p/msg/C", "messages": 3}]
    assert (answer["start"], answer["duration"]) == (10**9, 2 * 10**9)


def test_check_prints_a_line_per_rule_and_fails_for_errors_only(capsys, bag, tmp_path):
    assert entrain(capsys, "check", bag) == (0, f"{bag}: follows every rule\n", "")
    broken = tmp_path / "broken"
    shutil.copytree(bag, broken)
    (broken / "metadata.yaml").unlink()
    code, out, _ = entrain(capsys, "check", bag, broken)
    assert code == 1
    assert [line.split(": ")[:2] for line in out.splitlines()[1:]] == [["error", "metadata-file"]]
    answer = [
        json.loads(line)
        for line in entrain(capsys, "check", bag, broken, "--json")[1].split("\n")[:2]
    ]
    assert [entry["bag"] for entry in answer] == [str(bag), str(broken)]
    assert answer[0]["findings"] == []
    assert answer[1]["findings"][0]["rule"] == "metadata-file"
    with BagWriter(tmp_path / "unhashed", ros_distro="jazzy") as writer:
        writer.add_topic(TopicInfo("/a", "p/msg/C", TEXT))
    code, out, _ = entrain(capsys, "check", tmp_path / "unhashed")
    assert code == 0
    assert out.startswith("warning: type-hash")


def test_recover_reports_what_is_missing(capsys, bag, tmp_path):
    file = bag / "walk_0.mcap"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 3])
    code, out, err = entrain(capsys, "recover", bag, tmp_path / "whole")
    assert (code, err) == (0, "")
    assert "messages rescued into" in out
    assert "missing: " in out
    assert entrain(capsys, "check", tmp_path / "whole")[0] == 0
    answer = json.loads(entrain(capsys, "recover", bag, tmp_path / "again", "--json")[1])
    assert 0 <= answer["messages"] < 3
    assert answer["losses"]


def test_export_writes_tables(capsys, bag, tmp_path):
    pytest.importorskip("pyarrow")
    code, out, err = entrain(capsys, "export", bag, tmp_path / "tables")
    assert (code, err) == (0, "")
    assert out == f"/a: {tmp_path / 'tables' / 'a.csv'}\n"
    with (tmp_path / "tables" / "a.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert [row["log_time [ns]"] for row in rows] == ["1000000000", "2000000000", "3000000000"]


@pytest.mark.parametrize(
    ("arguments", "expected", "words"),
    [
        (["info", "NOWHERE"], 2, "no such file or folder"),
        (["check", "BAG", "NOWHERE"], 2, "no such file or folder"),
        (["recover", "BAG", "BAG"], 2, "already exists"),
        (["export", "BAG", "BAG"], 2, "already exists"),
        (["export", "BAG", "OUT", "--topics", "/b"], 1, "no topic /b"),
        (["info", "EMPTY"], 1, "is empty"),
        (["info", "no\n\x1b[31m"], 2, r"no\n\x1b[31m: no such file"),
        (["recover", "BAG", "\udcff"], 1, r"'\udcff': cannot be created; allowed: UTF-8 names"),
        (["recover", "EMPTY", "OUT"], 1, "is empty"),
    ],
)
def test_each_failure_is_reported_in_one_line(capsys, bag, tmp_path, arguments, expected, words):
    if arguments[0] == "export":
        pytest.importorskip("pyarrow")
    (tmp_path / "empty.mcap").touch()
    paths = {
        "BAG": bag,
        "NOWHERE": tmp_path / "nowhere",
        "OUT": tmp_path / "out",
        "EMPTY": tmp_path / "empty.mcap",
    }
    code, out, err = entrain(capsys, *(paths.get(argument, argument) for argument in arguments))
    assert (code, out) == (expected, "")
    assert err.count("\n") == 1
    assert err.startswith(f"entrain bag {arguments[0]}: ")
    assert words in err


@pytest.mark.parametrize("action", ["info", "check", "recover", "export"])
def test_every_action_has_help_with_examples(capsys, action):
    with pytest.raises(SystemExit) as ended:
        main(["bag", action, "--help"])
    assert ended.value.code == 0
    assert "examples:" in capsys.readouterr().out


def test_a_topic_that_cannot_be_decoded_does_not_stop_the_others(capsys, tmp_path):
    with BagWriter(tmp_path / "mixed", ros_distro="") as writer:
        writer.add_topic(TopicInfo("/bad", "p/msg/Bad", "int32 x y z\n"))
        writer.add_topic(CLOCK)
        for topic in ("/bad", "/a"):
            writer.write(topic, struct.pack("<4BiI", 0, 1, 0, 0, 1, 0), 10**9, 0)
    code, out, err = entrain(capsys, "export", tmp_path / "mixed", tmp_path / "tables", "--json")
    assert code == 1
    assert json.loads(out) == {"/a": str(tmp_path / "tables" / "a.csv")}
    assert "no table: /bad: " in err
    assert [path.name for path in (tmp_path / "tables").iterdir()] == ["a.csv"]
    json.loads(entrain(capsys, "check", tmp_path / "mixed", "--json")[1])


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_rescuing_nothing_is_a_failure(capsys, tmp_path, form):
    with BagWriter(tmp_path / "empty", ros_distro="") as writer:
        writer.add_topic(CLOCK)
    code, out, _ = entrain(capsys, "recover", tmp_path / "empty", tmp_path / "rescued", *form)
    assert code == 1
    assert "0 messages" in out or json.loads(out)["messages"] == 0
    code, out, err = entrain(capsys, "export", tmp_path / "empty", tmp_path / "tables", *form)
    assert (code, out) == (1, "")
    assert "holds no messages to export" in err
