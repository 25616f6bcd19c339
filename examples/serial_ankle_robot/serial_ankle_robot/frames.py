# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The frames on the line, little-endian, each with a CRC-16/CCITT of all bytes before it.

=========  =====================================================================================
command    0xA5, number, mode (0 off, 1 torque), torque [0.01 N m]
reply      0x5A, number of the command, status, torque [0.01 N m], angle [mrad], velocity [mrad/s],
           temperature [deg C]; measured before the command takes effect
=========  =====================================================================================
"""

import binascii
import struct
from dataclasses import dataclass
from typing import ClassVar

OFF, TORQUE = 0, 1
# Bits of the status.
ENABLED, WATCHDOG_EXPIRED, DRIVER_FAULT = 1, 2, 4
_TORQUE_STEP = 0.01  # [N m]
_LARGEST = 0x7FFF


@dataclass(frozen=True)
class Command:
    """A command from the host."""

    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BBBh")
    START: ClassVar[int] = 0xA5

    number: int  # 0 to 255
    mode: int
    torque: float  # of the motor [N m]

    def pack(self) -> bytes:
        """Return the frame; torque is clamped to the frame's range. NaN raises ValueError."""
        steps = round(self.torque / _TORQUE_STEP)
        steps = min(max(steps, -_LARGEST), _LARGEST)
        return _checked(self.LAYOUT.pack(self.START, self.number, self.mode, steps))

    @classmethod
    def unpack(cls, body: bytes) -> "Command":
        """Return the command in a frame without its CRC."""
        _, number, mode, steps = cls.LAYOUT.unpack(body)
        return cls(number, mode, steps * _TORQUE_STEP)


@dataclass(frozen=True)
class Reply:
    """A reply from the robot."""

    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BBBhhhb")
    START: ClassVar[int] = 0x5A

    number: int  # of the command
    status: int
    torque: float  # of the motor [N m]
    angle: float = 0.0  # of the motor [rad]
    velocity: float = 0.0  # of the motor [rad/s]
    temperature: int = 25  # [deg C]

    def pack(self) -> bytes:
        """Return the frame."""
        values = (self.torque / _TORQUE_STEP, 1e3 * self.angle, 1e3 * self.velocity)
        numbers = (round(value) for value in values)
        layout = (self.START, self.number, self.status, *numbers, self.temperature)
        return _checked(self.LAYOUT.pack(*layout))

    @classmethod
    def unpack(cls, body: bytes) -> "Reply":
        """Return the reply in a frame without its CRC."""
        _, number, status, steps, angle, velocity, temperature = cls.LAYOUT.unpack(body)
        return cls(number, status, steps * _TORQUE_STEP, angle / 1e3, velocity / 1e3, temperature)


def take_frame(received: bytearray, kind: type[Command] | type[Reply]) -> bytes | None:
    """
    Remove the first whole frame of a kind from the received bytes; return it without its CRC.

    Bytes before it are noise or part of a frame, and are dropped. None if there is no frame yet.
    """
    size = kind.LAYOUT.size + 2
    while len(received) >= size:
        frame = bytes(received[:size])
        if frame[0] == kind.START and frame == _checked(frame[:-2]):
            del received[:size]
            return frame[:-2]
        del received[0]
    return None


def _checked(body: bytes) -> bytes:
    return body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))
