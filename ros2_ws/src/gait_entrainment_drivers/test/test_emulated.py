# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The emulated robot: closed forms of each flaw, and the same results however it is cut."""

import itertools
import math
import statistics

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceLimits, PulseTrain, find_driver

MS = 1_000_000
EXACT = "delay=0,jitter=0,noise=0,loss=0,bandwidth=300,torque_rate=1e6,resolution=1e-4"


def robot(options, seed=0):
    made = find_driver(f"emulated:{options}").make(Side.LEFT, DeviceLimits(duty=1.0), seed)
    made.configure()
    made.activate()
    made.begin(0)
    return made


def train(count=1, period=0.5, torque=10.0, duration=0.2):
    return PulseTrain.periodic(Side.LEFT, 100 * MS, period, count, torque, duration)


def pieces(profiles):
    """Return the torque in each millisecond of adjoining profiles."""
    torques = []
    for profile in profiles:
        ends = [*profile.times[1:], profile.valid_until]
        for begin, end, torque in zip(profile.times, ends, profile.torques, strict=True):
            torques += [torque] * ((end - begin) // MS)
    return torques


def delivered(options, pulses=None, until=1000, seed=0):
    made = robot(options, seed)
    made.schedule(pulses or train())
    return pieces([made.promise(until * MS)]), made.read()


def test_the_lag_is_first_order_and_its_rise_time_follows_from_the_bandwidth():
    torques, _ = delivered(EXACT.replace("bandwidth=300", "bandwidth=5"))
    for k in range(190):
        expected = 10 * (1 - math.exp(-2 * math.pi * 5 * (k + 1) / 1000))
        assert torques[100 + k] == pytest.approx(expected, abs=1e-9)
    tenth = next(k for k, torque in enumerate(torques) if torque >= 1)
    nine_tenths = next(k for k, torque in enumerate(torques) if torque >= 9)
    assert (nine_tenths - tenth) / 1000 == pytest.approx(0.35 / 5, abs=0.002)


def test_the_delay_shifts_the_whole_pulse():
    plain, _ = delivered(EXACT)
    late, _ = delivered(EXACT.replace("delay=0", "delay=0.03"))
    assert late[30:] == plain[:-30]
    assert not any(late[:130])


def test_rate_and_peak_are_never_exceeded():
    torques, _ = delivered("bandwidth=300,torque_rate=500,peak_torque=8", train(torque=7.9))
    steps = [b - a for a, b in itertools.pairwise(torques)]
    assert max(map(abs, steps)) <= 0.5 + 1e-9
    assert max(torques) == pytest.approx(7.9, abs=0.006)


def test_resolution_is_the_step_of_the_command():
    torques, _ = delivered(
        EXACT.replace("resolution=1e-4", "resolution=0.7").replace("300", "50"),
        train(period=0.6, duration=0.5),
    )
    assert torques[590] == pytest.approx(9.8, abs=1e-12)  # 14 steps
    assert torques[-1] == 0.0


def test_noise_and_bias_affect_only_the_measurement():
    _, states = delivered("noise=0.3,bias=-0.5,state_rate=1000", until=20_000)
    quiet = [state.measured for state in states if state.stamp > 1000 * MS]
    # Mean and deviation of n samples lie within 5 standard errors.
    assert statistics.fmean(quiet) == pytest.approx(-0.5, abs=5 * 0.3 / len(quiet) ** 0.5)
    assert statistics.stdev(quiet) == pytest.approx(0.3, abs=5 * 0.3 / (2 * len(quiet)) ** 0.5)


def test_jitter_delays_pulses_within_its_bound_and_differs_between_them():
    torques, _ = delivered(EXACT.replace("jitter=0", "jitter=0.02"), train(40, 0.4), 17_000)
    onsets = [k for k in range(1, len(torques)) if torques[k] and not torques[k - 1]]
    late = [onset - 100 - 400 * n for n, onset in enumerate(onsets)]
    assert len(late) == 40
    assert min(late) >= 0
    assert max(late) <= 20
    assert len(set(late)) > 10
    assert statistics.fmean(late) == pytest.approx(10, abs=5 * 20 / (12 * 40) ** 0.5 + 1)


def test_a_lost_command_leaves_the_last_one_in_force():
    torques, _ = delivered(EXACT.replace("loss=0", "loss=0.5"), train(60, 0.4), 25_000)
    late = []
    for n in range(60):
        late.append(next(k for k in range(400) if torques[100 + 400 * n + k]))
    # Geometric: n ticks late with probability 0.5 ** (n + 1); mean 1, variance 2.
    assert statistics.fmean(late) == pytest.approx(1.0, abs=5 * (2 / 60) ** 0.5)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    cuts=st.lists(st.integers(0, 1500 * MS), max_size=12),
    seed=st.integers(0, 2**32),
    duration=st.floats(0.001, 0.25),
)
def test_torque_and_states_do_not_depend_on_the_cuts(cuts, seed, duration):
    options = "jitter=0.01,loss=0.2,noise=0.5,state_rate=250"
    pulses = train(4, 0.26, duration=duration)
    whole, cut = robot(options, seed), robot(options, seed)
    whole.schedule(pulses)
    cut.schedule(pulses)
    at_once = whole.promise(1500 * MS)
    profiles = [cut.promise(until) for until in [*sorted(cuts), 1500 * MS]]
    merged = []
    for profile in profiles:
        ends = [*profile.times[1:], profile.valid_until]
        for begin, end, torque in zip(profile.times, ends, profile.torques, strict=True):
            if begin < end and (not merged or merged[-1][1] != torque):
                merged.append((begin, torque))
    assert merged == list(zip(at_once.times, at_once.torques, strict=True))
    assert [o for p in profiles for o in p.onsets] == list(at_once.onsets)
    assert list(cut.read()) == list(whole.read())


def test_only_the_same_seed_gives_the_same_numbers():
    first, second, other = (delivered("", seed=seed)[1] for seed in (1, 1, 2))
    assert first == second
    assert first != other
    assert len(first) == 500


def test_cancelling_ends_the_torque_immediately():
    made = robot("")
    made.schedule(train())
    assert made.promise(200 * MS).torques[-1] > 5
    made.cancel()
    assert made.promise(400 * MS).torques == (0.0,)
