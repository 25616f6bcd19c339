# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The ideal ankle robot: delivers exactly the commanded pulses, without delay.

Square pulses are exact to the nanosecond. Any other shape is a staircase: each step has the torque
requested at its middle. The torque is thus off by at most slope / (2 rate), and the impulse of a
step of length h by at most h^3 / 24 times the curvature, or h^2 / 8 times a kink of the slope.

Not modelled: torque bandwidth, delay, jitter, noise, resolution, the robot's own inertia and
friction, a lost command, and how the torque decays after a stop.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.robot.contract import Capabilities, RobotState
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import Pulse, Shape
from gait_entrainment.robot.simulated import SimulatedRobot
from gait_entrainment.settings import Checked, setting


@dataclass(frozen=True)
class IdealOptions(Checked):
    """The only option; it matters for pulses that are not square."""

    rate: float = setting(
        1000.0, "torque steps per second along a flank or a curve", "Hz", (10.0, 100_000.0)
    )


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

    def __init__(self, side: Side, options: IdealOptions, seed: int) -> None:
        super().__init__(side, options, seed)
        self._step = round(NANOSECONDS_PER_SECOND / options.rate)

    def promise(self, until: int) -> TorqueProfile:
        """Return the torque up to ``until`` [ns]; each change of torque adds a state."""
        profile = super().promise(until)
        self._states += [
            RobotState(begin, torque, torque, math.nan) for begin, _, torque in profile.pieces
        ]
        return profile

    def _changes(self, begin: int, until: int) -> Iterator[tuple[int, float]]:
        train = self._train
        if train is None:
            return
        # The latest pulse may still be on at the beginning.
        for pulse in train.pulses[max(train.latest(begin), 0) : train.latest(until - 1) + 1]:
            if pulse.end > begin:
                yield from self._steps(pulse)

    def _steps(self, pulse: Pulse) -> Iterator[tuple[int, float]]:
        """Yield the torque changes of one pulse: two if it is square, else one per step."""
        onset, end = pulse.onset, pulse.end
        step = max(end - onset, 1) if pulse.shape is Shape.SQUARE else self._step
        for instant in range(onset, end, step):
            middle = (instant + min(instant + step, end)) // 2
            yield instant, pulse.torque_at(middle)
        yield end, 0.0
