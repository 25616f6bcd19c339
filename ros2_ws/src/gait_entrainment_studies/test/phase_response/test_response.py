# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.phase_response.response import phase_response, predictions

TABLE_1 = WalkerParameters()
TORQUE, WIDTH = 0.1 * TABLE_1.peak_torque, 0.1


def heel_strikes(onset, torque):
    """Return 12 right heel strikes, from number 0 on, with one pulse on the right leg."""
    walker = Walker(TABLE_1, Side.RIGHT)
    walker.extend_torque(Side.LEFT, [], [], 10**11)
    begin = round(onset * 1e9)
    walker.extend_torque(Side.RIGHT, [begin, begin + round(WIDTH * 1e9)], [torque, 0.0], 10**11)
    events = walker.advance(25 * 10**9)
    return np.array(
        [e.time for e in events if e.side is Side.RIGHT and e.kind is EventKind.HEEL_STRIKE]
    )[:12]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_curve_matches_walks_with_and_without_a_pulse(sign):
    response = phase_response(PulsedGait(TABLE_1, sign * TORQUE, WIDTH), 9)
    period = response.stride_period
    plain = heel_strikes(1.0, 0.0)
    assert np.all(np.diff(response.phase) >= -1e-12)
    for i in range(response.phase.size):
        if not 0 < response.phase[i] < 1:
            continue
        # In the second stride after heel strike 0, to leave room for an early onset.
        pulsed = heel_strikes(period * (1 + response.phase[i]), sign * TORQUE)
        # Onsets are whole nanoseconds.
        assert plain[-1] - pulsed[-1] == pytest.approx(response.shift[i], abs=3e-9)
        first = plain[plain > 1.5 * period][0] - pulsed[pulsed > 1.5 * period][0]
        assert first == pytest.approx(response.first_stride_shift[i], abs=3e-9)


def test_a_pulse_in_swing_or_on_the_leading_leg_does_nothing():
    response = phase_response(PulsedGait(TABLE_1, TORQUE, WIDTH))
    outside = (response.onset <= -WIDTH) | (response.lag >= 0)
    assert np.abs(response.shift[outside]).max() < 1e-12
    assert (response.shift[~outside] > 0).all()


def test_prediction_error_is_what_a_pulse_carries_over_to_the_next_stride():
    small, large = (
        predictions(PulsedGait(TABLE_1, fraction * TORQUE, WIDTH), np.array([fraction * -0.05]))[0]
        for fraction in (0.2, 1.0)
    )
    assert abs(large.lag_error) < 1e-3
    # The neglected term is a product of two responses, so it shrinks faster than the response.
    assert abs(small.lag_error) < 0.25 * abs(large.lag_error)
