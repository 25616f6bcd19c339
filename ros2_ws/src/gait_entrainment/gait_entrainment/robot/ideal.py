# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The ideal ankle robot: delivers exactly the commanded pulses, without delay.

Not modelled: torque bandwidth, delay, jitter, noise, resolution, the robot's own inertia and
friction, a lost command, and how the torque runs down after a stop.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side
from gait_entrainment.robot.contract import AnkleRobot, Capabilities, RobotState
from gait_entrainment.robot.faults import DeviceError
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import PulseTrain

# A flank is delivered in steps of this length [ns], each at the flank's mean torque in it.
_STEP = 1_000_000


@dataclass(frozen=True)
class IdealOptions:
    """The ideal robot has nothing to choose."""


class IdealAnkleRobot(AnkleRobot):
    """See the module's docstring."""

    Options = IdealOptions
    capabilities = Capabilities(
        peak_torque=math.inf,
        torque_rate=math.inf,
        measures_torque=False,
        simulated=True,
        state_rate=0.0,
    )

    def __init__(self, side: Side, options: IdealOptions, seed: int) -> None:  # noqa: ARG002
        self._side = side
        self._train: PulseTrain | None = None
        self._promised = 0
        self._states: list[RobotState] = []
        self._halted = False

    def configure(self) -> None:
        """Nothing to connect; a stop is over."""
        self._halted = False

    def activate(self) -> None:
        """Nothing to enable."""

    def begin(self, start: int) -> None:
        """Start a run."""
        self._train, self._promised, self._states = None, start, []

    def schedule(self, train: PulseTrain) -> None:
        """Take over a train."""
        if self._halted:
            raise DeviceError("stopped: close and configure first")
        self._train = train

    def cancel(self) -> None:
        """Drop the train: profiles from now on hold no torque."""
        self._train = None

    def promise(self, until: int) -> TorqueProfile:
        """Return the torque from the last promise up to ``until`` [ns]."""
        begin, train = self._promised, self._train
        times, torques = [begin], [0.0]
        for instant, value in _changes(train, begin, until) if train is not None else ():
            if instant <= begin:
                torques[0] = value
            elif instant < until:
                times.append(instant)
                torques.append(value)
        self._promised = until
        self._states += [
            RobotState(instant, torque, torque, math.nan)
            for instant, torque in zip(times, torques, strict=True)
        ]
        onsets = train.onsets_within(begin, until) if train is not None else ()
        return TorqueProfile(self._side, tuple(times), tuple(torques), onsets, until)

    def read(self) -> Sequence[RobotState]:
        """Return one state for each change of torque."""
        states, self._states = self._states, []
        return states

    def stop(self) -> None:
        """Drop the train, and take no other."""
        self._halted = True
        self._train = None

    def deactivate(self) -> None:
        """Drop the train."""
        self._train = None

    def close(self) -> None:
        """Drop the train."""
        self._train = None


def _changes(train: PulseTrain, begin: int, until: int) -> Iterator[tuple[int, float]]:
    """Yield the changes of torque of every pulse that is on somewhere in [begin, until)."""
    # The pulse that began last may still be on at the beginning of this stretch.
    for number in range(max(train.latest(begin), 0), train.latest(until - 1) + 1):
        onset, end = train.onset(number), train.end(number)
        if end > begin:
            yield from _pieces(train, onset, end)
            yield end, 0.0


def _pieces(train: PulseTrain, onset: int, end: int) -> Iterator[tuple[int, float]]:
    """Yield the instants [ns] and torques of one pulse: one piece, or steps along its flanks."""
    if train.ramp == 0:
        yield onset, train.torque
        return
    for instant in range(onset, end, _STEP):
        middle = (instant + min(instant + _STEP, end)) // 2
        yield instant, train.height_at(middle - onset)
