# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Each protocol in examples/ can be simulated, does what its name says, and states its origin."""

from pathlib import Path

import pytest

from gait_entrainment.protocol import read_protocol, write_protocol
from gait_entrainment.robot import Shape
from gait_entrainment.simulation import simulate
from gait_entrainment_commands.outcome import outcome_of, summary

FOLDER = Path(__file__).parents[1] / "examples" / "protocols"


def simulated(name):
    """Simulate a protocol and check what holds for all; return simulation and outcome."""
    path = FOLDER / f"{name}.yaml"
    protocol = read_protocol(path)
    assert protocol.name == name
    assert read_protocol(write_protocol(protocol)) == protocol
    simulation = simulate(protocol)
    assert simulation.ending is None
    outcome = outcome_of(simulation)
    assert outcome["holes"] == []
    assert len(outcome["pulses"]) == protocol.planned.count
    assert summary(outcome)
    return simulation, outcome


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_its_first_two_lines_state_its_origin(path):
    lines = path.read_text().splitlines()
    assert [line.startswith("# ") for line in lines[:3]] == [True, True, False]
    assert f"test_{path.stem}" in globals()


def test_entrainment_both_ways():
    _, outcome = simulated("entrainment_both_ways")
    faster, slower = outcome["blocks"]
    assert faster["entrained"]
    assert slower["verdict"] == "drifting"
    assert slower["first_stride"] - faster["last_stride"] > 60 / 1.94


def test_exoskeleton_timing():
    simulation, outcome = simulated("exoskeleton_timing")
    assert outcome["blocks"][0]["pulses"] == 0
    for block, phase in zip(simulation.blocks[1:], (0.36, 0.42, 0.48, 0.54), strict=True):
        assert block.name == f"at {phase:.0%}".replace("%", " %")
        placed = [pulse.phase for pulse in block.analysis.pulses]
        assert placed == pytest.approx([phase] * 20, abs=0.02)
        assert placed[-1] == pytest.approx(phase, abs=1e-4)


def test_frequency_sweep():
    simulation, outcome = simulated("frequency_sweep")
    periods = outcome["stride_period"]
    # It follows the sweep to the edge of the basin, then falls back to its own period.
    assert min(periods[15:165]) < periods[0] - 0.06
    assert periods[-1] == pytest.approx(periods[0], abs=1e-3)
    steps = [(b - a) / 1e9 for a, b in zip(simulation.onsets, simulation.onsets[1:], strict=False)]
    assert steps[-1] - steps[0] == pytest.approx(-0.12, abs=1e-6)


def test_ramped_trapezoid():
    simulation, outcome = simulated("ramped_trapezoid")
    torques = [pulse.torque for pulse in simulation.train.pulses]
    assert torques == pytest.approx([min(n / 21, 1) * 8 for n in range(1, 31)])
    assert {pulse.shape for pulse in simulation.train.pulses} == {Shape.TRAPEZOID}
    (block,) = outcome["blocks"]
    washout = simulation.events[-1].stamp - simulation.train.end
    assert washout >= 20e9
    assert block["last_stride"] > 10 + 30 + 5


def test_sham_controlled():
    simulation, outcome = simulated("sham_controlled")
    sham, real = outcome["blocks"]
    assert sham["verdict"] == "drifting"
    assert real["entrained"]
    torques = [pulse.torque for pulse in simulation.train.pulses]
    assert torques.count(0.0) == 8


def test_single_pulses():
    simulation, outcome = simulated("single_pulses")
    assert sum(pulse.torque != 0 for pulse in simulation.train.pulses) == 10
    assert not outcome["entrained"]
