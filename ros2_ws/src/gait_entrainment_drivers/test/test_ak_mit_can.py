# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The CAN driver against the motor emulator in another process, hazards included."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, LimitError, PulseTrain, find_driver
from gait_entrainment_commands.timing import MeasuredOnsets
from gait_entrainment_drivers.ak_mit import ENTER, EXIT, MOTORS, Command, pack_command
from gait_entrainment_drivers.ak_mit_can import AkMitCanOptions, AkMotorOnCan
from gait_entrainment_drivers.ak_motor_emulator import EmulatedAkMotor

from .emulator_process import CHANNEL, emulator, read_trace, until

MS = 1_000_000


def robot_on(driver, **options):
    text = driver + "".join(f",{key}={value}" for key, value in options.items())
    return find_driver(text).make(Side.RIGHT)


def enabled(robot):
    robot.configure()
    robot.activate()
    robot.arm()
    robot.begin(time.time_ns())
    return robot


def pulses(robot, count=2, torque=8.0, duration=0.15, after=0.1):
    first = time.time_ns() + round(after * 1e9)
    robot.schedule(PulseTrain.periodic(Side.RIGHT, first, 0.7, count, torque, duration))
    return first


def follow(robot, seconds):
    """Promise and read for a time [s]; return profiles and states."""
    profiles, states = [], []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        robot.heard()
        profiles.append(robot.promise(time.time_ns()))
        states += robot.read()
        if robot.faults:
            break
        time.sleep(0.01)
    return profiles, states


@pytest.mark.parametrize("reply_bytes", [6, 8])
def test_pulses_arrive_and_are_measured(reply_bytes, tmp_path):
    trace = tmp_path / "trace"
    with (
        emulator("--reply-bytes", str(reply_bytes), "--loss", "0.02", trace=trace) as driver,
        robot_on(driver) as robot,
    ):
        enabled(robot)
        first = pulses(robot)
        profiles, states = follow(robot, 1.3)
        assert not robot.faults
    onsets = [onset for profile in profiles for onset in profile.onsets]
    assert onsets == [first, first + 700 * MS]
    pieces = [
        (begin, end, torque)
        for profile in profiles
        for begin, end, torque in zip(
            profile.times, [*profile.times[1:], profile.valid_until], profile.torques, strict=True
        )
    ]
    impulse = sum((end - begin) / 1e9 * torque for begin, end, torque in pieces)
    # Two pulses of 8 N m and 0.15 s, give or take the loop's ticks and lost frames.
    assert impulse == pytest.approx(2 * 8 * 0.15, rel=0.15)
    measured = MeasuredOnsets()
    measured.add_promise(onsets, states[-1].stamp)
    for onset in onsets:
        measured.add_pulse(onset, 8.0, 0.15)
    for state in states:
        measured.add_state(state)
    measured.finish()
    for timing in measured.timings:
        assert timing.commanded <= timing.sent
        # Interpolated between two states: a motor that answers within the tick of its
        # command is placed up to a tick earlier.
        before = max(state.stamp for state in states if state.stamp < timing.sent)
        assert before <= timing.measured
    rows = read_trace(trace)
    assert rows[-1][1] == pytest.approx(0.0, abs=0.01)  # zero is commanded before the end
    assert max(row[2] for row in rows) == pytest.approx(8.0, abs=0.05)


def test_pulses_are_refused_without_arming():
    with emulator() as driver, robot_on(driver) as robot:
        robot.configure()
        robot.activate()
        robot.begin(time.time_ns())
        with pytest.raises(DeviceError, match="not armed"):
            pulses(robot)


def test_a_pulse_in_the_past_is_refused_without_a_fault():
    with emulator() as driver, robot_on(driver) as robot:
        enabled(robot)
        robot.promised_until = 0
        with pytest.raises(LimitError, match="s in the past"):
            pulses(robot, after=-0.5)
        assert not robot.faults


def test_a_silent_motor_is_a_fault_and_ends_the_train():
    with emulator("--silent-after", "0.05") as driver, robot_on(driver) as robot:
        enabled(robot)
        pulses(robot, duration=0.3)
        _, states = follow(robot, 5.0)
        assert [fault.name for fault in robot.faults] == ["device_silent"]
        assert robot.train is None
        assert states[-1].commanded == 0.0 or robot.read()[-1].commanded == 0.0


def test_a_motor_error_is_a_named_fault():
    with emulator("--error", "2", "--error-after", "0.05") as driver, robot_on(driver) as robot:
        enabled(robot)
        pulses(robot, duration=0.3)
        follow(robot, 5.0)
        assert [fault.name for fault in robot.faults] == ["over_current"]
        with pytest.raises(DeviceError, match="latched"):
            pulses(robot)
        # Recovery is an explicit step, and is refused while the error persists.
        robot.close()
        with pytest.raises(DeviceError, match=r"over-current\. Remove the cause"):
            robot.configure()


def test_a_stop_in_mid_pulse_brings_zero_and_reconnecting_works(tmp_path):
    trace = tmp_path / "trace"
    with emulator(trace=trace) as driver, robot_on(driver) as robot:
        enabled(robot)
        pulses(robot, duration=0.3)
        until(lambda: max((row[1] for row in read_trace(trace)), default=0.0) > 7)
        robot.stop()
        until(lambda: abs(read_trace(trace)[-1][2]) < 0.05)
        robot.close()
        enabled(robot)
        pulses(robot)
        profiles, _ = follow(robot, 0.4)
        assert max(torque for profile in profiles for torque in profile.torques) > 7


def test_a_motor_has_one_master_at_a_time():
    with emulator() as driver, robot_on(driver) as first, robot_on(driver) as second:
        enabled(first)
        with pytest.raises(DeviceError) as error:
            second.configure()
        assert re.fullmatch(
            rf"motor 1 on udp_multicast {CHANNEL} port \d+ is in use by process {os.getpid()}"
            r" \(.+\): end it first",
            str(error.value),
        )
        pulses(first)
        profiles, _ = follow(first, 0.4)
        assert max(torque for profile in profiles for torque in profile.torques) > 7
        assert not first.faults
        first.close()
        enabled(second)
        # However its process ends, the motor is free again.
        os.kill(second._robot._process.pid, signal.SIGKILL)
        second._robot._process.wait()
        enabled(first)


def test_other_motors_on_the_bus_are_not_locked(tmp_path):
    with emulator(trace=tmp_path / "trace") as driver, robot_on(driver) as robot:
        enabled(robot)
        with pytest.raises(DeviceError, match="motor 2 does not answer"):
            robot_on(driver, motor_id=2).configure()


_HOST = """
import sys, time
from gait_entrainment.conventions import Side
from gait_entrainment.robot import PulseTrain, find_driver
robot = find_driver(sys.argv[1]).make(Side.RIGHT)
robot.configure(); robot.activate(); robot.arm()
robot.begin(time.time_ns())
robot.schedule(PulseTrain.periodic(Side.RIGHT, time.time_ns() + 100_000_000, 9.0, 1, 8.0, 0.5))
{end}
time.sleep(30)
"""


def host_that(end, driver):
    return subprocess.Popen(
        [sys.executable, "-c", _HOST.format(end=end), driver], stderr=subprocess.DEVNULL
    )


def torque_of(trace):
    return [row for row in read_trace(trace) if row[1] > 7]


def kill(host, *, with_its_loop):
    """Kill a host; its torque loop is a separate process."""
    children = Path(f"/proc/{host.pid}/task/{host.pid}/children").read_text().split()
    if with_its_loop:
        for child in children:
            os.kill(int(child), signal.SIGKILL)
    host.kill()
    host.wait(10)


@pytest.mark.parametrize(
    ("with_its_loop", "timeout", "torque"),
    [
        (True, "0", 8.0),  # the hazard that no software on the host can remove
        (True, "0.05", 0.0),
        (False, "0", 0.0),  # the loop notices that its host is gone
    ],
)
def test_what_a_killed_host_leaves_behind(with_its_loop, timeout, torque, tmp_path):
    trace = tmp_path / "trace"
    with emulator("--timeout", timeout, trace=trace) as driver:
        host = host_that("", driver)
        until(lambda: trace.exists() and torque_of(trace))
        kill(host, with_its_loop=with_its_loop)
        lines = len(read_trace(trace))
        until(lambda: len(read_trace(trace)) > lines + 400)
    assert read_trace(trace)[-1][2] == pytest.approx(torque, abs=0.1)


def test_a_loop_that_was_frozen_commands_zero_once_its_host_is_killed(tmp_path):
    trace = tmp_path / "trace"
    freeze = "time.sleep(0.3); frozen = robot._robot.frozen(); frozen.__enter__(); print('frozen')"
    with emulator(trace=trace) as driver:
        host = subprocess.Popen(
            [sys.executable, "-u", "-c", _HOST.format(end=freeze), driver],
            stdout=subprocess.PIPE,
        )
        with host.stdout:
            assert host.stdout.readline() == b"frozen\n"
        assert read_trace(trace)[-1][1] == pytest.approx(8.0, abs=0.01)
        host.kill()
        host.wait(10)
        until(lambda: abs(read_trace(trace)[-1][1]) < 0.01)


@pytest.mark.parametrize(
    "end",
    [
        "time.sleep(0.3); raise SystemExit",
        "time.sleep(0.3)\nwith robot: raise ValueError",
    ],
)
def test_a_host_that_exits_leaves_zero_torque(end, tmp_path):
    trace = tmp_path / "trace"
    with emulator(trace=trace) as driver:
        host = host_that(end, driver)
        host.wait(20)
        assert torque_of(trace)
        until(lambda: abs(read_trace(trace)[-1][1]) < 0.01)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("motor=AK70-9", "motor: 'AK70-9'; allowed: AK60-6, AK70-10"),
        ("motor_id=0", "motor_id: '0'; allowed: a whole number from 1 to 127"),
        ("motor_id=one", "motor_id: 'one'"),
        ("ratio=0", "ratio: 0"),
        ("rate=5000", "rate: '5000'"),
    ],
)
def test_a_wrong_option_gives_a_one_line_error(options, words):
    with pytest.raises(LimitError, match=words) as error:
        find_driver(f"ak_mit_can:{options}")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("interface=socketcan,channel=nosuchcan7", "nosuchcan7 cannot be opened"),
        ("interface=nosuchbus", "nosuchbus can0 cannot be opened"),
        (
            "interface=virtual,channel=empty",
            "motor 1 does not answer in MIT mode on virtual empty",
        ),
    ],
)
def test_a_missing_bus_or_motor_gives_a_one_line_error(options, words):
    robot = find_driver(f"ak_mit_can:{options}").make(Side.RIGHT)
    with pytest.raises(DeviceError, match=words) as error:
        robot.configure()
    assert "\n" not in str(error.value)
    assert not robot.enabled


def test_a_motor_with_another_id_does_not_answer():
    with (
        emulator("--motor-id", "5") as driver,
        pytest.raises(DeviceError, match="motor 1 does not answer"),
    ):
        robot_on(driver).configure()


def test_the_emulated_motor_holds_its_command_across_modes_as_the_real_one_does():
    motor = EmulatedAkMotor(MOTORS["AK80-9"], 1, bandwidth=1e3, timeout=0.0, reply_bytes=8)
    ten = pack_command(Command(torque=10.0), MOTORS["AK80-9"])
    motor.receive(ten, 0.0)
    motor.advance(1.0)
    assert motor.torque == 0.0  # not enabled
    motor.receive(ENTER, 1.0)
    motor.advance(100.0)
    assert motor.torque == pytest.approx(10.0, abs=0.01)  # the earlier command, indefinitely
    motor.receive(EXIT, 100.0)
    motor.advance(101.0)
    assert motor.torque == pytest.approx(0.0, abs=1e-9)


def test_a_bus_with_endless_answers_does_not_hold_up_the_loop():
    class Babbling:
        def recv(self, timeout):
            assert timeout >= 0
            assert time.monotonic() < start + 1.0, "the loop never stops reading"
            return can.Message(arbitration_id=1, is_extended_id=False)

    start = time.monotonic()
    motor = AkMotorOnCan(AkMitCanOptions())
    motor._bus = Babbling()
    assert motor._answer(lambda _: 5.0, start + 0.02) == 5.0
