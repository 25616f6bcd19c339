# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The outcome of a run, for machines and for people."""

import math
from dataclasses import replace

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.gait import analyze
from gait_entrainment.protocol import Protocol, read_protocol
from gait_entrainment.robot import PulseTiming
from gait_entrainment.simulation import simulate
from gait_entrainment_commands.outcome import distribution, outcome_of, summary

MS = 1_000_000


def test_the_distribution_is_that_of_the_observed_pulses():
    timings = [PulseTiming(0, n * MS, None) for n in range(1, 201)] + [PulseTiming(0, None, None)]
    figures = distribution(timings, "sent", 2.0)
    assert figures["pulses"] == 200
    assert figures["missing"] == 1
    assert figures["median_ms"] == pytest.approx(100)
    assert figures["p99_ms"] == pytest.approx(198)
    assert figures["worst_ms"] == pytest.approx(200)
    assert figures["worst_percent"] == pytest.approx(10)
    assert distribution(timings, "measured", 2.0) is None
    sham = PulseTiming(0, None, None, torque=0.0)
    assert distribution([*timings, sham], "sent", 2.0)["missing"] == 1


def test_a_pulse_without_its_toe_off_does_not_affect_the_final_lag():
    simulated = simulate(Protocol())
    complete = outcome_of(simulated)
    last = simulated.analysis.pulses[-1].toe_off
    events = tuple(event for event in simulated.events if event.stamp != last)
    analysis = analyze(events, simulated.onsets, Side.RIGHT)
    assert math.isnan(analysis.pulses[-1].phase_lag)
    outcome = outcome_of(replace(simulated, events=events, analysis=analysis))
    assert outcome["final_phase_lag"] == pytest.approx(complete["final_phase_lag"], abs=1e-6)
    assert outcome["double_stance"] == pytest.approx(complete["double_stance"], abs=1e-6)


BLOCKS = """
baseline: 4
washout: 2
pulses: {count: 6}
blocks:
  - {name: real, rest: 3}
  - {name: sham, pulses: {torque: 0}}
  - {name: assist, pulses: {phase: 0.45, shape: half_sine, torque: 5}}
  - {name: none, pulses: {count: 0}}
"""


def test_each_block_has_its_own_line_and_verdict():
    outcome = outcome_of(simulate(read_protocol(BLOCKS)))
    blocks = outcome["blocks"]
    assert [block["name"] for block in blocks] == ["real", "sham", "assist", "none"]
    assert [block["pulses"] for block in blocks] == [6, 6, 6, 0]
    spans = [(block["first_stride"], block["last_stride"]) for block in blocks]
    assert [last - first + 1 for first, last in spans] == [12, 12, 12, 6]
    assert spans[1][0] > spans[0][1] + 1, "a rest"
    assert spans[2][0] == spans[1][1] + 1
    assert blocks[2]["reason"] == "too_close", "pulses by phase follow the gait"
    assert blocks[2]["perturbation_period"] is None
    assert outcome["holes"] == []
    text = summary(outcome).splitlines()
    assert text[0] == f"strides          {spans[3][1]}, pulses placed in them: 18"
    assert "6 pulses of 0.00 N m every" in text[3]
    assert "6 pulses of 5.00 N m at phase 0.45" in text[5]
    assert text[6].strip() == "untestable: pulses by phase follow the gait, whatever it does"
    assert text[7].endswith("no pulses")


@pytest.mark.parametrize(
    ("text", "begin", "end"),
    [
        ("pulses: {count: 0, phase: 0.4}", "none", ""),
        ("blocks: [{name: a}]", "13.35 N m for 0.1 s every", "(-50.0 ms)"),
        ("pulses: {catch_share: 0.3, count: 5}", "13.35 N m", ", 2 of them left out"),
        ("pulses: {catch_pulses: [2, 3, 2], count: 5}", "13.35", ", 2 of them left out"),
        ("pulses: {jitter: 0.05, count: 5}", "13.35 N m", ", each off by up to 50 ms"),
    ],
)
def test_the_summary_of_a_single_block_describes_its_pulses(text, begin, end):
    found = summary(outcome_of(simulate(read_protocol(text + "\n")))).splitlines()[2]
    assert found.startswith(f"pulses           {begin}")
    assert found.endswith(end)


def test_events_lost_between_blocks_are_a_hole():
    blocks = "[{baseline: 3, pulses: {count: 0}, rest: 30}, {baseline: 3, pulses: {count: 3}}]"
    simulated = simulate(read_protocol(f"blocks: {blocks}\n"))
    assert outcome_of(simulated)["holes"] == []
    ended = simulated.blocks[0].end
    lost = range(ended + 4 * 10**9, ended + 12 * 10**9)
    events = tuple(event for event in simulated.events if event.stamp not in lost)
    (hole,) = outcome_of(replace(simulated, events=events))["holes"]
    assert hole["missing"] == f"{len(simulated.events) - len(events)} gait events"
    assert hole["end"] - hole["start"] == pytest.approx(8.0, abs=1.5)


def test_an_open_baseline_is_reported_as_walked():
    protocol = read_protocol("baseline: 3\nbaseline_time: 12\nwashout: 1\npulses: {count: 3}\n")
    outcome = outcome_of(simulate(protocol))
    (block,) = outcome["blocks"]
    # 12 s are six to seven strides of 1.93 s.
    assert block["last_stride"] == len(outcome["stride_period"]) == 7 + 3 + 1
    assert outcome["holes"] == []
