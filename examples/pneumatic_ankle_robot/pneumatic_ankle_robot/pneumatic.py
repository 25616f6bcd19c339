# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A simulated pneumatic ankle robot: torque rises and falls linearly as its muscle fills and empties.

Read it alongside the contract in ``gait_entrainment.robot.AnkleRobot``. A real robot would open
its valves in ``schedule`` and report its pressure sensor in ``promise`` and ``read``.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    AnkleRobot,
    Capabilities,
    DeviceError,
    PulseTrain,
    RobotState,
    TorqueProfile,
)
from gait_entrainment.settings import setting

STEP = 1_000_000  # of the simulation [ns]


@dataclass(frozen=True)
class PneumaticOptions:
    """Options of the robot, as in pneumatic:filling=0.02."""

    filling: float = setting(0.01, "time to fill the muscle", "s", (0.001, 0.1))


class PneumaticAnkleRobot(AnkleRobot):
    """See the module's docstring."""

    Options = PneumaticOptions

    def __init__(self, side: Side, options: PneumaticOptions, seed: int) -> None:  # noqa: ARG002
        self._side = side
        self._filling = round(options.filling * 1e9)
        self.capabilities = Capabilities(
            peak_torque=20.0,
            torque_rate=20.0 / options.filling,
            measures_torque=False,
            simulated=True,
            state_rate=1000.0,
        )
        self._train: PulseTrain | None = None
        self._stopped = False
        self._promised = self._next_step = 0
        self._torque = 0.0
        self._states: list[RobotState] = []

    def configure(self) -> None:
        """A real robot would connect to its valves here."""
        self._stopped = False

    def activate(self) -> None:
        """A real robot would switch on its supply here."""

    def begin(self, start: int) -> None:
        """Start a run."""
        self._train = None
        self._promised = self._next_step = start
        self._torque = 0.0
        self._states = []

    def schedule(self, train: PulseTrain) -> None:
        """Take over a train, to follow the previous ones."""
        if self._stopped:
            raise DeviceError("stopped: close and configure first")
        self._train = self._train.followed_by(train) if self._train else train

    def cancel(self) -> None:
        """Vent."""
        self._train = None

    def promise(self, until: int) -> TorqueProfile:
        """Return the torque in steps of a millisecond."""
        begin, self._promised = self._promised, until
        onsets = self._train.onsets_within(begin, until) if self._train else ()
        changes = self._changes(begin, until)
        return TorqueProfile.from_changes(self._side, begin, until, changes, onsets)

    def read(self) -> Sequence[RobotState]:
        """Return a state for each step."""
        states, self._states = self._states, []
        return states

    def stop(self) -> None:
        """Vent, and stay vented."""
        self._stopped = True
        self._train = None

    # There is nothing to switch off or release.
    deactivate = close = cancel

    def _changes(self, begin: int, until: int) -> Iterator[tuple[int, float]]:
        """Yield time [ns] and torque [N m] of each change of torque, and record the states."""
        yield begin, self._torque
        while self._next_step < until:
            before, self._torque = self._torque, self._torque_at(self._next_step)
            requested = self._train.torque_at(self._next_step) if self._train else 0.0
            self._states.append(RobotState(self._next_step, requested, self._torque, float("nan")))
            if self._torque != before:
                yield self._next_step, self._torque
            self._next_step += STEP

    def _torque_at(self, instant: int) -> float:
        """Return the mean torque requested during one filling time: a linear rise and fall."""
        train = self._train
        if train is None:
            return 0.0
        steps = range(instant - self._filling, instant, STEP)
        return sum(train.torque_at(step + STEP // 2) for step in steps) / len(steps)
