# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The ideal ankle robot: delivers exactly the commanded square pulses, without delay.

Not modelled: torque bandwidth, delay, jitter, noise, resolution, the robot's own inertia and
friction, a lost command.
"""

from collections.abc import Iterator

from gait_entrainment.conventions import Side
from gait_entrainment.device.limits import DeviceLimits, LimitError
from gait_entrainment.device.profile import TorqueProfile
from gait_entrainment.device.pulse_train import PulseTrain


class IdealAnkleRobot:
    """
    Turns one pulse train at a time into adjoining torque profiles.

    Parameters
    ----------
    side
        The ankle on which the robot sits.
    start
        Start of the run [ns]: the first profile begins there.
    limits
        What may be asked of it.

    """

    def __init__(self, side: Side, start: int, limits: DeviceLimits | None = None) -> None:
        self.side = side
        self.limits = limits or DeviceLimits()
        self.promised_until = start  # everything before this instant is promised [ns]
        self.delivered = 0  # pulses of the train whose onset has been promised
        self.train: PulseTrain | None = None  # the one scheduled last

    def schedule(self, train: PulseTrain) -> None:
        """
        Accept a train of pulses.

        Raises
        ------
        LimitError
            where the train is outside the limits, is for the other ankle, begins before what was
            already promised, or where another train is still under way. Nothing changes then.

        """
        self.limits.check(train)
        if train.side is not self.side:
            raise LimitError(f"side: {train.side.name.lower()}; the robot sits on the other ankle")
        if self.busy:
            raise LimitError("a pulse train is under way; allowed: one at a time")
        if train.first_onset < self.promised_until:
            late = (self.promised_until - train.first_onset) / 1e9
            raise LimitError(f"first_onset: lies {late:g} s inside what is already promised")
        self.train = train
        self.delivered = 0

    @property
    def busy(self) -> bool:
        """Whether some pulse of the train has not been promised to its end."""
        train = self.train
        return train is not None and train.end(train.count - 1) > self.promised_until

    @property
    def committed(self) -> bool:
        """Whether torque may still come: of a train under way, or promised and not yet over."""
        return self.train is not None

    def cancel(self) -> None:
        """Forget the train: profiles from now on hold no torque."""
        self.train = None

    def promise(self, until: int) -> TorqueProfile:
        """
        Return the torque from the last promise up to ``until`` [ns], which becomes binding.

        Raises
        ------
        ValueError
            where ``until`` lies before the last promise.

        """
        begin = self.promised_until
        if until < begin:
            raise ValueError(f"a promise up to {until} ns would take back one up to {begin} ns")
        times, torques, onsets = [begin], [0.0], []
        for onset, end, torque in self._pulses(begin, until):
            for instant, value in ((onset, torque), (end, 0.0)):
                if instant <= begin:
                    torques[0] = value
                elif instant < until:
                    times.append(instant)
                    torques.append(value)
            if onset >= begin:
                onsets.append(onset)
        self.delivered += len(onsets)
        self.promised_until = until
        return TorqueProfile(self.side, tuple(times), tuple(torques), tuple(onsets), until)

    def _pulses(self, begin: int, until: int) -> Iterator[tuple[int, int, float]]:
        """Yield onset, end and torque of every pulse that is on somewhere in [begin, until)."""
        train = self.train
        if train is None:
            return
        # The pulse promised last may still be on at the beginning of this stretch.
        for number in range(max(self.delivered - 1, 0), train.count):
            onset, end = train.onset(number), train.end(number)
            if onset >= until:
                return
            if end > begin:
                yield onset, end, train.torque
