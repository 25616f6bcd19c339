# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The ideal ankle robot: delivers exactly the commanded pulses, without delay.

Not modelled: torque bandwidth, delay, jitter, noise, resolution, the robot's own inertia and
friction, a lost command, and how the torque runs down after a stop.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from gait_entrainment.robot.contract import Capabilities, RobotState
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment.robot.simulated import SimulatedRobot

# A flank is delivered in steps of this length [ns], each at the flank's mean torque in it.
_STEP = 1_000_000


@dataclass(frozen=True)
class IdealOptions:
    """The ideal robot has nothing to choose."""


class IdealAnkleRobot(SimulatedRobot):
    """See the module's docstring."""

    Options = IdealOptions
    capabilities = Capabilities(
        peak_torque=math.inf,
        torque_rate=math.inf,
        measures_torque=False,
        simulated=True,
        state_rate=0.0,
    )

    def promise(self, until: int) -> TorqueProfile:
        """Return the torque up to ``until`` [ns]; there is a state for each change of it."""
        profile = super().promise(until)
        self._states += [
            RobotState(begin, torque, torque, math.nan) for begin, _, torque in profile.pieces
        ]
        return profile

    def _changes(self, begin: int, until: int) -> Iterator[tuple[int, float]]:
        train = self._train
        if train is None:
            return
        # The pulse that began last may still be on at the beginning.
        for number in range(max(train.latest(begin), 0), train.latest(until - 1) + 1):
            if train.end(number) > begin:
                yield from _pulse(train, number)


def _pulse(train: PulseTrain, number: int) -> Iterator[tuple[int, float]]:
    """Yield the changes of torque of one pulse: two, or steps along its flanks."""
    onset, end = train.onset(number), train.end(number)
    for instant in range(onset, end, _STEP if train.ramp else max(end - onset, 1)):
        middle = (instant + min(instant + _STEP, end)) // 2
        yield instant, train.shape(number, middle - onset)
    yield end, 0.0
