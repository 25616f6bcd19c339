# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The safety envelope: nothing reaches a driver around it, and every exit ends in zero torque."""

import itertools
import math
import time
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    Dose,
    Fault,
    GuardedRobot,
    LimitError,
    PlannedPulses,
    Pulse,
    PulseTrain,
    RobotState,
    Shape,
    TorqueProfile,
    find_driver,
)
from gait_entrainment.robot.faults import DRIVER_BLOCKED, EXPERIMENT_SILENT, READINGS_OLD

from .recording_robot import RecordingRobot

SECOND = 1_000_000_000
OVERHEATED = Fault("overheated", "The motor is too hot.")


def train(**changes):
    values = {
        "side": Side.LEFT,
        "first_onset": 3 * SECOND,
        "period": 1.9,
        "count": 4,
        "torque": 13.0,
        "duration": 0.1,
    }
    return PulseTrain.periodic(**{**values, **changes})


def ready(limits=None, simulated=True):
    driver = RecordingRobot(Side.LEFT, simulated=simulated)
    guard = GuardedRobot(driver, Side.LEFT, limits)
    guard.configure()
    guard.activate()
    guard.begin(0)
    return guard, driver


@pytest.mark.parametrize(
    ("limits", "changes", "words"),
    [
        ({}, {"torque": 20.1}, "more than the device can deliver.*-20 to 20"),
        ({}, {"torque": -20.1}, "more than the device can deliver"),
        ({"torque": 12.0}, {}, "torque: 13 N m.*-12 to 12"),
        ({"torque": 12.0}, {"torque": -13.0}, "torque"),
        ({}, {"torque": math.nan}, "torque: nan"),
        ({}, {"torque": math.inf}, "torque: inf"),
        ({"duration": 0.09}, {}, "width: 0.1 s"),
        ({"rate": 200.0}, {}, "rate: a pulse of 0.1 s does not reach 13 N m at 200 N m/s"),
        ({"impulse": 1.2}, {}, "impulse: 1.3 N m s within 1 s.*at most 1.2"),
        ({"rate": 200.0}, {"torque": -13.0}, "rate"),
        ({"impulse": 1.5}, {"period": 0.5}, "impulse: 2.6 N m s"),
        ({"impulse": 1.5}, {"period": 0.5, "torque": -13.0}, "impulse: 2.6 N m s"),
        ({"duty": 0.05}, {}, "duty: 0.0526.*at most 0.05"),
        ({"pulses_per_minute": 30.0}, {}, r"period: 1.9 s; allowed: at least 2 s \(30 pulses"),
        ({}, {"period": 2e-9, "duration": 1e-9}, "period: 2e-09 s"),
        ({"session_pulses": 3}, {}, "session_pulses: 4 in all; allowed: at most 3"),
        ({"session_impulse": 5.0}, {}, "session_impulse: 5.2 in all.*at most 5"),
        ({}, {"count": 10_001}, "count: 10001; allowed: 1 to 10000 at a time"),
        ({}, {"first_onset": -1}, "already promised"),
        ({}, {"side": Side.RIGHT}, "other ankle"),
    ],
)
def test_a_train_outside_the_limits_never_reaches_the_driver(limits, changes, words):
    guard, driver = ready(DeviceLimits(**limits))
    with pytest.raises(LimitError, match=words):
        guard.schedule(train(**changes))
    assert "schedule" not in driver.calls
    assert guard.train is None
    assert not guard.faults


@pytest.mark.parametrize(
    "limits",
    [
        {"torque": 13.0},
        {"duration": 0.1},
        {"impulse": 1.3001},
        {"duty": 0.0527},
        {"rate": 260.0},
        {"pulses_per_minute": 60 / 1.9},
        {"session_pulses": 4, "session_impulse": 5.2001},
    ],
)
def test_a_train_at_its_limits_is_accepted(limits):
    guard, _ = ready(DeviceLimits(**limits))
    guard.schedule(train())
    assert guard.train is not None


def test_peak_torque_right_at_the_end_of_the_promise_is_allowed():
    guard, _ = ready()
    guard.promise(SECOND)
    guard.schedule(train(torque=-20.0, first_onset=SECOND))
    assert guard.train is not None


def test_an_overlapping_train_is_refused_until_a_cancel_or_a_new_run():
    guard, driver = ready()
    for clear in (guard.cancel, lambda: guard.begin(0)):
        guard.schedule(train())
        with pytest.raises(LimitError, match="overlap"):
            guard.schedule(train())
        clear()
        assert guard.train is None
    assert driver.calls.count("schedule") == 2


def test_limits_still_hold_after_a_train_is_cancelled():
    limits = {"pulses_per_minute": 60.0, "impulse": 1.5}
    guard, _ = ready(DeviceLimits(**limits))
    guard.schedule(train(first_onset=SECOND, count=2))
    guard.promise(SECOND + 60_000_000)  # 60 of 100 ms of the first pulse
    guard.cancel()
    with pytest.raises(LimitError, match=r"period: 0\.5 s; allowed: at least 1 s"):
        guard.schedule(train(first_onset=SECOND * 3 // 2, count=1))
    guard, _ = ready(DeviceLimits(**limits | {"pulses_per_minute": 600.0}))
    guard.schedule(train(first_onset=SECOND, count=2))
    guard.promise(SECOND + 60_000_000)
    guard.cancel()
    with pytest.raises(LimitError, match=r"impulse: 2\.08 N m s within 1 s"):
        guard.schedule(train(first_onset=SECOND * 3 // 2, count=1))
    guard.schedule(train(first_onset=2 * SECOND + 60_000_000, count=1))
    guard.begin(0)  # another run
    guard.schedule(train(first_onset=SECOND, count=1))


def test_limits_hold_across_two_trains():
    guard, _ = ready(DeviceLimits(impulse=1.5, duty=1.0))
    guard.schedule(train(count=1))
    with pytest.raises(LimitError, match=r"impulse: 2\.6 N m s within 1 s"):
        guard.schedule(train(first_onset=3 * SECOND + 700_000_000))
    guard.schedule(train(first_onset=4 * SECOND + 1, count=1))
    assert guard.train.onsets == (3 * SECOND, 4 * SECOND + 1)


def test_pulses_requested_one_by_one_rise_like_those_of_one_train():
    guard, _ = ready(DeviceLimits(rising=2))
    onsets = [n * SECOND for n in (3, 5, 7, 9, 20)]  # the last one after a pause
    for onset in onsets:
        guard.schedule(train(first_onset=onset, count=1, torque=12.0))
    assert [pulse.torque for pulse in guard.train.pulses] == [4.0, 8.0, 12.0, 12.0, 4.0]


def test_a_flank_is_checked_against_the_rate_whatever_the_shape():
    limits = DeviceLimits(rate=300.0)
    limits.check_pulse(Pulse(0, 9.5, 0.1, Shape.HALF_SINE))
    for pulse in (
        Pulse(0, 9.6, 0.1, Shape.HALF_SINE),
        Pulse(0, 9.0, 0.1, Shape.TRAPEZOID, rise=0.02, fall=0.05),
        Pulse(0, 9.0, 0.1, Shape.SAMPLES, samples=(0.1, 1.0, 0.0)),
    ):
        with pytest.raises(LimitError, match=r"rate: .*allowed: at most 300"):
            limits.check_pulse(pulse)


def test_a_robot_is_activated_once_and_then_needs_a_new_run():
    guard, driver = ready()
    with pytest.raises(DeviceError, match="already active; deactivate"):
        guard.activate()
    assert driver.calls.count("activate") == 1
    guard.close()
    guard.configure()
    guard.activate()
    with pytest.raises(DeviceError, match="begin one first"):
        guard.schedule(train())


def test_a_single_pulse_is_checked_against_the_impulse_before_anything_moves():
    limits = DeviceLimits(impulse=1.2)
    limits.check_pulse(Pulse(0, -11.9, 0.1))
    with pytest.raises(LimitError, match=r"impulse: 1\.3 N m s"):
        limits.check_pulse(Pulse(0, -13.0, 0.1))


@pytest.mark.parametrize("torque", [-13.0, 13.0])
def test_a_rate_limit_turns_flanks_into_ramps(torque):
    guard, driver = ready(DeviceLimits(rate=520.0))
    guard.schedule(train(torque=torque))
    flanks = {(pulse.shape, pulse.rise, pulse.fall) for pulse in driver.train.pulses}
    assert flanks == {(Shape.TRAPEZOID, 0.025, 0.025)}


@pytest.mark.parametrize("call", ["activate", "arm", "begin", "schedule", "promise"])
def test_calls_in_the_wrong_order_command_nothing(call):
    driver = RecordingRobot(Side.LEFT)
    guard = GuardedRobot(driver, Side.LEFT)
    arguments = {"begin": (0,), "schedule": (train(),), "promise": (1,)}.get(call, ())
    with pytest.raises(DeviceError, match=r"first|before|no run"):
        getattr(guard, call)(*arguments)
    assert driver.calls == []


def test_a_real_device_needs_arming():
    guard, driver = ready(simulated=False)
    with pytest.raises(DeviceError, match="not armed"):
        guard.schedule(train())
    guard.arm()
    guard.schedule(train())
    guard.close()
    assert driver.calls[-2:] == ["deactivate", "close"]
    guard.configure()
    guard.activate()
    assert not guard.armed


def test_arming_expires(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("gait_entrainment.robot.guard.time.monotonic", lambda: now[0])
    guard, driver = ready(DeviceLimits(arming=60.0), simulated=False)
    guard.arm()
    now[0] += 59.0
    assert guard.armed
    now[0] += 2.0
    with pytest.raises(DeviceError, match="armed more than 60 s ago; check that all is well"):
        guard.schedule(train())
    assert "schedule" not in driver.calls
    guard.arm()
    guard.schedule(train())
    guard.close()


def test_the_dose_carries_over_between_runs_and_robots():
    dose = Dose()

    def next_robot():
        limits = DeviceLimits(session_pulses=10)
        robot = find_driver("ideal").make(Side.LEFT, limits, dose=dose)
        robot.configure()
        robot.activate()
        robot.begin(0)
        return robot

    for _ in range(2):
        robot = next_robot()
        robot.schedule(train())
        robot.promise(20 * SECOND)
        robot.close()
    assert dose.pulses == 8
    assert dose.impulse == pytest.approx(8 * 1.3)
    with pytest.raises(LimitError, match="session_pulses: 12"):
        next_robot().schedule(train())
    robot = next_robot()
    robot.schedule(train(count=2))
    with pytest.raises(LimitError, match="session_pulses: 11"):  # scheduled pulses count too
        robot.schedule(train(first_onset=20 * SECOND, count=1))


def test_only_the_protocols_own_pulses_may_be_requested():
    planned = PlannedPulses(torque=13.0, duration=0.1, count=4)
    planned.check(train(), 0)
    planned.check(train(torque=-13.0, count=1), 3)
    for changes in ({"torque": -13.1}, {"duration": 0.11}, {"count": 5}, {"torque": math.nan}):
        with pytest.raises(LimitError, match="exceeds the protocol's pulses; allowed: at most"):
            planned.check(train(**changes), 0)


STATE = RobotState(SECOND, 0.0, 0.0, math.nan)


@pytest.mark.parametrize("simulated", [True, False])
@pytest.mark.parametrize(
    ("states", "words"),
    [
        ([STATE, replace(STATE, stamp=SECOND - 1)], f"{SECOND - 1}.* after {SECOND}"),
        ([replace(STATE, commanded=math.inf)], "commanded=inf"),
        ([replace(STATE, measured=math.nan)], "measured=nan"),
        ([replace(STATE, stamp=2 * time.time_ns())], r"driver failed: ValueError: .* by \d+ ns"),
        (None, "the driver failed: TypeError"),
    ],
)
def test_impossible_states_end_the_torque(monkeypatch, states, words, simulated):
    guard, driver = ready(simulated=simulated)
    guard.promise(2 * SECOND)
    monkeypatch.setattr(driver, "read", lambda: states)
    with pytest.raises(DeviceError, match=words):
        guard.read()
    assert [fault.name for fault in guard.faults] == ["driver_failed"]
    assert driver.calls[-1] == "stop"
    guard.close()


@pytest.mark.parametrize(("simulated", "faults"), [(True, []), (False, ["torque_exceeded"])])
def test_measured_torque_above_the_limit_latches_except_for_an_emulated_sensor(
    monkeypatch, simulated, faults
):
    guard, driver = ready(DeviceLimits(torque=10.0, overshoot=0.2), simulated)
    guard.promise(2 * SECOND)
    for torque, found in ((-12.0, []), (-12.1, faults)):
        states = [replace(STATE, measured=torque)]
        monkeypatch.setattr(driver, "read", lambda states=states: states)
        guard.read()
        assert [fault.name for fault in guard.faults] == found
    guard.close()


@pytest.mark.parametrize("simulated", [True, False])
@pytest.mark.parametrize(
    ("commanded", "measured", "seconds", "ends"),
    [(0.0, 2.5, 0.17, True), (0.0, 2.3, 9.0, False), (0.0, -2.5, 0.14, False),
     (2.0, 9.0, 9.0, False)],
)  # fmt: skip
def test_unrequested_torque_ends_in_time_whatever_the_driver(
    monkeypatch, simulated, commanded, measured, seconds, ends
):
    guard, driver = ready(simulated=simulated)
    guard.promise(60 * SECOND)
    ticks = [n * SECOND // 100 for n in range(101, 101 + round(100 * seconds))]
    states = [RobotState(SECOND, 5.0, 5.0, math.nan)]
    states += [RobotState(stamp, commanded, measured, math.nan) for stamp in ticks]
    monkeypatch.setattr(driver, "read", lambda: states)
    guard.read()
    names = [fault.name for fault in guard.faults]
    assert names == (["torque_unasked"] if ends and not simulated else [])
    guard.close()


def test_a_single_late_reading_is_not_unrequested_torque(monkeypatch):
    """A pulse ends while nothing is read, so the next reading was taken before its end."""
    guard, driver = ready(simulated=False)
    guard.promise(60 * SECOND)
    readings = [(1.0, 5.0, 5.0), (1.3, 0.0, 5.0), (1.31, 0.0, 0.0), (1.6, 0.0, 5.0)]
    states = [RobotState(round(at * SECOND), *torques, math.nan) for at, *torques in readings]
    monkeypatch.setattr(driver, "read", lambda: states)
    guard.read()
    assert guard.faults == ()
    guard.close()


@pytest.mark.parametrize("name", ["peak_torque", "torque_rate", "torque_bandwidth"])
@pytest.mark.parametrize("value", [math.nan, -1.0])
def test_invalid_capabilities_are_refused(name, value):
    with pytest.raises(LimitError, match=rf"capabilities\.{name}: .*; allowed: "):
        replace(find_driver("emulated").make(Side.LEFT).capabilities, **{name: value})


def test_a_stop_latches_until_the_robot_is_closed_and_configured():
    guard, driver = ready()
    guard.schedule(train())
    guard.stop()
    assert driver.calls[-1] == "stop"
    assert [f.name for f in guard.faults] == ["stopped"]
    for call in (lambda: guard.schedule(train()), guard.activate, guard.arm):
        with pytest.raises(DeviceError, match=r"latched at zero \(stopped\)"):
            call()
    guard.close()
    with pytest.raises(DeviceError, match="latched"):
        guard.schedule(train())
    guard.configure()
    guard.activate()
    guard.begin(0)
    guard.schedule(train())


def test_excess_delivered_torque_latches_and_is_still_reported():
    guard, driver = ready(DeviceLimits(torque=10.0, overshoot=0.1))
    driver.torques = [10.9, -11.1]
    guard.promise(SECOND // 10)
    assert not guard.faults
    assert guard.promise(2 * SECOND // 10).torques == (-11.1,)
    assert [f.name for f in guard.faults] == ["torque_exceeded"]
    assert driver.calls[-1] == "stop"


def test_torque_that_does_not_end_exceeds_the_impulse():
    guard, driver = ready(DeviceLimits(impulse=2.0, overshoot=0.0))
    driver.torques = [5.0] * 10
    found = [bool(guard.promise(k * SECOND // 10).side or guard.faults) for k in range(1, 7)]
    assert found == [False] * 4 + [True] * 2
    assert [f.name for f in guard.faults] == ["impulse_exceeded"]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    heights=st.lists(st.integers(-20, 20), min_size=5, max_size=60),
    limit=st.integers(1, 200),
    window=st.integers(100, 900),
)
def test_the_impulse_of_any_stride_is_watched(heights, limit, window):
    """Against a brute-force sliding window over milliseconds."""
    limits = DeviceLimits(impulse=limit / 100, stride=window / 1e3, overshoot=0.0)
    guard, driver = ready(limits)
    driver.torques = [float(h) for h in heights]
    per_ms = [abs(h) for h in heights for _ in range(50)]
    sums = [0, *itertools.accumulate(per_ms)]
    for k in range(1, len(heights) + 1):
        guard.promise(k * 50_000_000)
        ends = range(1, 50 * k + 1)
        # Windows are checked at the end of each piece of torque.
        largest = max(sums[e] - sums[max(e - window, 0)] for e in ends if e % 50 == 0)
        if abs(largest - limit * 10) > 1e-6:
            assert bool(guard.faults) == (largest > limit * 10)


def test_a_fault_reported_by_the_device_latches():
    guard, driver = ready()
    guard.schedule(train())
    driver.faults = (OVERHEATED,)
    guard.promise(SECOND)
    guard.read()
    assert guard.faults == (OVERHEATED,)
    assert driver.calls[-1] == "stop"


@pytest.mark.parametrize("error", [RuntimeError("boom"), DeviceError("gone"), KeyboardInterrupt()])
@pytest.mark.parametrize("call", ["schedule", "promise", "read", "cancel", "begin"])
def test_whatever_the_driver_raises_the_torque_goes_to_zero(call, error):
    guard, driver = ready()
    if call != "schedule":
        guard.schedule(train())
    driver.raises = {call: error}
    arguments = {"begin": (0,), "schedule": (train(),), "promise": (1,)}.get(call, ())
    with pytest.raises((DeviceError, KeyboardInterrupt)):
        getattr(guard, call)(*arguments)
    assert driver.calls[-1] == "stop"
    assert [f.name for f in guard.faults] == ["driver_failed"]


def test_an_exception_in_the_users_code_closes_the_robot():
    guard, driver = ready()
    guard.schedule(train())
    with pytest.raises(ZeroDivisionError), guard:
        raise ZeroDivisionError
    assert driver.calls[-2:] == ["deactivate", "close"]


def test_a_failing_deactivation_still_stops_and_closes():
    guard, driver = ready()
    driver.raises = {"deactivate": OSError("bus gone"), "stop": OSError("bus gone")}
    guard.close()
    assert driver.calls[-3:] == ["deactivate", "stop", "close"]
    assert [f.name for f in guard.faults] == ["driver_failed", "not_stopped"]


def test_a_device_that_does_not_answer_is_released_and_can_be_configured_later():
    driver = RecordingRobot(Side.LEFT)
    guard = GuardedRobot(driver, Side.LEFT)
    driver.raises = {"configure": DeviceError("motor 1 does not answer")}
    with pytest.raises(DeviceError, match="does not answer"):
        guard.configure()
    assert driver.calls == ["configure", "close"]
    with pytest.raises(DeviceError, match="not configured"):
        guard.activate()
    driver.raises = {}
    guard.configure()
    guard.activate()


def test_a_stop_during_a_schedule_wins():
    guard, driver = ready()
    driver.schedule = lambda _: guard.stop()  # as if another thread stopped it midway
    with pytest.raises(DeviceError, match="latched"):
        guard.schedule(train())
    assert driver.calls[-1] == "stop"
    assert guard.train is None


@pytest.mark.parametrize("states", ["nothing", "one state", "old states", "no torque", "all"])
def test_a_device_that_reports_nothing_new_is_a_fault(monkeypatch, states):
    guard, driver = ready(DeviceLimits(silence=0.5), simulated=False)
    guard.arm()
    steady, start = time.monotonic(), time.time_ns()
    if states == "no torque":
        nothing = TorqueProfile(guard.side, (start,), (0.0,), (), start)
        monkeypatch.setattr(driver, "promise", lambda _: nothing)
    guard.begin(start)
    guard.schedule(train(first_onset=guard.promised_until + 60 * SECOND))
    for tenth in range(8):
        now = start + tenth * SECOND // 10
        stamps = {"nothing": [], "one state": [start], "old states": [now // 2]}.get(states, [now])
        monkeypatch.setattr(driver, "read", lambda s=stamps: [replace(STATE, stamp=i) for i in s])
        monkeypatch.setattr("time.monotonic", lambda t=tenth: steady + t / 10)
        monkeypatch.setattr("time.monotonic_ns", lambda n=now: n - guard._offset)
        guard.heard()
        guard.promise(now)
        guard.read()
    assert guard.faults == (() if states == "all" else (READINGS_OLD,))
    guard.close()


def test_a_silent_experiment_stops_a_real_device():
    guard, driver = ready(DeviceLimits(silence=0.05), simulated=False)
    guard.arm()
    guard.schedule(train())
    assert driver.stopped.wait(5.0)
    assert guard.faults == (EXPERIMENT_SILENT,)
    guard.close()


@pytest.mark.parametrize("call", ["schedule", "promise", "read"])
def test_a_driver_that_does_not_return_is_stopped_and_named(call):
    guard, driver = ready(DeviceLimits(silence=0.05), simulated=False)
    guard.arm()
    guard.schedule(train(first_onset=SECOND, count=1))
    calls = {
        "schedule": lambda: guard.schedule(train()),
        "promise": lambda: guard.promise(1),
        "read": guard.read,
    }
    setattr(driver, call, lambda *_: driver.stopped.wait(5.0))
    with pytest.raises(DeviceError):
        calls[call]()
    assert guard.faults[0] == DRIVER_BLOCKED
    guard.close()


def test_whatever_stops_one_ankle_stops_both_and_they_share_a_dose():
    limits, dose = DeviceLimits(session_pulses=11), Dose()
    drivers = {side: RecordingRobot(side) for side in Side}
    left, right = (GuardedRobot(driver, s, limits, dose) for s, driver in drivers.items())
    left.partner, right.partner = right, left
    for guard in (left, right):
        guard.configure()
        guard.activate()
        guard.begin(0)
    left.schedule(train())
    right.schedule(train(side=Side.RIGHT))
    with pytest.raises(LimitError, match="session_pulses: 12 in all; allowed"):
        left.schedule(train(first_onset=20 * SECOND))
    drivers[Side.RIGHT].faults = (OVERHEATED,)
    right.read()
    assert left.faults == right.faults == (OVERHEATED,)
    assert (left.train, drivers[Side.LEFT].calls[-1]) == (None, "stop")
    with pytest.raises(DeviceError, match=r"latched at zero \(overheated"):
        left.schedule(train())


def test_a_broken_profile_stops_the_torque():
    guard, driver = ready()
    driver.promise = lambda until: TorqueProfile(Side.LEFT, (7,), (3.0,), (), until)
    with pytest.raises(DeviceError, match=r"the driver failed: ProfileError: .*adjoin"):
        guard.promise(SECOND)
    assert driver.calls[-1] == "stop"
