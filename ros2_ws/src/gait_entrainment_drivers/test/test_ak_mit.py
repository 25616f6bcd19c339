# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""MIT mode on the wire: golden bytes, both ends of every range, and any value in between."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_drivers.ak_mit import (
    DAMPING,
    MOTORS,
    POSITION,
    STIFFNESS,
    Command,
    Reply,
    pack_command,
    pack_reply,
    resolution,
    unpack_command,
    unpack_reply,
)

motors = st.sampled_from(sorted(MOTORS))
any_float = st.floats(allow_nan=False)


def test_golden_frame():
    data = pack_command(Command(torque=10.0), MOTORS["AK70-10"])
    assert data.hex(" ").upper() == "7F FF 7F F0 00 00 0B 32"


def test_zero_torque_is_sent_as_the_code_just_below_zero():
    torque = unpack_command(pack_command(Command(), MOTORS["AK70-10"]), MOTORS["AK70-10"]).torque
    assert torque == pytest.approx(-0.0061, abs=1e-4)
    assert abs(torque) < resolution(MOTORS["AK70-10"])


@pytest.mark.parametrize("name", sorted(MOTORS))
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("beyond", [1.0, 1.5, math.inf])
def test_both_ends_of_each_range_keep_their_sign(name, sign, beyond):
    """Scaling by 2^n instead of 2^n - 1 would wrap the upper end to the lower one."""
    motor = MOTORS[name]
    command = unpack_command(
        pack_command(
            Command(
                position=sign * POSITION * beyond,
                velocity=sign * motor.velocity * beyond,
                stiffness=STIFFNESS * beyond if sign > 0 else -1.0,
                damping=DAMPING * beyond if sign > 0 else -1.0,
                torque=sign * motor.torque * beyond,
            ),
            motor,
        ),
        motor,
    )
    assert command == Command(
        position=sign * POSITION,
        velocity=sign * motor.velocity,
        stiffness=STIFFNESS if sign > 0 else 0.0,
        damping=DAMPING if sign > 0 else 0.0,
        torque=sign * motor.torque,
    )


def test_full_scale_bytes():
    motor = MOTORS["AK80-9"]
    full = Command(POSITION, 50.0, STIFFNESS, DAMPING, 18.0)
    assert pack_command(full, motor).hex() == "ffffffffffffffff"
    lowest = Command(-POSITION, -50.0, 0.0, 0.0, -18.0)
    assert pack_command(lowest, motor).hex() == "0000000000000000"


@settings(derandomize=True, deadline=None, max_examples=300)
@given(motors, any_float, any_float, any_float, any_float, any_float)
def test_any_command_arrives_clamped_and_within_one_step(name, position, velocity, kp, kd, torque):
    motor = MOTORS[name]
    data = pack_command(Command(position, velocity, kp, kd, torque), motor)
    assert len(data) == 8
    back = unpack_command(data, motor)
    for value, got, low, high, bits in (
        (position, back.position, -POSITION, POSITION, 16),
        (velocity, back.velocity, -motor.velocity, motor.velocity, 12),
        (kp, back.stiffness, 0.0, STIFFNESS, 12),
        (kd, back.damping, 0.0, DAMPING, 12),
        (torque, back.torque, -motor.torque, motor.torque, 12),
    ):
        step = (high - low) / (2**bits - 1)
        assert low <= got <= high
        assert -1e-6 * step <= min(max(value, low), high) - got <= step
    # A decoded value has its own code: it packs to the same bytes.
    assert pack_command(back, motor) == data


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    motors, st.integers(0, 255), any_float, any_float, any_float,
    st.sampled_from([6, 8]), st.integers(0, 255),
)  # fmt: skip
def test_replies_of_both_lengths(name, motor_id, position, velocity, torque, length, error):
    motor = MOTORS[name]
    data = pack_reply(Reply(motor_id, position, velocity, torque, error), motor, length)
    assert len(data) == length
    back = unpack_reply(data, motor)
    assert back.motor_id == motor_id
    assert back.error == (error if length == 8 else 0)
    clamped = min(max(torque, -motor.torque), motor.torque)
    assert abs(back.torque - clamped) <= resolution(motor) * (1 + 1e-6)


@pytest.mark.parametrize("length", [0, 1, 5, 7])
def test_other_lengths_are_not_a_reply(length):
    assert unpack_reply(bytes(length), MOTORS["AK80-9"]) is None


def test_nan_is_not_sent():
    with pytest.raises(ValueError, match="NaN"):
        pack_command(Command(torque=math.nan), MOTORS["AK80-9"])
