# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The common part of simulated ankle robots: no connection, and immediate zero torque."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.robot.contract import AnkleRobot, RobotState
from gait_entrainment.robot.faults import DeviceError
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import PulseTrain


class SimulatedRobot(AnkleRobot):
    """A device whose torque is computed when a promise is requested."""

    def __init__(self, side: Side, options: Any, seed: int) -> None:  # noqa: ARG002
        self._side = side
        self._train: PulseTrain | None = None
        self._promised = 0
        self._states: list[RobotState] = []  # since the last read
        self._halted = False

    @abstractmethod
    def _changes(self, begin: int, until: int) -> Iterator[tuple[int, float]]:
        """
        Yield the changes of torque in [begin, until): instant [ns] and torque from then on [N m].

        Without a change at or before ``begin`` the torque is zero there.
        """

    def configure(self) -> None:
        """Clear a stop; there is nothing to connect."""
        self._halted = False

    def activate(self) -> None:
        """Nothing to enable."""

    def begin(self, start: int) -> None:
        """Start a run."""
        self._promised, self._states = start, []
        self.cancel()

    def schedule(self, train: PulseTrain) -> None:
        """Accept a train."""
        if self._halted:
            raise DeviceError("stopped: close and configure first")
        self._train = self._train.followed_by(train) if self._train else train

    def cancel(self) -> None:
        """Drop the train; the torque is zero immediately."""
        self._train = None

    def promise(self, until: int) -> TorqueProfile:
        """Return the torque from the last promise up to ``until`` [ns]."""
        begin, self._promised = self._promised, until
        onsets = () if self._train is None else self._train.onsets_within(begin, until)
        changes = self._changes(begin, until)
        return TorqueProfile.from_changes(self._side, begin, until, changes, onsets)

    def read(self) -> Sequence[RobotState]:
        """Return the states that were due."""
        states, self._states = self._states, []
        return states

    def stop(self) -> None:
        """Drop the train and accept no other."""
        self._halted = True
        self.cancel()

    def deactivate(self) -> None:
        """Drop the train."""
        self.cancel()

    def close(self) -> None:
        """Drop the train."""
        self.cancel()
