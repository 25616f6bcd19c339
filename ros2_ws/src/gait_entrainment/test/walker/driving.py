# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Shorthands for driving a walker, for the tests next to this file."""

import numpy as np
from hypothesis import strategies as st
from paper_equations import Table1

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker

SECOND = 1_000_000_000
MODERATE = st.floats(-40, 40)
TABLE_1 = WalkerParameters()
# Long feet and much plantarflexion: toe-off comes after the apex.
LATE_TOE_OFF = WalkerParameters(
    foot_length=0.35, max_plantarflexion=2.8, ankle_stiffness=90.0, mass=75.0
)


def paper_form(p):
    """The same walker for the paper's equations."""
    return Table1(
        p.mass,
        p.leg_length,
        p.foot_length,
        p.gravity,
        p.leg_angle,
        p.max_plantarflexion,
        p.ankle_stiffness,
    )


def promise(walker, pulses, until):
    """Promise pulses[side] = [(onset, end, torque), ...], in ns, up to `until`."""
    for side in Side:
        times, torques = [], []
        for onset, end, torque in pulses[side]:
            if times and times[-1] == onset:
                torques[-1] = torque
            else:
                times.append(onset)
                torques.append(torque)
            times.append(end)
            torques.append(0.0)
        walker.extend_torque(side, times, torques, until)


def walked(pulses=((), ()), seconds=10.0, parameters=TABLE_1, **start):
    """Walk with pulses in ns; returns the walker and its events."""
    walker = Walker(parameters, **start)
    until = int(seconds * SECOND)
    promise(walker, pulses, until)
    return walker, walker.advance(until)


def times(events, kind):
    return np.array([event.time for event in events if event.kind == kind])


def heel_strikes(events):
    return times(events, EventKind.HEEL_STRIKE)


def toe_offs(events):
    return times(events, EventKind.TOE_OFF)


@st.composite
def pulse_trains(draw, torque=MODERATE, seconds=6.0):
    """Up to five pulses on one ankle [ns], apart from each other."""
    pulses, now = [], 0
    for _ in range(draw(st.integers(0, 5))):
        onset = now + int(draw(st.floats(0.01, 1.5)) * SECOND)
        end = onset + int(draw(st.floats(0.01, 0.5)) * SECOND)
        if end > seconds * SECOND:
            break
        pulses.append((onset, end, draw(torque)))
        now = end
    return pulses


def in_seconds(pulses):
    return [[(a / SECOND, b / SECOND, torque) for a, b, torque in side] for side in pulses]


def leg_angle(samples):
    """Lean theta of the leading leg, and its rate."""
    row = np.arange(samples.leading.size)
    return samples.position[row, samples.leading], samples.velocity[row, samples.leading]
