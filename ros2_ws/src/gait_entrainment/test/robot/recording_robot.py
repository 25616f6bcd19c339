# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A driver that records every call and can be made to misbehave."""

import math
import threading
from dataclasses import dataclass

from gait_entrainment.robot import AnkleRobot, Capabilities, RobotState, TorqueProfile


@dataclass(frozen=True)
class NoOptions:
    pass


class RecordingRobot(AnkleRobot):
    """
    Records calls in ``calls``.

    ``raises`` maps a call's name to the exception that it raises. The next promises deliver
    ``torques``, one each, and the next states report ``faults``.
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

    def _record(self, name):
        self.calls.append(name)
        if name in self.raises:
            raise self.raises[name]

    def configure(self):
        self._record("configure")

    def activate(self):
        self._record("activate")

    def begin(self, start):
        self._record("begin")
        self.promised = start

    def schedule(self, train):
        self._record("schedule")
        self.train = train

    def cancel(self):
        self._record("cancel")

    def promise(self, until):
        self._record("promise")
        begin, self.promised = self.promised, until
        torque = self.torques.pop(0) if self.torques else 0.0
        return TorqueProfile(self.side, (begin,), (torque,), (), until)

    def read(self):
        self._record("read")
        return [RobotState(self.promised, 0.0, 0.0, math.nan, self.faults)]

    def stop(self):
        self.stopped.set()
        self._record("stop")

    def deactivate(self):
        self._record("deactivate")

    def close(self):
        self._record("close")
