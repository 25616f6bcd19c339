# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What can be wrong with an ankle robot: faults as values, and the errors that calls raise."""

from dataclasses import dataclass

from gait_entrainment.errors import EntrainmentError


class DeviceError(EntrainmentError, RuntimeError):
    """The device cannot do what was asked: one line that says what and what to do."""


class LimitError(EntrainmentError, ValueError):
    """A request outside what is allowed; the message names field, value and limit."""


@dataclass(frozen=True)
class Fault:
    """
    Something that is wrong, as a driver or the safety envelope reports it.

    Every fault means: torque is brought to zero and stays there until the robot is closed and
    configured again.
    """

    name: str  # short, stable, for machines: lower case with underscores
    meaning: str  # one sentence for people


STOPPED = Fault("stopped", "The stop was called.")
EXPERIMENT_SILENT = Fault(
    "experiment_silent", "The experiment sent no horizon for longer than the limit."
)
TORQUE_UNASKED = Fault(
    "torque_unasked", "Torque is measured that nobody asked for. If it is felt, cut the power."
)
READINGS_OLD = Fault("readings_old", "The device tells nothing new: see to it and to its bus.")
TORQUE_EXCEEDED = Fault(
    "torque_exceeded", "More torque was delivered than the limit and its margin allow."
)
IMPULSE_EXCEEDED = Fault(
    "impulse_exceeded", "More angular impulse was delivered per stride than the limit allows."
)
DRIVER_FAILED = Fault("driver_failed", "The driver raised an error or broke its contract.")
DRIVER_BLOCKED = Fault("driver_blocked", "A call of the driver does not return: see to its bus.")
NOT_STOPPED = Fault(
    "not_stopped",
    "The driver cannot bring the torque to zero: cut the power. The process ends, so that the "
    "device hears nothing more.",
)
