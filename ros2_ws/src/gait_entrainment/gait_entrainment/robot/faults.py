# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What can go wrong with an ankle robot: faults as values, and the errors that calls raise."""

from dataclasses import dataclass

from gait_entrainment.errors import EntrainmentError


class DeviceError(EntrainmentError, RuntimeError):
    """The device cannot do what was requested; one line says what failed and what to do."""


class LimitError(EntrainmentError, ValueError):
    """A request outside the limits; the message names field, value and limit."""


@dataclass(frozen=True)
class Fault:
    """
    Something that is wrong, as reported by a driver or the safety envelope.

    On every fault the torque is brought to zero and stays there until the robot is closed and
    configured again.
    """

    name: str  # short, stable, for machines: lower case with underscores
    meaning: str  # one sentence for people


STOPPED = Fault("stopped", "A stop was requested.")
EXPERIMENT_SILENT = Fault(
    "experiment_silent", "The experiment sent no horizon for longer than the limit."
)
TORQUE_UNASKED = Fault(
    "torque_unasked", "Torque is measured without a command. If it is felt, cut the power."
)
READINGS_OLD = Fault("readings_old", "The device reports nothing new: check it and its bus.")
TORQUE_EXCEEDED = Fault(
    "torque_exceeded", "More torque was delivered than the limit and its margin allow."
)
IMPULSE_EXCEEDED = Fault(
    "impulse_exceeded", "More angular impulse was delivered per stride than the limit allows."
)
DRIVER_FAILED = Fault("driver_failed", "The driver raised an error or broke its contract.")
DRIVER_BLOCKED = Fault("driver_blocked", "A call to the driver does not return: check its bus.")
NOT_STOPPED = Fault(
    "not_stopped",
    "The driver cannot bring the torque to zero: cut the power. The process ends, so the device "
    "receives no more commands.",
)
