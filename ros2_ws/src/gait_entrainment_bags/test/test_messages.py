# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Messages to values and back: only attributes are used, meaningless values are refused."""

import math
from types import SimpleNamespace

import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.gait import GaitEvent, PulsePhase, Stride
from gait_entrainment.robot import RobotState, TorqueProfile
from gait_entrainment_bags.messages import (
    MessageError,
    ProfileOrder,
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
    return message(0, **values | changes)


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
def test_an_event_with_unknown_values_is_refused(values, words):
    with pytest.raises(MessageError, match=f"^{words}$"):
        event_of(message(0, **{"kind": 0, "side": 0, "step": 0, **values}))


def test_profiles():
    expected = TorqueProfile(Side.RIGHT, (0, 5), (0.0, 7.5), (5,), 10)
    assert profile_of(profile_message(), START) == expected
    assert stop_of(profile_message(), START) is None
    with pytest.raises(MessageError, match=r"^side: 2"):
        profile_of(profile_message(side=2))
    for wrong in (
        {"times": [], "torques": []},
        {"times": [stamp(5), stamp(0)]},
        {"torques": [0.0, math.nan]},
        {"onsets": [stamp(10)]},
        {"valid_until": stamp(5)},
    ):
        with pytest.raises(MessageError, match="profile"):
            profile_of(profile_message(**wrong))


def test_each_profile_is_checked_against_the_previous_one():
    def take(order, revision, begin, until, **values):
        sent = profile_message(
            revision=revision, last=False, times=[stamp(begin)], torques=[0.0], onsets=[],
            valid_until=stamp(until), **values,
        )  # fmt: skip
        void, hole, profile = order.take(sent)
        stamps = (void, *(hole or ()), profile and profile.valid_until)
        return tuple(value and value - START for value in stamps)

    order = ProfileOrder()
    assert take(order, 0, 0, 10) == (None, 10)
    assert take(order, 3, 30, 40) == (None, 10, 30, 40)  # revisions 1 and 2 are missing
    with pytest.raises(MessageError, match="adjoin"):
        take(order, 4, 10**12, 2 * 10**12)  # nothing is missing between the two
    assert take(order, 5, 50, 10**12) == (None, 40, 50, 10**12)  # promised too far ahead
    with pytest.raises(MessageError, match="revision 5: does not adjoin 5"):
        take(order, 5, 50, 60)
    assert take(order, 6, 60, 70) == (60, 70)  # what was promised from 60 on is void
    assert order.hole_up_to(START + 70) is None
    assert order.hole_up_to(START + 71) == (START + 70, START + 71)
    assert take(order, 7, 70, 80, stop=True) == (0, None)
    assert order.hole_up_to(START + 71) is None
    assert ProfileOrder().hole_up_to(START) == (0, START)


def test_a_stop_has_a_time():
    stop = SimpleNamespace(header=SimpleNamespace(stamp=stamp(7)), stop=True)
    assert stop_of(stop, START) == 7


def test_pulses_and_states():
    assert pulse_of(message(4, torque=-3.0, duration=0.1), START) == (4, -3.0, 0.1)
    for torque, duration in (math.nan, 0.1), (3.0, math.inf), (3.0, 1e308), (3.0, -0.1):
        with pytest.raises(MessageError, match="torque, duration"):
            pulse_of(message(4, torque=torque, duration=duration))
    state = message(9, commanded_torque=1.0, measured_torque=0.9, angle=0.2, faults=["stopped"])
    assert state_of(state, START) == RobotState(9, 1.0, 0.9, 0.2)


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
