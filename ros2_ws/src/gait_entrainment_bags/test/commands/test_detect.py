# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain detect, and entrain analyze of tables: runs that this project did not record."""

import json

import pytest

from gait_entrainment.commands import main
from gait_entrainment.protocol import Protocol
from gait_entrainment.simulation import simulate


def entrain(capsys, *words):
    code = main([*map(str, words)])
    return code, *capsys.readouterr()


@pytest.fixture(scope="module")
def simulation():
    return simulate(Protocol())


@pytest.fixture
def tables(simulation, tmp_path):
    """The paper's run as somebody else would keep it: no step numbers, other clocks."""
    events, pulses = tmp_path / "events.tsv", tmp_path / "pulses.tsv"
    rows = [
        f"{100 + e.stamp / 1e9:.9f}\t{e.kind.name.lower()}\t{e.side.name.lower()}"
        for e in simulation.events
    ]
    events.write_text("\n".join(["onset\ttrial_type\tside", *rows]))
    onsets = [f"{100 + onset / 1e9:.9f}" for onset in simulation.onsets]
    pulses.write_text("\n".join(["onset", *onsets]))
    return "--events", events, "--pulses", pulses


def test_a_run_from_tables_has_the_outcome_of_the_same_run(capsys, tables, simulation):
    code, out, err = entrain(capsys, "analyze", *tables, "--side", "right", "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert (told["verdict"], told["entrained_since_stride"]) == ("entrained", 29)
    lag = simulation.analysis.pulses[-1].phase_lag
    assert told["final_phase_lag"] == pytest.approx(lag, abs=1e-6)
    late = entrain(capsys, "analyze", *tables, "--side=right", "--toe-off-bias=0.01", "--json")[1]
    assert json.loads(late)["final_phase_lag"] == pytest.approx(lag + 0.01, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "missing: --events, --pulses, --side"),
        (["--events", "e.tsv", "--pulses", "p.tsv"], "missing: --side"),
        (["bag", "--events", "e.tsv", "--pulses", "p.tsv", "--side", "left"], "give BAG, or else"),
    ],
)
def test_a_bag_or_tables_and_the_leg(capsys, words, message):
    code, out, err = entrain(capsys, "analyze", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_detect_writes_beside_the_file_and_prints(capsys, tmp_path):
    def load(n):
        return 800 if n % 110 < 68 else 0

    rows = [f"{n / 100:g},{load(n)},{load(n + 55)}" for n in range(1200)]
    path = tmp_path / "walk.csv"
    path.write_text("\n".join(["time,left_force_z,right_force_z", *rows]))
    code, out, err = entrain(capsys, "detect", path, "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert told["detector"] == "vertical_force"
    assert told["counts"]["left_heel_strike"] >= 9
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
        (["FILE", "--column", "time=z"], "has no column z, which is to be time"),
        (["FILE", "--detector", "guess"], "detector: 'guess' is unknown"),
        (["FILE"], "holds no gait event"),
    ],
)
def test_what_is_refused_is_one_line(capsys, tmp_path, words, message):
    path = tmp_path / "walk.csv"
    path.write_text("time,left_force_z\n0,0\n0.01,0\n")
    code, out, err = entrain(capsys, "detect", *(str(path) if w == "FILE" else w for w in words))
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
