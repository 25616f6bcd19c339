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

"""Limits that every pulse train is held against before a robot sees it."""

import math
from dataclasses import dataclass, field

from gait_entrainment.device.pulse_train import PulseTrain


class LimitError(ValueError):
    """A pulse train outside the limits of the device; the message names field, value and limit."""


@dataclass(frozen=True)
class DeviceLimits:
    """
    What may be asked of an ankle robot.

    The default torque lies above the 13.3 N m of the paper's pulse and near the 23 N m of the
    MIT Anklebot; it is a limit for the wearer, whatever the motor could do.
    """

    torque: float = field(
        default=30.0,
        metadata={"meaning": "largest magnitude of a pulse", "unit": "N m", "range": (0.0, 200.0)},
    )
    duration: float = field(
        default=0.5,
        metadata={"meaning": "longest duration of a pulse", "unit": "s", "range": (0.001, 10.0)},
    )

    def check_pulse(self, torque: float, duration: float) -> None:
        """
        Raise LimitError where a pulse of this height [N m] and width [s] must not be delivered.

        A protocol can be held against this before anything is measured or moved.
        """
        if not math.isfinite(torque) or abs(torque) > self.torque:
            raise LimitError(
                f"torque: {torque:g} N m is outside the limit of the device; "
                f"allowed: -{self.torque:g} to {self.torque:g} N m"
            )
        if not 0 < duration <= self.duration:
            raise LimitError(
                f"width: {duration:g} s is outside the limit of the device; "
                f"allowed: above 0 and at most {self.duration:g} s"
            )

    def check(self, train: PulseTrain) -> None:
        """Raise LimitError where a train must not be delivered."""
        self.check_pulse(train.torque, train.duration)
        if train.count < 1:
            raise LimitError(f"count: {train.count}; allowed: at least 1")
        if not (math.isfinite(train.period) and train.period > train.duration):
            raise LimitError(
                f"period: {train.period:g} s makes pulses of {train.duration:g} s overlap; "
                "allowed: longer than a pulse"
            )
