# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The wire format of ODrive axes with CANSimple.

An 11-bit id is the node's id and a command: ``node << 5 | command``. Numbers are little-endian;
torque and estimates are 32-bit floats. An axis answers remote frames, and also sends its heartbeat
by itself, every 100 ms by default.
"""

import math
import struct
from dataclasses import dataclass
from typing import Any

from gait_entrainment.robot.faults import Fault

VERSION, HEARTBEAT, STOP, ERRORS, SET_STATE, ENCODER = 0x00, 0x01, 0x02, 0x03, 0x07, 0x09
SET_MODE, SET_TORQUE, CLEAR_ERRORS, TORQUES = 0x0B, 0x0E, 0x18, 0x1C
IDLE, CLOSED_LOOP = 1, 8
# Control mode torque, input mode passthrough.
TORQUE_MODE = bytes.fromhex("01000000 01000000")
STATE = struct.Struct("<I")  # data of SET_STATE
BITS = struct.Struct("<II")  # data of ERRORS [active errors, reason of the last disarming]
TORQUE = struct.Struct("<f")  # data of SET_TORQUE [N m]
PAIR = struct.Struct("<ff")  # data of ENCODER [rev, rev/s] and of TORQUES [target, estimate, N m]
# Data of VERSION: protocol version, hardware and firmware versions (major, minor, and variant or
# revision), and whether the firmware is unreleased.
VERSIONS = struct.Struct("<8B")
WATCHDOG_EXPIRED, STOP_REQUESTED = 0x01000000, 0x02000000
# By error bit, for firmware 0.6.
FAULTS = {
    0x00000008: Fault("encoder_failed", "The ODrive gets no estimate from its encoder."),
    0x00000020: Fault("driver_failed_in_motor", "The ODrive reports a fault of its power stage."),
    0x00000100: Fault("over_voltage", "The ODrive reports over-voltage."),
    0x00000200: Fault("under_voltage", "The ODrive reports under-voltage."),
    0x00000400: Fault("over_current", "The ODrive reports over-current of its supply."),
    0x00001000: Fault("motor_current_exceeded", "The ODrive reports too much motor current."),
    0x00002000: Fault("motor_too_hot", "The ODrive reports over-temperature of the motor."),
    0x00004000: Fault("driver_too_hot", "The ODrive reports over-temperature of its power stage."),
    0x00008000: Fault("too_fast", "The ODrive reports that its velocity limit was exceeded."),
    WATCHDOG_EXPIRED: Fault("motor_watchdog", "The ODrive's own watchdog has expired."),
    STOP_REQUESTED: Fault("emergency_stop", "The ODrive received an emergency stop."),
}
DISARMED = Fault("motor_disarmed", "The ODrive has left closed-loop control by itself.")


@dataclass(frozen=True)
class Heartbeat:
    """The state of an axis."""

    error: int  # error bits; 0 if there is none
    state: int  # IDLE, CLOSED_LOOP, or another one without torque


def frame_id(node: int, command: int) -> int:
    """Return the id of a frame to or from a node, 0 to 63."""
    return node << 5 | command


def pack_torque(torque: float, peak: float) -> bytes:
    """Encode the data of SET_TORQUE [N m], clamped to +/- a peak; NaN raises ValueError."""
    if math.isnan(torque):
        raise ValueError("NaN cannot be sent to a motor")
    return TORQUE.pack(min(max(torque, -peak), peak))


def unpack(layout: struct.Struct, data: bytes) -> tuple[Any, ...] | None:
    """Decode the numbers of a frame; return None for a frame of another length."""
    return layout.unpack(data) if len(data) == layout.size else None


def pack_heartbeat(heartbeat: Heartbeat) -> bytes:
    """Encode the data of HEARTBEAT, with result and flag zero."""
    return struct.pack("<IB3x", heartbeat.error, heartbeat.state)


def unpack_heartbeat(data: bytes) -> Heartbeat | None:
    """Decode a heartbeat; return None for a frame that is too short."""
    return Heartbeat(*struct.unpack_from("<IB", data)) if len(data) >= 5 else None


def faults_of(error: int) -> tuple[Fault, ...]:
    """Return the faults of error bits."""
    bits = [1 << n for n in range(32) if error >> n & 1]
    return tuple(
        FAULTS.get(bit, Fault(f"motor_error_{bit:#x}", f"The ODrive reports error {bit:#x}."))
        for bit in bits
    )
