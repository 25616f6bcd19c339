# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""CANSimple on the wire: golden bytes, both ends of every range, and any value in between."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_drivers.odrive import (
    CLOSED_LOOP,
    HEARTBEAT,
    PAIR,
    SET_TORQUE,
    STATE,
    TORQUE,
    TORQUE_MODE,
    TORQUES,
    Heartbeat,
    faults_of,
    frame_id,
    pack_heartbeat,
    pack_torque,
    unpack,
    unpack_heartbeat,
)


def test_golden_bytes():
    assert pack_torque(10.0, 18.0).hex(" ") == "00 00 20 41"
    assert STATE.pack(CLOSED_LOOP).hex(" ") == "08 00 00 00"
    assert TORQUE_MODE.hex(" ") == "01 00 00 00 01 00 00 00"
    assert PAIR.pack(10.0, -10.0).hex(" ") == "00 00 20 41 00 00 20 c1"
    assert pack_heartbeat(Heartbeat(0x01000000, 8)).hex(" ") == "00 00 00 01 08 00 00 00"


def test_ids_of_the_first_and_the_last_node():
    assert frame_id(0, HEARTBEAT) == 0x001
    assert frame_id(1, SET_TORQUE) == 0x02E
    assert frame_id(63, TORQUES) == 0x7FC
    assert frame_id(63, 31) == 0x7FF


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("beyond", [1.0, 1.5, math.inf])
def test_both_ends_of_the_torque_keep_their_sign(sign, beyond):
    assert TORQUE.unpack(pack_torque(sign * 18.0 * beyond, 18.0))[0] == sign * 18.0


def test_nan_is_not_sent():
    with pytest.raises(ValueError, match="NaN"):
        pack_torque(math.nan, 18.0)


floats = st.floats(width=32, allow_nan=False)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(floats, floats, st.integers(0, 2**32 - 1), st.integers(0, 255))
def test_any_value_arrives(first, second, error, state):
    assert unpack(PAIR, PAIR.pack(first, second)) == (first, second)
    heartbeat = Heartbeat(error, state)
    assert unpack_heartbeat(pack_heartbeat(heartbeat)) == heartbeat
    clamped = min(max(first, -18.0), 18.0)
    assert TORQUE.unpack(pack_torque(first, 18.0))[0] == clamped
    assert struct.unpack("<f", pack_torque(first, 18.0)) == (clamped,)
    assert len(faults_of(error)) == error.bit_count()


@pytest.mark.parametrize("length", [0, 3, 4, 7])
def test_frames_that_are_too_short_are_rejected(length):
    assert unpack(PAIR, bytes(length)) is None
    assert (unpack_heartbeat(bytes(length)) is None) is (length < 5)


def test_errors_are_named_faults():
    assert faults_of(0) == ()
    assert [fault.name for fault in faults_of(0x03000000)] == ["motor_watchdog", "emergency_stop"]
    assert [fault.name for fault in faults_of(0x80000000)] == ["motor_error_0x80000000"]
