# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Lock-step runs give the events of the simulation, and the same bytes every time."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from harness import (
    PROMISED_TOPICS,
    entrain_run,
    events_since_start,
    payloads,
    simulated_events,
    stamp_of,
)

from gait_entrainment.conventions import Side
from gait_entrainment.protocol import read_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader, check
from gait_entrainment_bags.figures import draw_figures
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_commands.outcome import outcome_of

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import make_figures

# Pulses later than the strides: the last ones are on, or still to come, when the run ends.
UNFINISHED = ("--side=left", "--period-offset=0.04", "--washout=0", "--initial-phase=0.9")


@pytest.fixture(scope="module")
def paper_example(tmp_path_factory):
    """Run the default protocol in lock-step, undisturbed."""
    bag = tmp_path_factory.mktemp("lock_step") / "undisturbed"
    with entrain_run(bag, "--json") as run:
        return bag, run.outcome()


def test_events_match_the_simulation_to_the_nanosecond(paper_example):
    bag, _ = paper_example
    events = events_since_start(bag)
    assert len(events) > 4 * 80
    assert events == simulated_events(bag)


BLOCKS = """
name: blocks
pulses: {count: 4, width: 0.2, torque: 6}
baseline: 4
washout: 2
blocks:
  - {name: sham, pulses: {torque: 0, jitter: 0.02}, rest: 4}
  - {name: assisted, pulses: {phase: 0.42, shape: half_sine, rising: 2}}
  - name: own shape
    side: left
    pulses: {shape: samples, samples: [0, 1, 0.3, 0], catch_pulses: [2]}
  - {name: in turn, side: both}
"""


def test_blocks_pulses_by_phase_and_shapes_match_the_simulation(tmp_path):
    (tmp_path / "blocks.yaml").write_text(BLOCKS)
    bag = tmp_path / "bag"
    with entrain_run(bag, str(tmp_path / "blocks.yaml"), "--json") as run:
        outcome = run.outcome()
    simulation = simulate(read_protocol(BLOCKS))
    assert events_since_start(bag) == simulated_events(bag)
    recorded = read_run(bag)
    start = recorded.events[0].stamp
    found = [(side, timing.commanded - start) for side, timing in recorded.delivered]
    assert found == [(side, timing.commanded) for side, timing in simulation.delivered]
    assert recorded.differences == ()
    expected = outcome_of(simulation)["blocks"]
    assert [{**a, **b} for a, b in zip(expected, outcome["blocks"], strict=True)] == expected
    with BagReader(bag) as reader:
        states = [m for _, m in reader.decoded(["/experiment/state"])]
        pulses = [m for _, m in reader.decoded(["/perturbation/pulses"])]
    shown = dict.fromkeys((m.block, m.block_name, m.phase) for m in states)
    assert (1, "sham", 6) in shown
    assert [state for state in shown if 0 < state[2] < 4] == [
        (number, name, phase)
        for number, name in enumerate(("sham", "assisted", "own shape", "in turn"), start=1)
        for phase in (1, 2, 3)
    ]
    by_ankle = [[pulse for pulse in pulses if pulse.side == side] for side in Side]
    for ankle_pulses, torques in zip(
        by_ankle, ([6, 0] + [6] * 6, [0] * 4 + [2, 4] + [6] * 6), strict=True
    ):
        assert [pulse.number for pulse in ankle_pulses] == list(range(1, len(torques) + 1))
        assert [pulse.torque for pulse in ankle_pulses] == torques
    assert [block["side"] for block in expected] == ["right", "right", "left", "right"]


def test_outcome_describes_what_happened(paper_example):
    bag, outcome = paper_example
    assert outcome["verdict"] == "entrained"
    assert len(outcome["stride_period"]) == 80
    assert len(outcome["pulses"]) == 50
    assert outcome["lost"] == 0
    with BagReader(bag) as reader:
        assert outcome["messages"] == reader.message_count
    assert outcome["bag"] == str(bag)
    assert outcome["real_time_factor"] > 1
    assert (bag / "protocol.yaml").is_file()
    assert [f for f in check(bag) if f.severity.name == "ERROR"] == []


def test_offline_analysis_reproduces_what_the_analyzer_published(paper_example):
    bag, _ = paper_example
    analysis = read_run(bag).analysis
    with BagReader(bag) as reader:
        strides = [m for _, m in reader.decoded(["/gait/strides"])]
        pulses = [m for _, m in reader.decoded(["/gait/pulse_phases"])]
        verdicts = [m for _, m in reader.decoded(["/gait/entrainment"])]
    assert [(stamp_of(m.header), m.number, m.period, *m.step_periods) for m in strides] == [
        (s.end, s.number, s.period, *s.step_periods) for s in analysis.strides
    ]
    assert [
        (stamp_of(m.header), m.number, m.stride, m.phase, m.phase_lag, m.unwrapped_lag)
        for m in pulses
    ] == [
        (p.onset, p.number, p.stride, p.phase, p.phase_lag, p.unwrapped_lag)
        for p in analysis.pulses
    ]
    assert len(verdicts) > 20
    # As text, in which NaN equals NaN.
    assert [
        f"{stamp_of(m.header)} {m.verdict} {m.stride} {m.since_stride} {m.mean_period!r} "
        f"{m.drift!r} {m.drift_interval!r} {m.entrained_since_stride}"
        for m in verdicts
    ] == [
        f"{e.stamp} {int(e.verdict)} {e.stride} {e.since_stride} {e.mean_period!r} "
        f"{e.drift!r} {e.drift_interval!r} {e.entrained_since_stride or 0}"
        for e in analysis.entrainments
    ]


def test_log_times_are_the_stamps_of_the_messages(paper_example):
    bag, _ = paper_example
    with BagReader(bag) as reader:
        for raw, message in reader.decoded(["/joint_states", "/gait_events", "/gait/strides"]):
            assert raw.log_time == stamp_of(message.header)
        assert reader.counts["/joint_states"] == reader.counts["/ground_reaction/left"]
        assert reader.counts["/joint_states"] > 200 * 80 * 1.8


def test_picture_in_the_readme_is_up_to_date(paper_example, tmp_path):
    known = make_figures.DOCS / make_figures.RUN
    if not make_figures.drawn_by_this_matplotlib(known):
        pytest.skip("the picture was drawn by another version of matplotlib")
    bag, _ = paper_example
    draw_figures(read_run(bag), tmp_path)
    assert make_figures.same(known, tmp_path / known.name), "make figures"


def test_load_and_delayed_processes_change_no_byte(paper_example, tmp_path):
    undisturbed, _ = paper_example
    chance = random.Random(1)
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    delays = 0
    try:
        with entrain_run(tmp_path / "disturbed", "--json") as run:
            nodes = list(run.find_nodes().values())
            while run.process.poll() is None:
                node = chance.choice(nodes)
                try:
                    os.kill(node, signal.SIGSTOP)
                    time.sleep(chance.uniform(0.01, 0.3))  # the disturbance, not a wait
                    os.kill(node, signal.SIGCONT)
                except ProcessLookupError:
                    continue
                delays += 1
                time.sleep(chance.uniform(0.0, 0.1))
            assert run.outcome()["lost"] == 0
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()
    assert delays > 20
    expected = payloads(undisturbed, PROMISED_TOPICS)
    found = payloads(tmp_path / "disturbed", PROMISED_TOPICS)
    for topic in PROMISED_TOPICS:
        assert len(expected[topic]) > 0
        assert found[topic] == expected[topic], topic


def test_concurrent_runs_do_not_hear_each_other(tmp_path):
    options = ("--json", "--sample-rate=0", "--no-ground-reaction", *UNFINISHED)
    with (
        entrain_run(tmp_path / "one", *options) as one,
        entrain_run(tmp_path / "other", *options) as other,
    ):
        assert one.domain() != other.domain()
        assert one.outcome()["lost"] == other.outcome()["lost"] == 0
    found = payloads(tmp_path / "one", PROMISED_TOPICS)
    assert found == payloads(tmp_path / "other", PROMISED_TOPICS)
    assert not found["/ground_reaction/left"]
    assert len(found["/joint_states"]) == len(found["/gait_events"])
    assert events_since_start(tmp_path / "one") == simulated_events(tmp_path / "one")
