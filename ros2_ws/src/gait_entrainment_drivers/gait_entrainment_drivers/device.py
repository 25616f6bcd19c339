# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a driver's author implements for a device to which the host streams torque."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from gait_entrainment.robot.contract import Capabilities
from gait_entrainment.robot.faults import Fault


@dataclass(frozen=True)
class Reading:
    """A device's answer to one command."""

    torque: float  # measured [N m], plantarflexion positive
    angle: float = math.nan  # measured [rad], plantarflexion positive; NaN if not measured
    velocity: float = math.nan  # measured [rad/s]; NaN if not measured
    temperature: float = math.nan  # of the motor [deg C]; NaN if not measured
    faults: tuple[Fault, ...] = ()  # that the device itself reports


class TorqueDevice(ABC):
    """
    A device that takes a torque command and answers with a reading.

    All methods are called from one thread of a separate process (torque_loop.py), where nothing
    else runs. The constructor is also called in the robot's process, to read the capabilities.

    The loop sends the last zero: before ``disable`` it exchanges zero torque until the reading has
    fallen. A device must go to zero by itself when commands stop; no software on the host can
    ensure that. The kit can prove it only if ``exchange`` returns a reading from before the torque
    that it sends takes effect: if the device allows it, request the reading, then send the torque.
    """

    name: str  # used in messages, such as "motor 1"
    address: str  # what only one process may open at a time, such as "motor 1 on can0"
    capabilities: Capabilities
    identity = ""  # reported by an open device about itself, such as its firmware

    @abstractmethod
    def __init__(self, options: Any) -> None:
        """Keep the options; touch no hardware."""

    @abstractmethod
    def open(self) -> None:
        """Connect, and check that the right device answers; may raise DeviceError."""

    @abstractmethod
    def enable(self) -> None:
        """Enable the device at zero torque; may raise DeviceError."""

    @abstractmethod
    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """
        Send a torque [N m]; return the answer, or None if none arrives within ``timeout`` [s].

        May raise any exception: the loop treats it as silence, reports its text and continues to
        send zero.
        """

    @abstractmethod
    def forget(self) -> None:
        """Drop unread answers after the loop was held up. May raise as ``exchange`` does."""

    @abstractmethod
    def disable(self) -> None:
        """Disable the device, whose torque is zero; exceptions are ignored."""

    @abstractmethod
    def shut(self) -> None:
        """Release everything, even if called twice or without ``open``; exceptions are ignored."""
