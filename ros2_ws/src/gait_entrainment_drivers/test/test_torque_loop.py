# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The torque loop: whatever goes wrong is a named fault and ends in zero torque."""

import math
import os
import signal
import socket
import time

import pytest
from misbehaving_device import PEAK, MisbehavingDevice, MisbehavingOptions, MisbehavingRobot

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, PulseTrain
from gait_entrainment.robot.guard import GuardedRobot
from gait_entrainment_drivers.host_timed import LoopOptions
from gait_entrainment_drivers.link import Link, Sample
from gait_entrainment_drivers.monitor import Monitor, MonitorSettings
from gait_entrainment_drivers.stop_channel import NO_ANSWER, PREFIX, listening, stop_all
from gait_entrainment_drivers.torque_loop import TorqueLoop

from .emulator_process import until

SECOND = 1_000_000_000
HEIGHT = 8.0
# Limits that a loaded machine can keep; each limit has its own test.
TOLERANT = {"lateness": 0.5, "silence": 0.5, "host_silence": 3.0, "rate": 250.0}


class Bench:
    """A robot and the trace of its commands."""

    def __init__(self, tmp_path, **options):
        self.trace = tmp_path / "trace"
        self.trace.touch()
        options = MisbehavingOptions(**{**TOLERANT, **options}, trace=str(self.trace))
        self.driver = MisbehavingRobot(Side.LEFT, options, 0)
        self.robot = GuardedRobot(self.driver, Side.LEFT)
        self.robot.configure()
        self.robot.activate()
        self.robot.arm()
        self.robot.begin(time.time_ns())

    def push(self, seconds=0.4, count=1):
        onset = time.time_ns() + SECOND // 20
        self.robot.schedule(PulseTrain.periodic(Side.LEFT, onset, 0.6, count, HEIGHT, seconds))

    def commands(self):
        rows = [
            line.split()
            for line in self.trace.read_text().splitlines(keepends=True)
            if line.endswith("\n")
        ]
        return [(int(at), float(torque)) for at, torque in rows]

    def look(self):
        self.robot.heard()
        return self.robot.read()

    def until(self, condition):
        until(lambda: (self.look(), condition())[1])

    def faults(self):
        return [fault.name for fault in self.robot.faults]

    def pushed(self):
        return any(torque == HEIGHT for _, torque in self.commands())


@pytest.fixture
def bench(tmp_path):
    made = []

    def make(**options):
        made.append(Bench(tmp_path, **options))
        return made[-1]

    yield make
    for device in made:
        device.robot.close()


@pytest.mark.parametrize(
    ("does", "fault"),
    [
        ("push 12 N m", "torque_not_followed"),
        ("push the wrong way", "torque_not_followed"),
        ("answer 40 ms late", "torque_not_followed"),
        ("repeat one reply", "torque_not_followed"),
        ("stick at 2 rad", "angle_out_of_range"),
        ("spin", "velocity_out_of_range"),
        ("heat up", "too_hot"),
        ("report an error", "overheated"),
        ("measure NaN", "reading_not_finite"),
        ("lose the angle", "reading_not_finite"),
        ("stop answering", "device_silent"),
        ("answer a number", "driver_failed"),
        ("measure None", "driver_failed"),
        ("report a text", "driver_failed"),
        ("raise", "driver_failed"),
    ],
)
def test_misbehaviour_of_a_device_is_a_named_fault_and_ends_the_torque(bench, does, fault):
    device = bench(does=does, after=0.0)
    device.push(count=12)
    device.until(device.faults)
    assert fault in device.faults()
    earlier = len(device.commands())
    device.until(lambda: len(device.commands()) > earlier + 20)
    assert {torque for _, torque in device.commands()[earlier:]} == {0.0}
    with pytest.raises(DeviceError):
        device.push()


def test_a_driver_error_is_reported_and_zero_is_sent_repeatedly(bench):
    device = bench(does="raise")
    device.push()
    device.until(lambda: device.robot.faults)
    assert "OSError: bus gone" in device.robot.faults[0].meaning
    earlier = len(device.commands())
    device.until(lambda: len(device.commands()) > earlier + 250)  # for longer than a second


def test_a_device_that_follows_its_commands_raises_no_fault(bench):
    device = bench(rate=500.0)
    device.push(seconds=0.1, count=5)
    device.until(
        lambda: device.robot.delivered == 5 or device.robot.promise(time.time_ns()) is None
    )
    assert device.faults() == []


def test_a_loop_that_is_held_up_is_a_fault(bench):
    device = bench(lateness=0.05)
    device.push()
    with device.driver.frozen():
        time.sleep(0.1)
    device.until(lambda: "host_loop_late" in device.faults())


def test_short_hiccups_do_not_add_up_to_a_long_one(bench):
    device = bench(does="stutter")
    device.push()
    device.until(device.pushed)
    commands = len(device.commands())
    device.until(lambda: len(device.commands()) > commands + 10)
    assert "host_loop_late" not in device.faults()


def test_an_exchange_that_holds_up_the_loop_is_the_drivers_fault(bench):
    device = bench(does="take its time", lateness=0.05)
    device.push()
    device.until(device.faults)
    assert device.faults()[0] == "driver_slow"


def test_a_silent_parent_ends_the_torque(bench):
    device = bench(host_silence=0.1)
    device.push(seconds=0.5, count=20)
    device.until(device.pushed)
    commands = len(device.commands())
    until(lambda: len(device.commands()) > commands + 100)  # nothing is read meanwhile
    device.until(lambda: "host_silent" in device.faults())
    assert device.commands()[-1][1] == 0.0


def test_a_killed_loop_is_reported(bench):
    device = bench()
    device.push()
    device.until(device.pushed)
    os.kill(device.driver._process.pid, signal.SIGKILL)
    device.until(lambda: "torque_loop_ended" in device.faults())
    assert device.look() == ()  # nothing is measured any more, and no state is made up


def test_terminal_signals_do_not_end_the_loop(bench):
    device = bench()
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT):
        os.kill(device.driver._process.pid, number)
    device.push()
    device.until(device.pushed)
    assert device.faults() == []


def test_a_stop_needs_no_ros_and_reports_the_measured_torque(bench):
    device = bench()
    device.push(seconds=0.5, count=20)
    device.until(device.pushed)
    answer = next(a for name, a in stop_all().items() if name.startswith("bench_device/"))
    assert answer.done
    assert "N m measured" in answer.message
    device.until(lambda: "stopped" in device.faults())
    assert device.commands()[-1][1] == 0.0


def test_a_stop_of_a_motor_that_keeps_pushing_says_to_cut_the_power(bench):
    device = bench(does="push 12 N m", torque_band=1.0)
    device.push(seconds=0.5, count=20)
    device.until(device.pushed)
    answer = next(a for name, a in stop_all().items() if name.startswith("bench_device/"))
    assert not answer.done
    assert "+12.00 N m measured: cut the power" in answer.message
    device.until(lambda: "torque_not_falling" in device.faults())


def test_a_frozen_loop_gives_no_answer_and_is_named(bench):
    device = bench(host_silence=0.1)
    device.push()
    pid = device.driver._process.pid
    os.kill(pid, signal.SIGSTOP)
    try:
        assert stop_all(0.2)[f"bench_device/{pid}"] is NO_ANSWER
        device.until(device.faults)
        assert device.faults() == ["torque_loop_silent"]
    finally:
        os.kill(pid, signal.SIGCONT)
    earlier = len(device.commands())
    device.until(lambda: len(device.commands()) > earlier + 20)
    assert {torque for _, torque in device.commands()[earlier:]} == {0.0}


@pytest.fixture
def loop():
    """Yield a loop in this process, and the parent's end of its link."""
    options = MisbehavingOptions(rate=1000.0)
    ours, theirs = map(Link, socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET))
    made = TorqueLoop(theirs, MisbehavingDevice(options), options)
    yield made, ours
    made._closing = True
    made.serve()


def push(parent):
    now = time.monotonic_ns()
    parent.send("train", PulseTrain.periodic(Side.LEFT, now, 9.0, 1, HEIGHT, 9.0))


def test_a_stop_before_the_device_is_opened_is_not_forgotten(loop):
    made, parent = loop
    stop_all(0.0)
    for step in ("open", "enable"):
        parent.send(step)
    made._listen()
    push(parent)
    made._tick()
    *_, (_, (sample,)) = parent.received()
    assert sample.commanded == 0.0


def test_a_stop_request_is_answered_even_if_the_device_is_disabled_immediately(loop):
    made, parent = loop
    for step in ("open", "enable"):
        parent.send(step)
    made._listen()
    push(parent)
    while not made._measured > HEIGHT / 2:
        made._tick()
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as client:
        client.bind("")
        (name,) = (name for name in listening() if name.startswith("bench_device/"))
        client.sendto(b"stop", f"\0{PREFIX}{name}")
        parent.send("disable")
        made._listen()
        client.settimeout(5.0)
        assert b"torque is zero, latched" in client.recv(1000)


def test_a_parent_frozen_for_hours_does_not_fill_the_memory(loop):
    made, parent = loop
    for step in ("open", "enable"):
        parent.send(step)
    made._listen()
    made._samples = 40_000 * [Sample(0, 0.0, None, 0.0)]
    made._link.send_samples = lambda _: None
    made._tick()
    assert len(made._samples) == 30_000
    assert made._samples[-1].reading is not None


def test_a_closed_robot_stops_listening(bench):
    device = bench()
    name = f"bench_device/{device.driver._process.pid}"
    assert name in listening()
    device.robot.close()
    assert name not in listening()


def test_the_last_commands_before_disabling_are_zero(bench):
    device = bench()
    device.push()
    device.until(device.pushed)
    device.robot.deactivate()
    *commands, disabled = [torque for _, torque in device.commands()]
    assert math.isnan(disabled)
    assert commands[-5:] == [0.0] * 5


def test_a_strong_motor_is_judged_by_the_torque_that_people_may_feel():
    bands = [
        Monitor(MonitorSettings(), LoopOptions().capabilities(peak)).band for peak in (18.0, 390.0)
    ]
    assert bands == pytest.approx([0.12 * 18, 0.12 * 30])


def test_peak_of_the_bench_device_is_above_the_requested_torque():
    assert HEIGHT < PEAK
