# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Check that a device does what it is asked: torque follows, readings are plausible."""

import math
from dataclasses import dataclass

from gait_entrainment.robot.contract import Capabilities
from gait_entrainment.robot.faults import Fault
from gait_entrainment.robot.limits import DeviceLimits
from gait_entrainment.settings import Checked, setting
from gait_entrainment_drivers.device import Reading

NOT_FOLLOWED = Fault(
    "torque_not_followed",
    "The measured torque does not follow the command: it is unrequested, in the wrong direction, "
    "or too late, or the readings come from another device. If torque is felt, cut the power.",
)
NOT_FALLING = Fault(
    "torque_not_falling",
    "The measured torque does not fall although zero is commanded: cut the power.",
)
ANGLE_OUT_OF_RANGE = Fault(
    "angle_out_of_range", "The measured joint angle is outside what an ankle can reach."
)
VELOCITY_OUT_OF_RANGE = Fault(
    "velocity_out_of_range", "The measured joint velocity is beyond the limit."
)
TOO_HOT = Fault("too_hot", "The measured temperature is beyond the limit.")
READING_NOT_FINITE = Fault(
    "reading_not_finite",
    "The device reports a torque that is not finite, or no longer a quantity that it reported.",
)
SECOND_MASTER = Fault(
    "second_master", "Another program sends commands to this motor: find and stop it."
)
# Below this share of its scale, measured torque may be what a sensor shows at zero torque.
NEAR_ZERO_SHARE = 0.05
# Quantities that a device need not measure.
_OPTIONAL = ("angle", "velocity", "temperature")


def torque_scale(able: Capabilities) -> float:
    """Return the torque [N m] to judge by; a strong motor's peak exceeds what people may feel."""
    return min(able.peak_torque, DeviceLimits.torque)


@dataclass(frozen=True)
class MonitorSettings(Checked):
    """
    Limits on readings, and on the deviation of measured from commanded torque.

    The ankle's range is that of Brockett and Chapman (Orthop. Trauma 30, 232, 2016), 10 to 30
    degrees of dorsiflexion and 40 to 55 of plantarflexion, plus a margin.
    """

    torque_band: float = setting(
        0.12,
        "largest deviation from the expected torque, as a share of the peak, or of 30 N m if that"
        " is less",
        "1",
        (0.01, 1.0),
    )
    torque_time: float = setting(
        0.03,
        "how long torque may be outside the band, in addition to the device's lag",
        "s",
        (0.005, 1.0),
    )
    angle_least: float = setting(-0.9, "smallest joint angle", "rad", (-7.0, 7.0))
    angle_most: float = setting(1.3, "largest joint angle", "rad", (-7.0, 7.0))
    velocity: float = setting(25.0, "largest joint velocity", "rad/s", (0.1, 200.0))
    temperature: float = setting(80.0, "highest temperature of the motor", "deg C", (20.0, 200.0))


class Monitor:
    """
    Checks every reading for plausibility and against the command.

    A device of bandwidth f is expected between two torques: the command itself, and the command
    behind a first-order lag with the time constant 1 / (2 pi f). The first is that of a device
    faster than stated. Measured torque that is outside this range by more than the band, for
    longer than ``torque_time`` plus two time constants, is a fault.
    """

    def __init__(self, settings: MonitorSettings, able: Capabilities) -> None:
        self._settings = settings
        self.band = settings.torque_band * torque_scale(able)
        self._lag = 1 / (2 * math.pi * able.torque_bandwidth)
        self._known: set[str] = set()  # quantities that the device measures, besides torque
        self._tolerated = settings.torque_time + 2 * self._lag
        self._command = 0.0  # held since the last reading [N m]
        self._expected = 0.0  # the command behind the lag [N m]
        self._at = -math.inf  # time of the last command [s]
        self._outside_since = math.inf

    def expect(self, torque: float, now: float) -> None:
        """Note the torque [N m] that is commanded from a time [s] on."""
        decay = math.exp(-(now - self._at) / self._lag)
        self._expected = self._command + (self._expected - self._command) * decay
        self._before, self._command, self._at = self._command, torque, now

    def judge(self, reading: Reading, now: float) -> tuple[Fault, ...]:
        """Return the faults in the answer to the latest command, at a time [s]."""
        limits = self._settings
        if not math.isfinite(reading.torque):
            return (READING_NOT_FINITE,)
        found = []
        measured = {name for name in _OPTIONAL if not math.isnan(getattr(reading, name))}
        if not self._known <= measured:
            found.append(READING_NOT_FINITE)
        self._known |= measured
        if reading.angle < limits.angle_least or reading.angle > limits.angle_most:
            found.append(ANGLE_OUT_OF_RANGE)
        if abs(reading.velocity) > limits.velocity:
            found.append(VELOCITY_OUT_OF_RANGE)
        if reading.temperature > limits.temperature:
            found.append(TOO_HOT)
        # The answer may still be to the previous command, or already to this one.
        possible = (self._expected, self._before, self._command)
        outside = max(min(possible) - reading.torque, reading.torque - max(possible)) > self.band
        self._outside_since = min(self._outside_since, now) if outside else math.inf
        if now - self._outside_since > self._tolerated:
            found.append(NOT_FOLLOWED)
        return tuple(found)
