# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a driver's author writes for a device to which the host streams torque."""

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
    faults: tuple[Fault, ...] = ()  # what the device itself reports


class TorqueDevice(ABC):
    """
    One device that takes a torque command and answers with a reading.

    All methods are called from one thread of a process of its own (torque_loop.py), where nothing
    else runs. The constructor is also called in the robot's process, for the capabilities.

    The loop sends the last zero: before ``disable`` it exchanges zero torque until the reading has
    run down. A device must go to zero by itself when commands stop; no software on the host can
    see to that. The kit can prove it only if ``exchange`` returns what was measured before the
    torque that it sends had an effect: ask first, then command, if the device gives the choice.
    """

    name: str  # what it is called in messages, such as "motor 1"
    address: str  # what nobody else may open meanwhile, such as "motor 1 on can0"
    capabilities: Capabilities
    identity = ""  # what an open device says of itself, such as its firmware

    @abstractmethod
    def __init__(self, options: Any) -> None:
        """Keep the options; touch no hardware."""

    @abstractmethod
    def open(self) -> None:
        """Connect, and see that the right device answers; may raise DeviceError."""

    @abstractmethod
    def enable(self) -> None:
        """Enable the device at zero torque; may raise DeviceError."""

    @abstractmethod
    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """
        Send a torque [N m]; return the answer, or None if none comes within ``timeout`` [s].

        May raise anything: the loop counts it as silence, goes on sending zero and reports the
        text.
        """

    @abstractmethod
    def forget(self) -> None:
        """Drop answers that were not read: the loop was held up. May raise as ``exchange``."""

    @abstractmethod
    def disable(self) -> None:
        """Disable the device, whose torque is zero; what is raised is ignored."""

    @abstractmethod
    def shut(self) -> None:
        """Release everything, also twice or without ``open``; what is raised is ignored."""
