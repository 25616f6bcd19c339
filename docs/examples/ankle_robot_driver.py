# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Write a driver and run the conformance kit on it: python ankle_robot_driver.py.

What each call must do stands in the docstring of ``gait_entrainment.robot.AnkleRobot``.
"""

import math
from dataclasses import dataclass

from gait_entrainment.robot import (
    AnkleRobot,
    Capabilities,
    DeviceError,
    Driver,
    RobotState,
    TorqueProfile,
)
from gait_entrainment_drivers.conformance.bench import DriverBench, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS

STEP = 1_000_000  # of the torque during a pulse [ns]


@dataclass(frozen=True)
class Options:
    """Nothing can be chosen of this robot."""


class SquareRobot(AnkleRobot):
    """A simulated robot that delivers what it is asked for, and measures it."""

    Options = Options
    capabilities = Capabilities(
        peak_torque=30.0,  # N m
        torque_rate=math.inf,
        measures_torque=True,
        simulated=True,
        state_rate=0.0,  # one state for each change of torque
    )

    def __init__(self, side, options, seed):
        self.side = side
        self.begin(0)

    def configure(self):
        self.stopped = False

    def activate(self):
        pass

    def begin(self, start):
        self.train, self.promised, self.states = None, start, []

    def schedule(self, train):
        if self.stopped:
            raise DeviceError("stopped: close and configure first")
        self.train = self.train.followed_by(train) if self.train else train

    def cancel(self):
        self.train = None

    def promise(self, until):
        begin, self.promised, train = self.promised, until, self.train
        pulses = train.pulses if train else ()
        steps = {step for p in pulses for step in (*range(p.onset, p.end, STEP), p.end)}
        times = [begin, *sorted(step for step in steps if begin < step < until)]
        torques = [train.torque_at(time) if train else 0.0 for time in times]
        onsets = train.onsets_within(begin, until) if train else ()
        for time, torque in zip(times, torques, strict=True):
            self.states.append(RobotState(time, torque, torque, math.nan))
        return TorqueProfile(self.side, tuple(times), tuple(torques), onsets, until)

    def read(self):
        states, self.states = self.states, []
        return states

    def stop(self):
        self.stopped, self.train = True, None

    deactivate = close = cancel


if __name__ == "__main__":
    bench = DriverBench(Driver("square", SquareRobot, Options()))
    for check in CHECKS:
        result = run_check(check, bench)
        print(f"{result.check:26} {result.broken or 'kept'}")
