# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain detect, and entrain analyze on tables: runs that this project did not record."""

import json

import pytest

from gait_entrainment.protocol import Protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagWriter
from gait_entrainment_commands import main
from gait_entrainment_sensors.offline import read_events


def entrain(capsys, *words):
    code = main([*map(str, words)])
    return code, *capsys.readouterr()


@pytest.fixture(scope="module")
def simulation():
    return simulate(Protocol())


@pytest.fixture
def tables(simulation, tmp_path):
    """Write the paper's run as another tool would: no step numbers, another clock."""
    events, pulses = tmp_path / "events.tsv", tmp_path / "pulses.tsv"
    rows = [
        f"{100 + e.stamp / 1e9:.9f}\t{e.kind.name.lower()}\t{e.side.name.lower()}"
        for e in simulation.events
    ]
    events.write_text("\n".join(["onset\ttrial_type\tside", *rows]))
    onsets = [f"{100 + onset / 1e9:.9f}" for onset in simulation.onsets]
    pulses.write_text("\n".join(["onset", *onsets]))
    return "--events", events, "--pulses", pulses


def test_a_run_from_tables_has_the_outcome_of_the_simulated_run(capsys, tables, simulation):
    code, out, err = entrain(capsys, "analyze", *tables, "--side", "right", "--json")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert (answer["verdict"], answer["entrained_since_stride"]) == ("entrained", 29)
    lag = simulation.analysis.pulses[-1].phase_lag
    assert answer["final_phase_lag"] == pytest.approx(lag, abs=1e-6)
    late = entrain(capsys, "analyze", *tables, "--side=right", "--toe-off-bias=0.01", "--json")[1]
    assert json.loads(late)["final_phase_lag"] == pytest.approx(lag + 0.01, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "missing: --events, --pulses, --side"),
        (["--events", "e.tsv", "--pulses", "p.tsv"], "missing: --side"),
        (["bag", "--events", "e.tsv", "--pulses", "p.tsv", "--side", "left"], "--side; not both"),
    ],
)
def test_analyze_needs_a_bag_or_tables_with_the_leg(capsys, words, message):
    code, out, err = entrain(capsys, "analyze", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_tables_that_do_not_fit_together_are_refused(capsys, tables):
    """Only the other leg's events; pulses in milliseconds and on another clock."""
    _, events, _, pulses = tables
    rows = events.read_text()
    events.write_text("\n".join(line for line in rows.splitlines() if "right" not in line))
    code, _, err = entrain(capsys, "analyze", *tables, "--side=right")
    assert (code, err.count("\n")) == (2, 1)
    assert f"{events}: holds no plausible stride of the right leg" in err
    events.write_text(rows)
    pulses.write_text("onset [ms]\n100\n1700\n")
    code, _, err = entrain(capsys, "analyze", *tables, "--side=right")
    assert (code, err.count("\n")) == (2, 1)
    assert "column onset: 0.1 to 1.7 s; allowed: some in the strides, 100 to" in err


def test_detect_writes_next_to_the_file_and_prints(capsys, tmp_path):
    def load(n):
        return 800 if n % 110 < 68 else 0

    rows = [f"{n / 100:g},{load(n)},{load(n + 55)}" for n in range(1200)]
    path = tmp_path / "walk.csv"
    path.write_text("\n".join(["time,left_force_z,right_force_z", *rows]))
    code, out, err = entrain(capsys, "detect", path, "--json")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert answer["detector"] == "vertical_force"
    assert answer["counts"]["left_heel_strike"] >= 9
    assert (tmp_path / "walk_events.tsv").exists()
    code, _, err = entrain(capsys, "detect", path)
    assert code == 2
    assert "already there" in err
    code, out, _ = entrain(capsys, "detect", path, "--out", tmp_path / "b.tsv")
    assert code == 0
    assert "left heel strike" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.csv"], "there is no such file"),
        (["FILE", "--rate", "-3"], "--rate: -3 Hz; allowed: above 0"),
        (["FILE", "--column", "x"], "--column: 'x'; allowed: NAME=NAME_IN_FILE"),
        (["FILE", "--column", "time=z"], "has no column z to use as time"),
        (["FILE", "--detector", "guess"], "detector: 'guess' is unknown"),
        (["FILE", "--plates", "left,right"], "--plates: "),
        (["FILE"], "holds no gait event that could be detected: it lasts 0"),
    ],
)
def test_wrong_usage_is_reported_in_one_line(capsys, tmp_path, words, message):
    path = tmp_path / "walk.csv"
    path.write_text("time,left_force_z\n0,0\n0.01,0\n")
    code, out, err = entrain(capsys, "detect", *(str(path) if w == "FILE" else w for w in words))
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_signals_of_a_bag_may_be_in_any_namespace(capsys, tmp_path, topic, typestore, joint_state):
    def wrench(stamp, force):
        types = typestore.types
        vectors = [types["geometry_msgs/msg/Vector3"](0.0, 0.0, z) for z in (float(force), 0.0)]
        header = types["std_msgs/msg/Header"](
            types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9)), ""
        )
        name = "geometry_msgs/msg/WrenchStamped"
        message = types[name](header, types["geometry_msgs/msg/Wrench"](*vectors))
        return bytes(typestore.serialize_cdr(message, name))

    folder, start = tmp_path / "walk", 1_700_000_000
    with BagWriter(folder, ros_distro="jazzy") as writer:
        for leg in ("left", "right"):
            name = f"/lab/ground_reaction/{leg}"
            writer.add_topic(topic(name, "geometry_msgs/msg/WrenchStamped"))
        writer.add_topic(topic("/foot_switch/left", "sensor_msgs/msg/JointState"))
        writer.write("/foot_switch/left", joint_state(start * 10**9, [0.0]), 1, 1)
        for n in range(600):
            stamp = start * 10**9 + n * 10**7
            for leg, late in (("left", 0), ("right", 55)):
                force = 800 if (n + late) % 110 < 68 else 0
                writer.write(f"/lab/ground_reaction/{leg}", wrench(stamp, force), stamp, stamp)
    code, out, err = entrain(capsys, "detect", folder, "--json", "--out", tmp_path / "e.tsv")
    assert (code, err) == (0, "")
    assert json.loads(out)["detector"] == "vertical_force"
    first = read_events(tmp_path / "e.tsv")[0]
    assert first.stamp == pytest.approx((start + 0.55) * 1e9, abs=0.6e9)
    code, _, err = entrain(capsys, "detect", folder, "--detector", "foot_switch")
    assert code == 1
    assert "/foot_switch/left: a sensor_msgs/msg/JointState has no such field" in err
    code, _, err = entrain(capsys, "detect", folder, "--detector", "shank_gyroscope")
    assert code == 1
    assert "lacks sensor topics: imu/left_shank, imu/right_shank" in err
