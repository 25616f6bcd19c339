# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Real time: the same walk as in lock-step, every sample sent with its exact stamp."""

import contextlib
import json
import multiprocessing
import os

import pytest
from harness import QUICK, entrain_run, protocol_of, stamp_of

from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader
from gait_entrainment_commands.outcome import outcome_of

RATE = 1000
# Near the locked phase, so that few pulses suffice; the verdict needs 25 of them.
OPTIONS = (*QUICK, "--baseline=3", "--pulses=30", "--washout=1", "--initial-phase=0.65")


@pytest.fixture(scope="module")
def real_time_run(tmp_path_factory):
    bag = tmp_path_factory.mktemp("real_time") / "bag"
    with entrain_run(bag, "--real-time", "--json", f"--sample-rate={RATE}", *OPTIONS) as run:
        run.wait_for_stride(1)
        for node in run.nodes.values():
            assert os.sched_getscheduler(node) == permitted_policy()
        return bag, run.outcome()


def permitted_policy():
    """Return the scheduling policy of a process that requests a real-time priority."""
    policy = multiprocessing.get_context("fork").Value("i", os.SCHED_OTHER)

    def request():
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(10))
        policy.value = os.sched_getscheduler(0)

    child = multiprocessing.get_context("fork").Process(target=request)
    child.start()
    child.join()
    return policy.value


def timing_of(bag):
    """Return the timing that the walker reported."""
    with BagReader(bag) as reader:
        ((_, timing),) = reader.decoded(["/walker_sim/timing"])
    return timing


def test_verdict_and_locked_lag_agree_with_the_simulation(real_time_run):
    bag, outcome = real_time_run
    simulation = simulate(protocol_of(*OPTIONS))
    expected = outcome_of(simulation)
    assert expected["verdict"] == outcome["verdict"] == "entrained"
    # Late and starved time is the timing error that the run itself reports.
    timing = timing_of(bag)
    error = timing.late + timing.starved
    assert outcome["final_phase_lag"] == pytest.approx(
        expected["final_phase_lag"], abs=1e-9 + error
    )
    if error == 0:
        with BagReader(bag) as reader:
            stamps = [stamp_of(m.header) for _, m in reader.decoded(["/gait_events"])]
        walked = [stamp - stamps[0] for stamp in stamps]
        both = min(len(walked), len(simulation.events))
        assert both > 4 * 33
        assert walked[:both] == [event.stamp for event in simulation.events][:both]


def test_every_sample_is_recorded_with_its_exact_stamp(real_time_run):
    bag, outcome = real_time_run
    assert outcome["lost"] == 0
    with BagReader(bag) as reader:
        start = min(m.log_time for m in reader.messages(["/gait_events"]))
        end = max(m.log_time for m in reader.messages(["/walker/progress"]))
        samples = (end - start) * RATE // 10**9
        assert samples > 15 * RATE
        due = [start + k * 10**9 // RATE for k in range(samples)]
        for topic in ("/joint_states", "/ankle_torque", "/ground_reaction/left"):
            stamps = [m.log_time for m in reader.messages([topic])]
            assert stamps[:samples] == due
            assert samples <= len(stamps) <= samples + 1


def test_lateness_is_measured_and_reported(real_time_run):
    bag, outcome = real_time_run
    timing, reported = timing_of(bag), outcome["publish_lateness_ms"]
    assert 0 < reported["p50"] <= reported["p99"] <= reported["worst"]
    for name, value in reported.items():
        assert 1e3 * getattr(timing, f"publish_late_{name}") == value
    assert json.dumps(outcome)
