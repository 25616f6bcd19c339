# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The wire format of CubeMars AK motors in MIT mode.

A command is 8 bytes, most significant bit first: position (16 bits), velocity (12), stiffness kp
(12), damping kd (12), torque (12). A reply is the motor's id, position (16 bits), velocity (12)
and torque (12); newer firmware adds a temperature and an error code.

Values are clamped and scaled by (2^n - 1) / span. The manual's 2^n / span overflows at full scale,
which then decodes as *minus* full torque. Zero lies between two codes and is sent as the lower
one: for a range of +/-25 N m that is -0.006 N m.

Public drivers disagree about the ranges, especially for velocity: they depend on the motor **and**
its firmware, and a motor does not report either. Check them by weighing before anyone is strapped
to it: command a torque and measure it with a lever on a scale.
"""

import math
from collections.abc import Iterable
from dataclasses import astuple, dataclass

from gait_entrainment.robot.faults import Fault

POSITION = 12.5  # [rad]
STIFFNESS = 500.0  # kp, upper bound
DAMPING = 5.0  # kd, upper bound
ENTER = bytes.fromhex("fffffffffffffffc")
EXIT = bytes.fromhex("fffffffffffffffd")
SET_ZERO = bytes.fromhex("fffffffffffffffe")

_Fields = tuple[tuple[float, float, int], ...]  # minimum, maximum and bits of each field


@dataclass(frozen=True)
class AkMotor:
    """The ranges of one motor, symmetric about zero."""

    velocity: float  # [rad/s]
    torque: float  # [N m]


MOTORS = {
    "AK60-6": AkMotor(45.0, 15.0),
    "AK70-10": AkMotor(50.0, 25.0),
    "AK80-6": AkMotor(76.0, 12.0),
    "AK80-9": AkMotor(50.0, 18.0),
    "AK10-9": AkMotor(50.0, 65.0),
}
FAULTS = {
    1: Fault("motor_too_hot", "The motor reports over-temperature."),
    2: Fault("over_current", "The motor reports over-current."),
    3: Fault("over_voltage", "The motor reports over-voltage."),
    4: Fault("under_voltage", "The motor reports under-voltage."),
    5: Fault("encoder_failed", "The motor reports an encoder fault."),
    6: Fault("driver_too_hot", "The motor's power stage reports over-temperature."),
    7: Fault("motor_locked", "The motor reports that it is locked."),
}


@dataclass(frozen=True)
class Command:
    """One command."""

    position: float = 0.0  # [rad]
    velocity: float = 0.0  # [rad/s]
    stiffness: float = 0.0  # kp [N m/rad]
    damping: float = 0.0  # kd [N m s/rad]
    torque: float = 0.0  # feed-forward [N m]


@dataclass(frozen=True)
class Reply:
    """One reply."""

    motor_id: int
    position: float  # [rad]
    velocity: float  # [rad/s]
    torque: float  # [N m]
    error: int = 0  # 0 if there is none, or if the firmware does not report it
    temperature: float = math.nan  # of the motor [deg C]; NaN if not reported


def pack_command(command: Command, motor: AkMotor) -> bytes:
    """Encode a command in 8 bytes; out-of-range values are clamped, NaN raises ValueError."""
    return _encode(astuple(command), _of_command(motor)).to_bytes(8, "big")


def unpack_command(data: bytes, motor: AkMotor) -> Command:
    """Decode the 8 bytes of a command as the motor does."""
    return Command(*_decode(int.from_bytes(data, "big"), _of_command(motor)))


def pack_reply(reply: Reply, motor: AkMotor, length: int, temperature: int = 65) -> bytes:
    """Encode a reply in 6 or 8 bytes; the temperature byte counts from -40 deg C."""
    bits = _encode((reply.position, reply.velocity, reply.torque), _of_reply(motor))
    data = bytes([reply.motor_id]) + bits.to_bytes(5, "big")
    return data if length == 6 else data + bytes([temperature, reply.error])


def unpack_reply(data: bytes, motor: AkMotor) -> Reply | None:
    """Decode a reply of 6 or 8 bytes; return None for any other length."""
    if len(data) not in (6, 8):
        return None
    position, velocity, torque = _decode(int.from_bytes(data[1:6], "big"), _of_reply(motor))
    error, temperature = (data[7], float(data[6] - 40)) if len(data) == 8 else (0, math.nan)
    return Reply(data[0], position, velocity, torque, error, temperature)


def resolution(motor: AkMotor) -> float:
    """Return the torque resolution, one step of the code [N m]."""
    return 2 * motor.torque / 0xFFF


def _of_command(motor: AkMotor) -> _Fields:
    gains = (0.0, STIFFNESS, 12), (0.0, DAMPING, 12)
    position, velocity, torque = _of_reply(motor)
    return position, velocity, *gains, torque


def _of_reply(motor: AkMotor) -> _Fields:
    return tuple(
        (-most, most, bits)
        for most, bits in ((POSITION, 16), (motor.velocity, 12), (motor.torque, 12))
    )


def _encode(values: Iterable[float], fields: _Fields) -> int:
    code = 0
    for value, (low, high, bits) in zip(values, fields, strict=True):
        if value != value:
            raise ValueError("NaN cannot be sent to a motor")
        share = (min(max(value, low), high) - low) / (high - low)
        # The small term makes a value decoded from a code encode to that code despite rounding.
        code = code << bits | int(share * ((1 << bits) - 1) + 1e-6)
    return code


def _decode(code: int, fields: _Fields) -> list[float]:
    values = []
    for low, high, bits in reversed(fields):
        largest = (1 << bits) - 1
        values.append(low + (code & largest) * (high - low) / largest)
        code >>= bits
    return values[::-1]
