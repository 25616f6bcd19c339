# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The bag that comes with the project contains what the nodes recorded live."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from gait_entrainment_bags import BagReader, BagWriter, TopicInfo, check, recover
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_commands import main

BAG = Path(__file__).parents[5] / "bags" / "paper_example"
NEEDED = ("/gait_events", "/perturbation/torque_profile")
pytestmark = pytest.mark.skipif(not BAG.exists(), reason="the repository's bag is not here")


def entrain(capsys, *arguments):
    code = main([*map(str, arguments)])
    return code, *capsys.readouterr()


def test_the_outcome_equals_that_of_the_simulation(capsys):
    code, out, err = entrain(capsys, "analyze", BAG, "--json")
    assert (code, err) == (0, "")
    outcome = json.loads(out)
    simulated = json.loads(entrain(capsys, "simulate", "--json")[1])
    assert {key: outcome[key] for key in simulated} == simulated
    assert outcome["as_published_live"] is True
    assert outcome["differences"] == []
    with BagReader(BAG) as bag:
        assert (outcome["messages"], outcome["lost"]) == (bag.message_count, 0)
    assert "the same to the last bit" in entrain(capsys, "analyze", BAG)[1]


def copy(out, keep, custom=None, renamed=("", ""), again=()):
    """
    Copy the bag; `keep` returns the bytes of a message, perhaps changed, or None to drop it.

    `again`: topics to write twice; `custom`: new custom data; `renamed`: topic and its field.
    """
    with (
        BagReader(BAG) as bag,
        BagWriter(out, ros_distro="jazzy", custom_data=bag.custom_data | (custom or {})) as writer,
    ):
        for topic in bag.topics.values():
            name, field = renamed
            text = re.sub(rf"(?m)^(\S+ ){field}\b", r"\1other", topic.schema_text)
            writer.add_topic(replace(topic, schema_text=text) if topic.name == name else topic)
        number = dict.fromkeys(bag.topics, 0)
        for message in sorted(bag.messages(), key=lambda message: message.place):
            data = keep(message.topic, number[message.topic], message.data)
            number[message.topic] += 1
            for _ in range(0 if data is None else 1 + (message.topic in again)):
                writer.write(message.topic, data, message.log_time, message.publish_time)
    return out


def test_one_changed_bit_of_a_result_is_found(capsys, tmp_path):
    def changed(topic, number, data):
        if (topic, number) == ("/gait/pulse_phases", 17):
            place = len(data) - 20  # the lowest bits of the unwrapped lag
            return data[: place - 4] + bytes([data[place - 4] ^ 1]) + data[place - 3 :]
        return data

    bag = copy(tmp_path / "changed", changed)
    code, out, _ = entrain(capsys, "analyze", bag, "--json")
    outcome = json.loads(out)
    assert (code, outcome["as_published_live"]) == (0, False)
    (difference,) = outcome["differences"]
    assert difference.startswith("gait/pulse_phases: ")
    assert "message 18" in difference


def test_a_bag_with_deleted_events_is_analyzed(capsys, tmp_path):
    bag = copy(
        tmp_path / "gaps",
        lambda topic, n, data: None if topic == "/gait_events" and n in (100, 101) else data,
    )
    code, out, _ = entrain(capsys, "analyze", bag, "--json")
    outcome = json.loads(out)
    assert code == 0
    assert len(outcome["stride_period"]) in (78, 79)
    assert outcome["as_published_live"] is False


def test_missing_profiles_are_a_hole_up_to_the_end(capsys, tmp_path):
    def half(topic, number, data):
        return data if topic in NEEDED and (topic == NEEDED[0] or number < 42) else None

    code, out, _ = entrain(capsys, "analyze", copy(tmp_path / "half", half))
    assert code == 0
    assert "which pulses began at" in out
    assert "longer than the run" not in out


def test_a_rescued_bag_is_analyzed_up_to_its_end(capsys, tmp_path):
    shutil.copytree(BAG, tmp_path / "cut")
    file = tmp_path / "cut" / "paper_example_0.mcap"
    file.write_bytes(file.read_bytes()[:600_000])
    code, _, err = entrain(capsys, "analyze", tmp_path / "cut")
    assert code == 1
    assert "entrain bag recover" in err
    recover(tmp_path / "cut", tmp_path / "rescued")
    code, out, _ = entrain(capsys, "analyze", tmp_path / "rescued", "--json")
    assert code == 0
    assert 10 < len(json.loads(out)["stride_period"]) < 80


def test_torque_is_read_only_where_figures_need_it(tmp_path, capsys):
    assert len(read_run(BAG, torques=False).torques.stamps) == 0
    torques = read_run(BAG).torques
    assert 0 < len(torques.stamps) < 0.5 * 7700
    assert torques.effective.max() == pytest.approx(13.35, abs=0.01)
    code, out, _ = entrain(capsys, "analyze", BAG, "--figures", tmp_path / "figures")
    assert code == 0
    assert out.count(".png") == 3


def test_the_bag_follows_every_rule_and_opens_without_ros_and_message_packages():
    assert check(BAG) == []
    code = (
        "import sys\n"
        "class Block:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('rclpy', 'gait_entrainment_msgs', 'std_msgs'):\n"
        "            raise ImportError(name)\n"
        "sys.meta_path.insert(0, Block())\n"
        "from gait_entrainment_commands import main\n"
        f"sys.exit(main(['analyze', {str(BAG)!r}]))\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "entrained since stride 29" in ended.stdout


@pytest.mark.parametrize(
    ("name", "expected", "words"),
    [
        ("nowhere", 2, "no such file"),
        ("foreign", 1, "does not state which leg is perturbed"),
        ("text", 1, "not an MCAP"),
        ("strangers", 1, "does not state which leg is perturbed"),
        ("protocol=\0", 1, "its protocol cannot be read"),
        ("onset=sideways", 1, "'sideways'; allowed: commanded, measured"),
        ("messages_lost=oops", 1, "'oops'; allowed: a JSON object"),
        ("messages_lost=[1]", 1, "'[1]'; allowed: a JSON object"),
        ('messages_lost={"/a": 1e400}', 1, "allowed: a JSON object"),
    ],
)
def test_an_unusable_bag_is_reported_in_one_line(capsys, tmp_path, name, expected, words):
    with BagWriter(tmp_path / "foreign", ros_distro="jazzy"):
        pass
    (tmp_path / "text").write_text("hello")
    with BagWriter(tmp_path / "strangers", ros_distro="jazzy") as writer:
        for topic in NEEDED:
            writer.add_topic(TopicInfo(topic, "std_msgs/msg/Byte", "byte data"))
            writer.write(topic, b"\0\1\0\0\7", 1, 1)
    key, separator, value = name.partition("=")
    if separator:  # another tool has written this into the custom data
        name = "edited"
        copy(
            tmp_path / name, lambda topic, _, data: data if topic in NEEDED else None, {key: value}
        )
    code, out, err = entrain(capsys, "analyze", tmp_path / name)
    assert (code, out) == (expected, "")
    assert err.count("\n") == 1
    assert words in err


def with_numbers(data, place, value):
    """Change four bytes after a message's header: its run number at 0, then its own fields."""
    begin = 20 + place
    return data[:begin] + value.to_bytes(4, "little") + data[begin + 4 :]


def test_a_second_run_in_a_bag_is_refused(capsys, tmp_path):
    def restarted(topic, number, data):
        first = (topic, number) == ("/perturbation/torque_profile", 60)
        return (with_numbers(data, 4, 0) if first else data) if topic in NEEDED else None

    code, out, err = entrain(capsys, "analyze", copy(tmp_path / "two", restarted))
    assert (code, out) == (1, "")
    assert "holds more than one run (run 1, then run 1)" in err


def test_messages_recorded_twice_count_once(capsys, tmp_path):
    twice = copy(tmp_path / "twice", lambda t, _, d: d if t in NEEDED else None, again=NEEDED)
    code, out, _ = entrain(capsys, "analyze", twice, "--json")
    outcome = json.loads(out)
    assert (code, outcome["entrained_since_stride"], outcome["holes"]) == (0, 29, [])
    assert outcome["gait_events"]["repeated"] == 324


@pytest.mark.parametrize("lost", NEEDED)
def test_all_messages_of_an_announced_topic_may_be_lost(tmp_path, lost):
    bag = copy(tmp_path / "bag", lambda topic, _, data: None if topic == lost else data)
    (found,) = check(bag)
    (hole,) = recover(bag, tmp_path / "rescued").losses
    count = re.search(rf"{lost}: (\d+) of (\d+) messages", hole)
    assert count[0] in found.detail
    assert count[1] == count[2]
    assert len({*read_run(bag).analysis.holes}) == len(read_run(bag).analysis.holes)


def test_messages_that_the_analyzer_rejects_are_left_out_and_counted(capsys, tmp_path):
    def strange(topic, number, data):
        if (topic, number) == ("/gait_events", 100):
            return with_numbers(data, 0, 7)  # of another run
        if (topic, number) == ("/gait_events", 101):
            return data[:24] + b"\7" + data[25:]  # of an unknown kind
        if (topic, number) == (NEEDED[1], 30):
            return data[:28] + b"\7" + data[29:]  # on an unknown side
        return data if topic in NEEDED else None

    # An empty text is not a protocol.
    bag = copy(tmp_path / "strange", strange, {"protocol": " "})
    outcome = json.loads(entrain(capsys, "analyze", bag, "--json")[1])
    assert (outcome["left_out"], outcome["gait_events"]["accepted"]) == (3, 322)
    assert "which pulses began" in [hole["missing"] for hole in outcome["holes"]]
    assert outcome["parameters"] is None
    assert "3 left out" in entrain(capsys, "analyze", bag)[1]


@pytest.mark.parametrize(
    "renamed",
    [
        ("/gait_events", "kind"),
        ("/perturbation/torque_profile", "onsets"),
        ("/perturbation/pulses", "torque"),
        ("/gait/strides", "number"),
    ],
)
def test_messages_of_another_version_are_reported(capsys, tmp_path, renamed):
    topics = {*NEEDED, renamed[0]}
    bag = copy(
        tmp_path / "old", lambda topic, _, data: data if topic in topics else None, {}, renamed
    )
    code, out, err = entrain(capsys, "analyze", bag)
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert f"{renamed[0].strip('/')}: its messages have no field {renamed[1]}" in err


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """Write the bag with `rosbags`: in order of reception, without custom data."""
    folder = tmp_path_factory.mktemp("foreign") / "bag"
    with (
        BagReader(BAG) as bag,
        Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer,
    ):
        connections = {
            name: writer.add_connection(
                name, topic.type, msgdef=topic.schema_text, rihs01=topic.type_hash
            )
            for name, topic in bag.topics.items()
        }
        for message in sorted(bag.messages(), key=lambda message: message.publish_time):
            if message.topic not in ("/ankle_torque", "/published_counts"):
                writer.write(connections[message.topic], message.publish_time, message.data)
    return folder


def test_the_bag_of_another_recorder_gives_the_same_outcome(capsys, foreign):
    ours = json.loads(entrain(capsys, "analyze", BAG, "--json")[1])
    code, out, err = entrain(
        capsys, "analyze", foreign, "--protocol", BAG / "protocol.yaml", "--json"
    )
    assert (code, err) == (0, "")
    # Such a file does not record when a message was published or what was lost.
    outcome = json.loads(out) | {
        key: ours[key] for key in ("bag", "messages", "lost", "real_time_factor")
    }
    assert outcome == ours


def test_without_a_protocol_the_rest_is_still_reported(capsys, foreign, tmp_path):
    ours = json.loads(entrain(capsys, "analyze", BAG, "--json")[1])
    code, out, err = entrain(capsys, "analyze", foreign, "--json")
    assert (code, err) == (0, "")
    outcome = json.loads(out)
    assert outcome["parameters"] is None
    assert (outcome["side"], outcome["as_published_live"]) == ("right", True)
    assert outcome["stride_period"][:80] == ours["stride_period"]
    for key in ("unperturbed_stride_period", "perturbation_period"):
        assert outcome[key] == pytest.approx(ours[key], abs=1e-9)
    for key in ("pulses", "verdict", "entrained_since_stride", "final_phase_lag", "holes"):
        assert outcome[key] == ours[key]
    code, out, _ = entrain(capsys, "analyze", foreign, "--figures", tmp_path)
    assert (code, out.count(".png")) == (0, 3)
    assert "entrained since stride 29" in out


def test_a_leg_other_than_the_recorded_one_can_be_analyzed(capsys, foreign):
    outcome = json.loads(entrain(capsys, "analyze", foreign, "--side", "left", "--json")[1])
    assert (outcome["side"], outcome["as_published_live"]) == ("left", True)
    # The pulses settle in the other leg's double stance: half a stride away from its own.
    assert outcome["entrained"]
    assert abs(outcome["final_phase_lag"]) > 0.5
