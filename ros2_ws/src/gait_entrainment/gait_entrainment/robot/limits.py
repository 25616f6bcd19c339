# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Limits that every pulse train is checked against before a robot sees it."""

import math
from dataclasses import dataclass, replace

from gait_entrainment.robot.faults import LimitError
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment.settings import check_settings, setting


@dataclass(frozen=True)
class DeviceLimits:
    """
    What may be asked of an ankle robot, and when its silence counts as a fault.

    The default torque lies above the 13.3 N m of the paper's pulse and near the 23 N m of the
    MIT Anklebot; it is a limit for the wearer, whatever the motor could do. The default impulse
    is that of one pulse at both limits.
    """

    torque: float = setting(30.0, "largest magnitude of a pulse", "N m", (0.0, 200.0))
    duration: float = setting(0.5, "longest duration of a pulse", "s", (0.001, 10.0))
    rate: float = setting(
        0.0,
        "steepest flank of a pulse, which becomes a ramp; 0 leaves it square",
        "N m/s",
        (0.0, 1e6),
    )
    impulse: float = setting(15.0, "largest angular impulse within a stride", "N m s", (0.0, 1e3))
    stride: float = setting(
        1.0, "time that counts as a stride: no longer than the wearer's shortest", "s", (0.1, 10.0)
    )
    duty: float = setting(0.9, "largest share of the time with torque", "1", (0.0, 1.0))
    overshoot: float = setting(
        0.2, "share by which delivered torque and impulse may exceed their limits", "1", (0.0, 1.0)
    )
    silence: float = setting(
        1.0,
        "longest silence of the experiment while torque may come (real time)",
        "s",
        (0.05, 60.0),
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_settings(self)

    def check_pulse(self, torque: float, duration: float) -> None:
        """
        Raise LimitError if a pulse of this height [N m] and width [s] must not be delivered.

        A protocol can be checked with this before anything is measured or moved.
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
        self._check_impulse(abs(torque) * duration)
        if self.rate and 2 * abs(torque) / self.rate > duration:
            raise LimitError(
                f"rate: a pulse of {duration:g} s does not reach {torque:g} N m at "
                f"{self.rate:g} N m/s; allowed: wider, lower, or a higher limits.rate"
            )

    def check(self, train: PulseTrain) -> None:
        """Raise LimitError if a train must not be delivered."""
        self.check_pulse(train.torque, train.duration)
        if train.count < 1:
            raise LimitError(f"count: {train.count}; allowed: at least 1")
        if not (math.isfinite(train.period) and train.period > train.duration):
            raise LimitError(
                f"period: {train.period:g} s makes pulses of {train.duration:g} s overlap; "
                "allowed: longer than a pulse"
            )
        if train.count > 1 and train.duration > self.duty * train.period:
            raise LimitError(
                f"duty: {train.duration / train.period:.3g} of the time with torque; "
                f"allowed: at most {self.duty:g}"
            )
        self._check_impulse(train.impulse_within(self.stride))

    def ramped(self, train: PulseTrain) -> PulseTrain:
        """Return a checked train with flanks no steeper than the limit."""
        return replace(train, ramp=abs(train.torque) / self.rate) if self.rate else train

    def _check_impulse(self, impulse: float) -> None:
        if impulse > self.impulse:
            raise LimitError(
                f"impulse: {impulse:.4g} N m s within {self.stride:g} s is outside the limit of "
                f"the device; allowed: at most {self.impulse:g} N m s"
            )
