# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One stride of the walker in the time domain, which uses no branches or derivatives."""

import math

import numpy as np

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.walker import Walker

FAR = 10**12


def walk_a_stride(parameters, speed, onset, torque, width):
    """
    Walk from a left heel strike to the next with a pulse on the right leg.

    Returns the duration [s] and the speed right afterwards [m/s]; None if the walk ended.
    """
    walker = Walker(parameters, Side.LEFT, initial_speed=speed)
    edges = [(round(onset * 1e9), torque), (round((onset + width) * 1e9), 0.0)]
    past = [value for stamp, value in edges if stamp <= 0]
    edges = [(0, past[-1] if past else 0.0), *(edge for edge in edges if edge[0] > 0)]
    walker.extend_torque(Side.RIGHT, *zip(*edges, strict=True), FAR)
    walker.extend_torque(Side.LEFT, [], [], FAR)
    strikes, speed = [], math.nan
    while len(strikes) < 2:
        events = walker.advance(walker.time_reached + 10**8)
        if walker.ending is not None or walker.time_reached > FAR // 10:
            return None
        strikes += [e for e in events if e.kind is EventKind.HEEL_STRIKE and e.step > 0]
    # The energy in the preceding single stance gives the speed, unaffected by rounded times.
    begin = walker.time_reached - 10**8
    stamps = np.arange(begin, strikes[1].stamp, 10**6, dtype=np.int64)
    if not stamps.size:
        return None
    seen = walker.sample(stamps)
    index = int(np.flatnonzero(~seen.double_stance)[-1])
    hip = int(seen.leading[index])
    rate, lean = seen.velocity[index, hip], seen.position[index, hip]
    gained = 2 * parameters.gravity * (math.cos(lean) - math.cos(parameters.leg_angle))
    squared = (parameters.leg_length * rate) ** 2 + gained * parameters.leg_length
    return strikes[1].time, parameters.restitution * math.sqrt(squared)
