# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The driver with the emulated robot: every promise, frames, and faults of the line."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from serial import serialposix
from serial_ankle_robot.frames import TORQUE, Command, Reply, take_frame

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, PulseTrain, find_driver
from gait_entrainment_drivers.conformance.bench import DriverBench, Tolerances, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS, silent_host

# A shared machine wakes processes up late; the defaults are for a laboratory's own machine.
TOLERANT = Tolerances(
    onset=0.25, zero_within=1.0, watchdog=1.6, call=0.1, slowest_call=2.0, impulse=0.6
)


@contextmanager
def emulated(*options):
    """Run the emulator; yield the text that selects the driver for it."""
    process = subprocess.Popen(
        [sys.executable, "-m", "serial_ankle_robot.emulator", *options],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        port = process.stdout.readline().strip()
        assert port
        yield f"serial:port={port},rate=250,silence=0.9,lateness=0.9,host_silence=5"
    finally:
        process.terminate()
        process.wait(10)
        process.stdout.close()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_a_robot_with_a_watchdog_keeps_every_promise(check):
    with emulated("--timeout=0.6") as text:
        result = run_check(check, DriverBench(find_driver(text), TOLERANT))
    assert result.kept, result.broken


def test_a_process_that_is_held_up_while_it_writes_is_no_failure_of_the_line(monkeypatch):
    """The limit on that is the loop's own, `lateness`, 0.9 s here."""
    write = os.write

    def held_up(file, data):
        written = write(file, data)
        time.sleep(0.15)
        return written

    with emulated() as text:
        driver = find_driver(text)
        device = driver.robot.Device(driver.options)
        device.open()
        device.enable()
        monkeypatch.setattr(serialposix.os, "write", held_up)
        assert device.exchange(0.0, 0.5).faults == ()
        monkeypatch.undo()
        device.disable()
        device.shut()


def test_a_robot_without_a_watchdog_holds_its_last_command():
    with emulated() as text:
        result = run_check(silent_host, DriverBench(find_driver(text)))
    assert result.broken.startswith("holds its last command when the host is silent: 8")


def push(robot):
    robot.configure()
    robot.activate()
    robot.arm()
    robot.begin(time.time_ns())
    onset = time.time_ns() + 50_000_000
    robot.schedule(PulseTrain.periodic(Side.RIGHT, onset, 1.0, 1, 8.0, 0.4))


def test_a_robot_fault_is_named():
    with emulated("--fault-after=0.1") as text, find_driver(text).make(Side.RIGHT) as robot:
        push(robot)
        give_up = time.monotonic() + 5
        while not robot.faults:
            assert time.monotonic() < give_up
            robot.heard()
            robot.read()
            time.sleep(0.005)
        assert [fault.name for fault in robot.faults] == ["power_stage_failed"]


def test_a_missing_line_gives_a_one_line_error():
    robot = find_driver("serial:port=/dev/no_such_line").make(Side.RIGHT)
    with pytest.raises(
        DeviceError, match=r"/dev/no_such_line: the line cannot be opened"
    ) as error:
        robot.configure()
    assert "\n" not in str(error.value)


def test_the_frame_of_8_newton_metres():
    frame = Command(7, TORQUE, 8.0).pack()
    assert frame.hex() == "a507012003" + frame[-2:].hex()
    assert Command.unpack(take_frame(bytearray(frame), Command)) == Command(7, TORQUE, 8.0)


def test_noise_and_half_frames_are_skipped():
    replies = [Reply(1, 1, 0.25, -0.5, 1.5, 30), Reply(2, 1, -0.25)]
    broken = bytearray(replies[0].pack())
    broken[4] ^= 1
    received = bytearray(b"\x5a\x00" + broken + replies[0].pack()[:5])
    for reply in replies:
        received += reply.pack()
    found = []
    while (body := take_frame(received, Reply)) is not None:
        found.append(Reply.unpack(body))
    assert found == replies
    assert take_frame(received, Reply) is None
