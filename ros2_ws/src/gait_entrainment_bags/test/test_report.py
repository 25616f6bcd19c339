# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Outcome and figures of a run, checked against the simulation that they describe."""

import dataclasses
import json
import math
import struct

import numpy as np
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Hole, analyze
from gait_entrainment.protocol import Protocol, PulsePlan, read_protocol
from gait_entrainment.robot import PulseTiming
from gait_entrainment.simulation import Simulation, simulate
from gait_entrainment_bags.figures import draw_figures, run_figures
from gait_entrainment_bags.recorded_run import (
    STRIDES_DRAWN,
    AnkleTorques,
    RecordedRun,
    drawn_strides,
)
from gait_entrainment_commands.outcome import outcome_of, summary


@pytest.fixture(scope="module")
def simulation():
    return simulate(Protocol())


def test_the_final_lag_is_reported_with_its_place_in_double_stance(simulation):
    outcome = outcome_of(simulation)
    pulse = simulation.analysis.pulses[-1]
    # From the other leg's strike to the perturbed leg's toe-off, straight from the events.
    strike = max(e.stamp for e in simulation.events if not e.kind and e.stamp < pulse.toe_off)
    assert outcome["double_stance"] == pytest.approx((pulse.toe_off - strike) / 1e9)
    assert outcome["final_phase_lag"] == pytest.approx(pulse.phase_lag, abs=1e-8)
    percent = 100 * (pulse.onset - strike) / (pulse.toe_off - strike)
    assert f"{percent:.0f} % into double stance" in summary(outcome)


def test_a_slow_passage_is_reported_and_not_mistaken_for_a_lock():
    # docs/analysis.md: the lock there is unstable, and with more pulses the gait leaves it.
    plan = PulsePlan(period_offset=-0.07, initial_phase=0.6)
    outcome = outcome_of(simulate(Protocol(pulses=plan)))
    assert (outcome["verdict"], outcome["reason"]) == ("undecided", "creeping")
    assert "slow passage" in summary(outcome)


def test_unknown_values_are_null_in_json():
    protocol = Protocol(baseline=2, washout=0, pulses=PulsePlan(count=1))
    nothing = analyze([], [], Side.RIGHT)
    outcome = outcome_of(Simulation(protocol, (), (), math.nan, math.nan, nothing, (), None, None))
    text = json.dumps(outcome, allow_nan=False)
    assert json.loads(text)["unperturbed_stride_period"] is None
    assert json.loads(text)["verdict"] == "undecided"
    text = summary(outcome)
    assert "undecided: neither locked nor drifting" in text
    assert "the last 3 strides at 0.0 s: not in the record" in text


def recorded(simulation, **changes):
    """Return a run as if it had been recorded."""
    stamps = np.arange(0, simulation.events[-1].stamp, 5_000_000)
    zeros = np.zeros(len(stamps))
    run = RecordedRun(
        protocol=simulation.protocol,
        name="a_run",
        side=Side.RIGHT,
        events=simulation.events,
        measured_period=simulation.measured_period,
        pulse_period=simulation.pulse_period,
        analysis=simulation.analysis,
        blocks=(),
        delivered=simulation.delivered,
        torques=AnkleTorques(stamps, zeros + 50, zeros, zeros),
        messages=0,
        lost=None,
        real_time_factor=math.nan,
    )
    return dataclasses.replace(run, **changes)


def test_figures_are_drawn(simulation, tmp_path):
    run = recorded(simulation)
    others = tmp_path / "foreign"
    (tmp_path / "phase_lag.svg").symlink_to(others)
    paths = [p for p in draw_figures(run, tmp_path) if p.suffix == ".png"]
    assert [p.stem for p in paths] == ["stride_period", "phase_lag", "ankle_torque"]
    assert not others.exists()
    late = PulseTiming(run.onsets[0], run.onsets[0] + 10**7, run.onsets[0] + 2 * 10**7)
    late_run = dataclasses.replace(run, delivered=((Side.RIGHT, late),))
    paths = draw_figures(late_run, tmp_path)
    assert "pulse_timing" in [p.stem for p in paths]
    for path in (path for path in paths if path.suffix == ".png"):
        content = path.read_bytes()
        assert content.startswith(b"\x89PNG")
        width, height = struct.unpack(">II", content[16:24])
        assert width > 600
        assert height > 300


def test_long_names_short_runs_and_nan_stay_within_the_figure():
    walk = simulate(Protocol(baseline=3, washout=2, pulses=PulsePlan(count=0)))
    hole = Hole(walk.analysis.strides[0].end, walk.analysis.strides[3].start, "2 strides")
    run = recorded(
        walk,
        name="of a long name " * 30,
        analysis=dataclasses.replace(walk.analysis, holes=(hole,) * 2),
    )
    run.torques.intrinsic[100] = math.nan
    for name, figure in run_figures(run).items():
        box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
        assert (min(box.x0, box.y0) >= 0, box.x1 <= width, box.y1 <= height) == (True,) * 3, name
        if name == "stride_period":  # each stride is shaded once
            shades = [s for s in figure.axes[0].patches if s.get_label() == "not in the record"]
            assert len(shades) == 2
            low, high = figure.axes[0].get_ylim()
            assert high - low > 0.0099


def test_each_stride_is_drawn_while_a_lock_forms(simulation):
    numbers = [stride.number for stride in drawn_strides(simulation)]
    first = simulation.analysis.pulses[0].stride
    since = simulation.analysis.entrainments[-1].entrained_since_stride
    assert set(range(first, since + 2)) <= set(numbers)
    assert (numbers[0], numbers[-1]) == (1, 80)
    assert len(numbers) == len(set(numbers)) == STRIDES_DRAWN
    drifting = simulate(Protocol(pulses=PulsePlan(period_offset=-0.2)))
    numbers = [stride.number for stride in drawn_strides(drifting)]
    assert len(numbers) == STRIDES_DRAWN
    assert max(np.diff(numbers)) <= 4
    # Of the two blocks, only the first locks.
    plans = "{baseline: 15, pulses: {}, washout: 5}, {pulses: {period_offset: -0.2, count: 20}}"
    walk = simulate(read_protocol(f"blocks: [{plans}]\n"))
    assert [b.analysis.entrainments[-1].verdict.name for b in walk.blocks] == [
        "ENTRAINED",
        "DRIFTING",
    ]
    assert set(range(first, since + 2)) <= {stride.number for stride in drawn_strides(walk)}


def test_a_run_without_pulses_or_strides_can_be_drawn(tmp_path):
    empty = np.empty(0)
    run = RecordedRun(
        protocol=Protocol(),
        name="a_run",
        side=Side.RIGHT,
        events=(),
        delivered=(),
        measured_period=math.nan,
        pulse_period=math.nan,
        analysis=analyze([], [], Side.RIGHT),
        blocks=(),
        torques=AnkleTorques(empty.astype(np.int64), empty, empty, empty),
        messages=0,
        lost=None,
        real_time_factor=math.nan,
    )
    assert len(draw_figures(run, tmp_path)) == 2 * 3, "PNG and SVG"


def test_holes_are_reported_in_json_and_in_the_summary(simulation):
    onsets = simulation.onsets[:30] + simulation.onsets[31:]
    events = [e for e in simulation.events if e.step < 120]
    analysis = analyze(events, onsets, Side.RIGHT)
    outcome = outcome_of(dataclasses.replace(simulation, analysis=analysis))
    assert [hole["missing"] for hole in outcome["holes"]] == ["1 pulse(s)", "the last 21 strides"]
    assert outcome["holes"][0]["start"] == pytest.approx((onsets[29] - events[0].stamp) / 1e9)
    assert len(outcome["stretches"]) == 2
    text = summary(outcome)
    assert "1 pulse(s) at " in text
    assert "until stride" in text
    assert "the train is longer" not in text


def test_a_train_that_is_longer_than_the_run_is_reported():
    plan = PulsePlan(count=10, period_offset=0.3, torque_fraction=0.0)
    text = summary(outcome_of(simulate(Protocol(baseline=3, washout=0, pulses=plan))))
    assert "pulses placed in them: 9 of 10; the train is longer than the run" in text
