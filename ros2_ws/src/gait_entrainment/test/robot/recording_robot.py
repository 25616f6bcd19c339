# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A driver that notes every call, and can be told to misbehave."""

import math
import threading
from dataclasses import dataclass

from gait_entrainment.robot import AnkleRobot, Capabilities, RobotState, TorqueProfile


@dataclass(frozen=True)
class NoOptions:
    pass


class RecordingRobot(AnkleRobot):
    """
    Notes calls in ``calls``.

    ``raises`` maps a call's name to what it raises; ``torques`` are delivered by the next
    promises, one each; ``faults`` come with the next states.
    """

    Options = NoOptions

    def __init__(self, side, options=None, seed=0, simulated=True):  # noqa: ARG002
        self.capabilities = Capabilities(20.0, math.inf, True, simulated, 100.0)
        self.side = side
        self.calls = []
        self.raises = {}
        self.torques = []
        self.faults = ()
        self.stopped = threading.Event()
        self.promised = 0

    def _note(self, name):
        self.calls.append(name)
        if name in self.raises:
            raise self.raises[name]

    def configure(self):
        self._note("configure")

    def activate(self):
        self._note("activate")

    def begin(self, start):
        self._note("begin")
        self.promised = start

    def schedule(self, train):
        self._note("schedule")
        self.train = train

    def cancel(self):
        self._note("cancel")

    def promise(self, until):
        self._note("promise")
        begin, self.promised = self.promised, until
        torque = self.torques.pop(0) if self.torques else 0.0
        return TorqueProfile(self.side, (begin,), (torque,), (), until)

    def read(self):
        self._note("read")
        return [RobotState(self.promised, 0.0, 0.0, math.nan, self.faults)]

    def stop(self):
        self.stopped.set()
        self._note("stop")

    def deactivate(self):
        self._note("deactivate")

    def close(self):
        self._note("close")
