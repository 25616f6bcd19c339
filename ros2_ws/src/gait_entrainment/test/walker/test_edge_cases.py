# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Edge cases of the torque, and the reported ends of a walk."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from driving import LATE_TOE_OFF, SECOND, TABLE_1, heel_strikes, leg_angle, toe_offs, walked
from scipy.integrate import quad
from step_to_step import step_to_step

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import EndingKind, Stance, Walker, segment

PERIOD = float(heel_strikes(walked()[1])[1])
TOE_OFF = float(toe_offs(walked()[1])[0])
MILLISECOND = SECOND // 1000


def ns(time):
    return round(time * SECOND)


def right_pulse(onset, end, torque):
    """A pulse on the right ankle, in ns."""
    return ((), ((ns(onset), ns(end), torque),))


def test_a_pulse_outside_double_stance_of_its_leg_does_nothing():
    _, free = walked()
    for onset in (0.0, TOE_OFF, 0.7, PERIOD + TOE_OFF + 0.002):
        # The right leg trails from PERIOD to PERIOD + TOE_OFF only.
        _, events = walked(right_pulse(onset, min(onset + 0.25, 2 * PERIOD), 30.0))
        if onset + 0.25 <= PERIOD or onset > PERIOD + TOE_OFF:
            assert events == free


def test_the_rest_of_a_pulse_after_toe_off_does_nothing():
    onset = PERIOD + TOE_OFF - 0.05
    _, short = walked(right_pulse(onset, onset + 0.08, 13.0))
    _, long = walked(right_pulse(onset, onset + 0.5, 13.0))
    assert short == long
    assert heel_strikes(short)[2] < 2 * PERIOD


def test_a_pulse_that_begins_in_single_stance_acts_from_heel_strike_on():
    _, before = walked(right_pulse(0.6, PERIOD + 0.1, 13.0))
    _, again = walked(right_pulse(PERIOD - 0.01, PERIOD + 0.1, 13.0))
    assert before == again
    _, at_strike = walked(right_pulse(PERIOD, PERIOD + 0.1, 13.0))
    assert heel_strikes(at_strike) == pytest.approx(heel_strikes(before), abs=1e-9)
    assert heel_strikes(before)[2] < 2 * PERIOD - 0.01


def test_a_pulse_that_begins_while_its_leg_leads_waits_for_it_to_trail():
    _, events = walked(right_pulse(0.1, PERIOD + 0.1, 13.0))
    _, at_strike = walked(right_pulse(PERIOD - 0.01, PERIOD + 0.1, 13.0))
    assert events == at_strike


def test_pulses_on_both_legs_each_act_on_their_own_leg():
    left, right = (ns(0.1), ns(0.2), 13.0), (ns(PERIOD), ns(PERIOD + 0.1), 13.0)
    _, events = walked(((left,), (right,)), 2.0)
    _, only_left = walked(((left,), ()), 2.0)
    assert events[:3] == only_left[:3]
    # A pulse on a leg that does not trail is delivered and has no effect.
    walker, both = walked(((left,), (left,)), 0.9)
    assert both == only_left[:2]
    samples = walker.sample(np.array([ns(0.15)]))
    assert samples.delivered_torque[0].tolist() == [13.0, 13.0]
    assert samples.effective_torque[0].tolist() == [13.0, 0.0]


def test_energy_of_a_pulse_is_its_torque_times_the_rotation():
    walker, events = walked(right_pulse(PERIOD + 0.1, PERIOD + 0.2, 13.0), 3.0)
    ankle = walker.sample(np.array([ns(PERIOD + 0.1), ns(PERIOD + 0.2)])).position[:, 3]
    work = 13.0 * np.diff(ankle)[0]
    rates = []
    for strike in (events[4], walked(seconds=3.0)[1][4]):
        other, _ = walked(((), ()) if rates else right_pulse(PERIOD + 0.1, PERIOD + 0.2, 13.0))
        rates.append(leg_angle(other.sample(np.array([strike.stamp + 1])))[1][0])
    kept = math.cos(math.pi / 3) ** 2
    energy = 0.5 * TABLE_1.mass * (rates[0] ** 2 - rates[1] ** 2)
    assert energy == pytest.approx(kept * work, rel=1e-6)


def test_a_negative_pulse_larger_than_the_spring_unloads_the_foot_until_it_ends():
    onset, end = PERIOD + 0.2, PERIOD + 0.3
    walker, events = walked(right_pulse(onset, end, -100.0), 2.0, initial_speed=1.1)
    del events
    start = ns(0.9) + np.arange(0, SECOND, MILLISECOND)
    s = walker.sample(start[start <= walker.time_reached])
    unloaded = s.unloaded
    assert unloaded.any()
    on = s.delivered_torque[:, Side.RIGHT] != 0
    trailing = s.double_stance & (s.leading == Side.LEFT)
    assert np.array_equal(unloaded, on & trailing)
    assert np.all(s.force[unloaded, Side.RIGHT] == 0)
    assert np.all(s.effort[unloaded, 3] == 0)
    assert s.effective_torque[unloaded, Side.RIGHT] == pytest.approx(
        -s.intrinsic_torque[unloaded, Side.RIGHT]
    )
    # Double stance goes on, and the spring pushes again once the pulse is over.
    after = trailing & (start[: on.size] > ns(end) + MILLISECOND)
    assert np.all(s.force[after, Side.RIGHT] > 0)


def test_a_negative_pulse_unloads_only_once_the_spring_is_weaker():
    """k (mu - psi) = 20 N m is crossed within the pulse: the torque goes to zero there."""
    walker, events = walked(right_pulse(PERIOD + 0.15, PERIOD + 0.5, -20.0), 3.0)
    toe_off = events[3]
    assert toe_off.kind == EventKind.TOE_OFF
    grid = np.arange(events[2].stamp, toe_off.stamp, MILLISECOND // 4)
    s = walker.sample(grid)
    spring = s.intrinsic_torque[:, Side.RIGHT]
    pulse = s.delivered_torque[:, Side.RIGHT]
    assert s.effort[:, 3] == pytest.approx(np.maximum(0, spring + pulse), abs=1e-9)
    assert s.unloaded.any()
    assert not s.unloaded.all()
    # Toe-off is where the ankle reaches mu, unloaded or not.
    end = walker.sample(np.array([toe_off.stamp - 1])).position[0, 3]
    assert end == pytest.approx(TABLE_1.max_plantarflexion - math.pi / 2, abs=1e-7)
    # Pushed less, the walker is late.
    assert toe_offs(events)[1] > PERIOD + TOE_OFF


def test_a_torque_change_at_the_stamp_of_an_event_comes_after_it():
    toe_off = walked()[1][1].stamp
    for stamp in (toe_off, toe_off + 1):
        _, events = walked((((0, stamp, 5.0),), ()))
        _, longer = walked((((0, SECOND // 2, 5.0),), ()))
        assert events[1].stamp < toe_off
        assert events == longer


# Ends


def fall_in_single_stance(rate):
    """Apex energy, turning angle and time of a walk that starts with theta_dot = -rate."""
    p = TABLE_1
    work = p.push_off_work
    square = rate**2 + 2 * work / p.mass - 2 * 9.81 * (1 - math.cos(p.leg_angle))
    angle = math.acos(1 + square / (2 * 9.81))
    return square, angle


def test_fall_in_single_stance():
    rate = 0.2
    square, angle = fall_in_single_stance(rate)
    assert square < 0
    walker, events = walked(seconds=60.0, initial_speed=rate)
    ending = walker.ending
    assert (ending.kind, ending.stance, ending.side) == (
        EndingKind.FALL,
        Stance.SINGLE,
        Side.RIGHT,
    )
    assert ending.step == 1
    assert ending.missing == pytest.approx(-square * TABLE_1.mass / 2, rel=1e-9)
    assert ending.angle == pytest.approx(angle, abs=1e-9)

    # dt = d theta / sqrt(...) from toe-off, with the square root at the turn taken out.
    def integrand(u):
        theta = angle + u * u
        below = 2 * math.sin((theta + angle) / 2) * math.sin((theta - angle) / 2)
        return 2 * u / math.sqrt(2 * 9.81 * below) if u > 0 else math.sqrt(2 / 9.81 / angle)

    span = quad(integrand, 0, math.sqrt(TABLE_1.toe_off_angle - angle), epsabs=1e-13)[0]
    assert ending.time == pytest.approx(events[1].time + span, abs=1e-9)
    assert "fell in single stance of step 1" in ending.message
    assert "J were missing" in ending.message


def test_fall_in_double_stance_under_a_negative_pulse():
    """Without push-off the mass climbs as far as its kinetic energy carries it."""
    rate = TABLE_1.speed_after_collision
    walker, events = walked((((0, SECOND, -1000.0),), ()), 5.0)
    ending = walker.ending
    assert (ending.kind, ending.stance) == (EndingKind.FALL, Stance.DOUBLE)
    assert len(events) == 1
    height = rate**2 / (2 * 9.81)
    angle = math.acos(math.cos(TABLE_1.leg_angle) + height)
    assert ending.angle == pytest.approx(angle, abs=1e-12)
    climb = math.cos(TABLE_1.toe_off_angle) - math.cos(TABLE_1.leg_angle)
    missing = 80 * (9.81 * climb - rate**2 / 2)
    assert ending.missing == pytest.approx(missing, rel=1e-9)


def test_fly_off_at_the_onset_of_a_large_pulse():
    walker, _ = walked((((ns(0.1), ns(0.2), 120.0),), ()), 5.0)
    ending = walker.ending
    assert (ending.kind, ending.stance) == (EndingKind.FLY_OFF, Stance.DOUBLE)
    assert ending.time == pytest.approx(0.1, abs=1e-12)
    assert ending.side == Side.RIGHT
    # Right before the pulse the leg still carries the force that the pulse takes off it.
    before = walker.sample(np.array([ns(0.1)]))
    theta, _ = leg_angle(before)
    psi = before.position[0, 2] + math.pi / 2
    arm = (1 - 0.8 * math.sin(theta[0])) / (0.2 * math.sin(psi))
    force = before.force[0, Side.RIGHT] - 120 * arm
    assert force < 0
    assert ending.missing >= -force - 1e-6
    assert "flew off in double stance" in ending.message


def test_fly_off_within_a_segment_under_a_pulse_that_is_just_too_large():
    """The force dips through zero within a segment, away from events and torque changes."""
    long_feet = WalkerParameters(
        leg_angle=0.52, foot_length=0.405, max_plantarflexion=2.79, ankle_stiffness=110.0
    )
    onset, end = ns(0.05), ns(1.0)

    def attempt(torque):
        return walked((((onset, end, torque),), ()), 1.2, long_feet)

    low, high = 1.0, 60.0
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        if attempt(middle)[0].ending is None:
            low = middle
        else:
            high = middle
    # The largest torque that is walked through leaves no force at some time in between.
    walker, events = attempt(low)
    grid = np.arange(onset + 1, events[1].stamp, MILLISECOND // 50)
    force = walker.sample(grid).force[:, Side.RIGHT]
    dip = grid[np.argmin(force)]
    assert force.min() == pytest.approx(0, abs=1e-4)
    assert onset + MILLISECOND < dip < events[1].stamp - MILLISECOND
    ending = attempt(high)[0].ending
    assert (ending.kind, ending.stance) == (EndingKind.FLY_OFF, Stance.DOUBLE)
    assert ending.time * SECOND == pytest.approx(dip, abs=MILLISECOND)
    assert 0 <= ending.missing < 1e-6


@pytest.mark.parametrize("torque", [0.0, 5.0, 20.0, 30.0, 60.0, -20.0])
def test_fly_off_at_the_speed_where_the_leading_leg_has_no_force_left(torque):
    """Both if bounds clear a segment without a search and if they do not."""
    p = TABLE_1
    pulse = (((0, ns(0.05), torque),), ())
    arm = (1 - 0.8 * math.sin(p.leg_angle)) / (0.2 * math.cos(p.leg_angle))
    hold = p.mass * 9.81 * math.cos(p.leg_angle) - arm * (p.peak_torque + torque)
    # A newton above and below what is needed at the start, where the force is least.
    slow, fast = (math.sqrt((hold - spare) / p.mass) for spare in (1.0, -1.0))
    assert walked(pulse, 0.1, initial_speed=slow)[0].ending is None
    ending = walked(pulse, 0.1, initial_speed=fast)[0].ending
    assert ending.kind == EndingKind.FLY_OFF
    assert ending.time == 0
    assert ending.missing == pytest.approx(1.0, rel=1e-6)


def test_fly_off_in_single_stance_once_gravity_no_longer_holds():
    """A fast walker whose push-off is held back at first, when it would lift the leg."""
    p = TABLE_1
    walker, events = walked((((0, ns(0.09), -1000.0),), ()), 2.0, initial_speed=math.sqrt(8.4))
    ending = walker.ending
    assert (ending.kind, ending.stance) == (EndingKind.FLY_OFF, Stance.SINGLE)
    assert [event.kind for event in events] == [EventKind.HEEL_STRIKE, EventKind.TOE_OFF]
    theta, rate = leg_angle(walker.sample(np.array([events[1].stamp])))
    apex = rate[0] ** 2 - 2 * 9.81 * (1 - math.cos(theta[0]))
    assert math.cos(ending.angle) == pytest.approx((apex / 9.81 + 2) / 3, rel=1e-9)
    assert ending.angle < 0
    at_strike = p.mass * (9.81 * (3 * math.cos(p.leg_angle) - 2) - apex)
    assert ending.missing == pytest.approx(-at_strike, rel=1e-6)
    at_end = walker.sample(np.array([ending.stamp]))
    assert at_end.force[0, Side.RIGHT] == pytest.approx(0, abs=1e-5)


def test_a_walk_that_has_ended_returns_no_more_events():
    walker, _ = walked(seconds=60.0, initial_speed=0.2)
    assert walker.time_reached == walker.ending.stamp
    assert walker.advance(61 * SECOND) == []
    assert walker.time_reached == walker.ending.stamp
    frozen = walker.sample(np.array([walker.time_reached]))
    assert leg_angle(frozen)[1] == pytest.approx(0, abs=1e-6)


def test_slow_start_with_late_toe_off_falls_in_double_stance():
    walker, events = walked(seconds=20.0, parameters=LATE_TOE_OFF, initial_speed=0.05)
    assert walker.ending.stance == Stance.DOUBLE
    assert walker.ending.angle > 0
    assert len(events) == 1


def test_step_to_step_is_nan_if_the_walker_falls():
    step = step_to_step(TABLE_1, [0.2, 0.9], 0.0, 0.1, 0.0)
    assert np.isnan(step.speed).tolist() == [True, False]
    assert np.isnan(step.duration).tolist() == [True, False]


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_a_start_without_speed_is_refused(speed):
    with pytest.raises(ValueError, match="initial_speed"):
        Walker(TABLE_1, initial_speed=speed)


@pytest.mark.parametrize("torque", [0.0, -0.11])
def test_a_start_at_almost_no_speed_takes_few_panels(monkeypatch, torque):
    """
    Near alpha = pi / 4 the collision leaves a speed whose square is mostly rounding.

    No panel over it converges, however narrow: they used to be halved down to 1e-12 rad.
    """
    parameters = WalkerParameters(
        mass=7.5,
        leg_length=0.2070358564066132,
        foot_length=0.06037016813419777,
        gravity=1.7398843650819493,
        leg_angle=0.7853884337131884,
        max_plantarflexion=3.140736786912436,
        ankle_stiffness=0.2945487543865029,
    )
    walker = Walker(parameters, Side.RIGHT)
    walker.extend_torque(Side.LEFT, [0], [torque], 10 * SECOND)
    walker.advance(SECOND // 10)
    last = walker._log[walker._count - 1]
    assert (last["ends"] == segment.Switch.FALL) == (torque < 0)
    # The loop in Python, not compiled, so that its panels can be counted.
    fields = SimpleNamespace(**{name: last[name] for name in last.dtype.names})
    calls = []

    def counted(name):
        compiled = getattr(segment, name)

        def call(*arguments):
            calls.append(name)
            return compiled(*(last if a is fields else a for a in arguments))

        return call

    for name in ("panel", "stall_panel", "smooth"):
        monkeypatch.setattr(segment, name, counted(name))
    work = np.empty(segment.WORK_SIZE)
    time = segment.double_stance_time.py_func(
        walker._model, work, fields, last["position"], last["end"]
    )
    assert time == pytest.approx(last["duration"], rel=1e-9)
    assert len(calls) - calls.count("smooth") < 300
