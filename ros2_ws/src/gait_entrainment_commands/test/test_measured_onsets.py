# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Measured onsets as they become known: any interleaving gives the onsets of the whole run."""

from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import PulseTiming, PulseTrain, find_driver
from gait_entrainment_commands.timing import MeasuredOnsets

MS = 1_000_000
HEIGHT, WIDTH = 10.0, 0.1


def record(driver, period):
    """Return the three streams of a run of 8 pulses: promises, pulses, states."""
    robot = find_driver(driver).make(Side.LEFT, seed=3)
    robot.configure()
    robot.activate()
    robot.begin(0)
    robot.schedule(PulseTrain.periodic(Side.LEFT, 400 * MS, period, 8, HEIGHT, WIDTH))
    promises, states = [], []
    for until in range(90 * MS, 4500 * MS, 290 * MS):
        profile = robot.promise(until)
        promises.append((list(profile.onsets), profile.valid_until))
        states += robot.read()
    return promises, [onset for onsets, _ in promises for onset in onsets], states


RUNS = [
    record("emulated:jitter=0.005,loss=0.3,state_rate=200", 0.45),
    # The next pulse begins before the previous one can be judged.
    record("emulated:bandwidth=5,delay=0.05,loss=0.3,state_rate=200", 0.15),
    record("ideal", 0.15),
]


def judged_at_once(pulses, states):
    onsets = MeasuredOnsets()
    for state in states:
        onsets.add_state(state)
    for onset in pulses:
        onsets.add_pulse(onset, HEIGHT, WIDTH)
    onsets.add_promise(pulses, states[-1].stamp + 1)
    onsets.finish()
    return onsets.timings


@settings(derandomize=True, deadline=None, max_examples=60)
@given(run=st.sampled_from(RUNS), random=st.randoms(use_true_random=False))
def test_every_interleaving_gives_the_audit_of_the_whole_run_and_keeps_its_promises(run, random):
    promises, pulses, states = run
    streams = [list(reversed(stream)) for stream in run]
    onsets, promised = MeasuredOnsets(), 0
    known = []
    while any(streams):
        kind = random.choice([k for k in range(3) if streams[k]])
        for _ in range(random.randint(1, min(len(streams[kind]), 1 + 40 * (kind == 2)))):
            item = streams[kind].pop()
            if kind == 0:
                found, until = onsets.add_promise(*item)
            elif kind == 1:
                found, until = onsets.add_pulse(item, HEIGHT, WIDTH)
            else:
                found, until = onsets.add_state(item)
            assert all(onset >= promised for onset in found)
            known += found
            promised = max(promised, until)
    # All but the last pulses are known before the end.
    assert promised > promises[-1][1] - 900 * MS
    known += onsets.finish()
    assert onsets.timings == judged_at_once(pulses, states)
    assert known == [timing.onset for timing in onsets.timings]
    assert len(known) == 8


def test_pulses_cancelled_by_a_stop_have_no_onset():
    onsets = MeasuredOnsets()
    onsets.add_promise([100 * MS, 700 * MS, 900 * MS], 1000 * MS)
    onsets.add_pulse(100 * MS, HEIGHT, WIDTH)
    onsets.add_pulse(700 * MS, HEIGHT, WIDTH)
    onsets.stop(500 * MS)
    assert onsets.finish() == [100 * MS]


def test_a_pulse_that_was_never_announced_begins_as_commanded():
    onsets = MeasuredOnsets()
    onsets.add_promise([100 * MS], 1000 * MS)
    assert onsets.finish() == [100 * MS]
    assert onsets.timings == [PulseTiming(100 * MS, None, None)]
