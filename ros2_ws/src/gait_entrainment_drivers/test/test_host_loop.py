# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The torque loop of host-timed robots: what is measured is told once; lateness is a fault."""

import math
import threading
import time
from dataclasses import dataclass

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.robot import Capabilities, DeviceError, Fault, PulseTrain
from gait_entrainment.robot.guard import GuardedRobot
from gait_entrainment_drivers.host_loop import HostTimedRobot, Reading

from .emulator_process import until

SECOND = 1_000_000_000
OVERHEATED = Fault("overheated", "The motor is too hot.")


@dataclass(frozen=True)
class NoOptions:
    pass


class Echo(HostTimedRobot):
    """A device that measures what it was asked for; a test can hold it up."""

    Options = NoOptions
    capabilities = Capabilities(50.0, math.inf, True, False, 500.0)

    def __init__(self, lateness=0.5):
        super().__init__(Side.LEFT, rate=500.0, silence=5.0, lateness=lateness)
        self.sent = []
        self.disabled_after = None
        self.gate = threading.Event()
        self.gate.set()
        self.failing = False
        self.share = 1.0  # of the torque asked for that it measures
        self.left = 0  # ticks for which torque is still there once zero is asked for
        self.shut = False

    def _open(self):
        pass

    def _enable(self):
        pass

    def _exchange(self, torque, patience):  # noqa: ARG002
        self.gate.wait(5)
        if self.failing:
            raise OSError("bus gone")
        self.sent.append(torque)
        if torque == 0.0 and any(self.sent) and self.left:
            self.left -= 1
            return Reading(-20.0, 0.0)
        return Reading(self.share * torque, 0.0)

    def _disable(self):
        self.disabled_after = self.sent[-3:]

    def _shut(self):
        self.shut = True


def guarded(device):
    robot = GuardedRobot(device, Side.LEFT)
    robot.configure()
    robot.activate()
    robot.arm()
    robot.begin(time.time_ns())
    return robot


def push(robot):
    onset = time.time_ns() + SECOND // 20
    robot.schedule(PulseTrain(Side.LEFT, onset, 2.0, 1, 5.0, 0.5))


@example(gaps=[5] * 6, torques=[1, 2, 3, 1, 2, 3] + [0] * 24, cuts=[15, 20])
@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    gaps=st.lists(st.integers(1, 5), min_size=1, max_size=30),
    torques=st.lists(st.integers(-3, 3), min_size=30, max_size=30),
    cuts=st.lists(st.integers(0, 120), max_size=15),
)
def test_each_sample_holds_until_the_next_however_it_is_asked_for(gaps, torques, cuts):
    device = Echo()
    device.begin(10)
    stamps = []
    for gap in gaps:
        stamps.append((stamps[-1] if stamps else 0) + gap)
    device._samples = [(s, float(t)) for s, t in zip(stamps, torques, strict=False)]
    known = list(device._samples)
    told, begin = {}, 10
    for cut in [*sorted(c for c in cuts if c >= 10), 200]:
        profile = device.promise(max(cut, begin))
        profile.check(begin, max(cut, begin))
        begin = profile.valid_until
        ends = [*profile.times[1:], profile.valid_until]
        for start, end, torque in zip(profile.times, ends, profile.torques, strict=True):
            told |= dict.fromkeys(range(start, end), torque)
    assert sorted(told) == list(range(10, max(stamps[-1], 10)))
    for instant, torque in told.items():
        before = [t for s, t in known if s <= instant]
        assert torque == (before[-1] if before else 0.0)


def test_a_clock_that_was_set_back_before_a_run_makes_no_promise_of_what_is_not_measured(
    monkeypatch,
):
    device = Echo()
    robot = GuardedRobot(device, Side.LEFT)
    robot.configure()
    robot.activate()
    with robot:
        until(lambda: len(device.sent) > 20)
        assert len(device._samples) < 5  # a robot may wait for its run for hours
        hour_ago = time.time_ns() - 3600 * SECOND
        monkeypatch.setattr(time, "time_ns", lambda: hour_ago)
        robot.begin(hour_ago)
        count = len(device.sent)
        until(lambda: len(device.sent) > count + 5)
        robot.heard()
        assert hour_ago < robot.promise(hour_ago + 60 * SECOND).valid_until < hour_ago + SECOND


def test_a_loop_that_wakes_up_late_is_a_fault():
    device = Echo(lateness=0.02)
    with guarded(device) as robot:
        push(robot)
        until(lambda: any(device.sent))
        device.gate.clear()
        time.sleep(0.1)
        device.gate.set()
        until(lambda: robot.read() and robot.faults)
        assert "host_loop_late" in [fault.name for fault in robot.faults]
        until(lambda: device.sent[-1] == 0.0)


def test_a_loop_that_fails_is_a_fault_and_disables_at_zero():
    device = Echo()
    with guarded(device) as robot:
        push(robot)
        until(lambda: any(device.sent))
        device.failing = True
        until(lambda: robot.read() and robot.faults)
        assert "driver_failed" in [fault.name for fault in robot.faults]


@pytest.mark.parametrize("leave", ["deactivate", "close"])
def test_zero_torque_is_sent_before_disabling(leave):
    device = Echo()
    robot = guarded(device)
    push(robot)
    until(lambda: any(device.sent))
    getattr(robot, leave)()
    assert device.disabled_after == [0.0, 0.0, 0.0]
    robot.close()


def test_what_is_told_is_what_was_measured():
    device = Echo()
    device.share = 0.5
    with guarded(device) as robot:
        push(robot)
        until(lambda: any(device.sent))
        told = set()
        until(lambda: told.update(robot.promise(time.time_ns()).torques) or 2.5 in told)
        assert told == {0.0, 2.5}
    assert device.shut


@pytest.mark.parametrize("halt", ["stop", "fault"])
def test_no_train_brings_torque_after_a_stop_or_a_fault_until_configured(halt):
    device = Echo()
    device.configure()
    device.activate()
    device.begin(time.time_ns())
    device.stop() if halt == "stop" else device._fault(OVERHEATED)
    device.schedule(PulseTrain(Side.LEFT, time.time_ns() + 1_000_000, 2.0, 1, 5.0, 0.5))
    count = len(device.sent)
    until(lambda: len(device.sent) > count + 20)
    assert not any(device.sent)
    device.close()
    with guarded(device) as robot:
        push(robot)
        until(lambda: any(device.sent))
        robot.read()
        assert robot.faults == ()


@pytest.mark.parametrize("ticks", [30, 10**6])
def test_torque_runs_down_before_disabling_but_nobody_waits_for_ever(ticks):
    device = Echo()
    robot = guarded(device)
    push(robot)
    until(lambda: any(device.sent))
    device.left = ticks
    robot.close()
    assert device.shut
    assert device.disabled_after == [0.0, 0.0, 0.0]
    assert (device.left == 0) is (ticks == 30)


def test_a_device_that_cannot_be_enabled_is_disabled():
    device = Echo()
    device._enable = lambda: device._exchange(math.nan, 0.0) and 1 / 0
    robot = GuardedRobot(device, Side.LEFT)
    robot.configure()
    with pytest.raises(DeviceError, match="ZeroDivisionError"):
        robot.activate()
    assert device.disabled_after is not None
    assert not robot.enabled


def test_a_loop_that_failed_is_told_where_the_device_is_deactivated():
    device = Echo()
    device.configure()
    device.activate()
    device.failing = True
    until(lambda: device._faults)
    with pytest.raises(DeviceError, match="loop failed"):
        device.deactivate()
