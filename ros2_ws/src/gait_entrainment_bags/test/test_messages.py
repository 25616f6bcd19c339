# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Messages and values: nothing but attributes is used, and what has no meaning is refused."""

import math
from types import SimpleNamespace

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import GaitEvent, PulsePhase, Stride
from gait_entrainment.robot import RobotState, TorqueProfile
from gait_entrainment_bags.messages import (
    MessageError,
    event_of,
    nanoseconds_of,
    profile_of,
    pulse_of,
    result_values,
    state_of,
    stop_of,
)

START = 946_684_800_000_000_000


def stamp(nanoseconds):
    sec, nanosec = divmod(START + nanoseconds, 1_000_000_000)
    return SimpleNamespace(sec=sec, nanosec=nanosec)


def message(at, **values):
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp(at)), **values)


def profile_message(**changes):
    values = {
        "side": 1,
        "times": [stamp(0), stamp(5)],
        "torques": [0.0, 7.5],
        "onsets": [stamp(5)],
        "valid_until": stamp(10),
        "stop": False,
    }
    return message(0, **{**values, **changes})


def test_a_stamp_keeps_every_nanosecond():
    assert nanoseconds_of(stamp(1_234_567_891)) - START == 1_234_567_891


def test_events():
    event = event_of(message(3, kind=1, side=0, step=4), START)
    assert event == GaitEvent(3, EventKind.TOE_OFF, Side.LEFT, 4)
    assert isinstance(event.kind, EventKind)
    assert isinstance(event.side, Side)
    assert event_of(message(3, kind=1, side=0, step=4)).stamp == START + 3


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"kind": 2}, r"kind: 2; allowed: 0 \(heel_strike\), 1 \(toe_off\)"),
        ({"side": 7}, r"side: 7; allowed: 0 \(left\), 1 \(right\)"),
    ],
)
def test_an_event_without_meaning_is_refused(values, words):
    with pytest.raises(MessageError, match=f"^{words}$"):
        event_of(message(0, **{"kind": 0, "side": 0, "step": 0, **values}))


def test_profiles():
    expected = TorqueProfile(Side.RIGHT, (0, 5), (0.0, 7.5), (5,), 10)
    assert profile_of(profile_message(), START) == expected
    assert stop_of(profile_message(), START) is None
    with pytest.raises(MessageError, match=r"^side: 2"):
        profile_of(profile_message(side=2))


def test_a_stop_has_an_instant():
    told = SimpleNamespace(header=SimpleNamespace(stamp=stamp(7)), stop=True)
    assert stop_of(told, START) == 7


def test_pulses_and_states():
    assert pulse_of(message(4, torque=-3.0, duration=0.1), START) == (4, -3.0, 0.1)
    told = message(9, commanded_torque=1.0, measured_torque=0.9, angle=0.2, faults=["stopped"])
    assert state_of(told, START) == RobotState(9, 1.0, 0.9, 0.2)


def test_results_have_the_fields_of_their_messages():
    stride = Stride(2, Side.LEFT, 10, 30, 25, (1e-8, math.nan))
    values = result_values(stride, Side.LEFT)
    assert (values["header"], values["start"], values["period"]) == (30, 10, 2e-8)
    pulse = PulsePhase(1, 12, 2, 0.1, math.nan, math.nan, None)
    values = result_values(pulse, Side.LEFT)
    assert (values["header"], values["side"], values["toe_off"]) == (12, Side.LEFT, 0)
    assert set(values) == {
        *("header", "side", "number", "stride", "phase", "phase_lag", "unwrapped_lag", "toe_off"),
        "phase_lag_uncertainty",
    }
