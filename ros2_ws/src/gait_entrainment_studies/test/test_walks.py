# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side, nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment.walker.model import make_model
from gait_entrainment_studies.walks import Pulses, walk

TABLE_1 = WalkerParameters()
RUN = 10 * NANOSECONDS_PER_SECOND
WIDTH = NANOSECONDS_PER_SECOND // 10


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    period=st.floats(1.6, 2.2),
    torque=st.floats(-15, 30),
    onset=st.integers(0, 2 * NANOSECONDS_PER_SECOND),
)
def test_a_walk_equals_that_of_the_walker_bit_for_bit(period, torque, onset):
    onsets = onset + np.array([nanoseconds(n * period) for n in range(4)])
    found = walk(make_model(TABLE_1), 6, Pulses(onsets, WIDTH, torque))
    walker = Walker(TABLE_1)
    changes = np.stack([onsets, onsets + WIDTH], axis=1).ravel()
    walker.extend_torque(Side.RIGHT, changes, np.tile([torque, 0.0], onsets.size), RUN)
    walker.extend_torque(Side.LEFT, [], [], RUN)
    events = walker.advance(RUN)
    strikes = [event.time for event in events if event.kind is EventKind.HEEL_STRIKE][:7]
    assert np.array_equal(found.heel_strikes, strikes[: found.heel_strikes.size])
    offs = [event.time for event in events if event.kind is EventKind.TOE_OFF][:6]
    assert np.array_equal(found.toe_offs, offs[: found.toe_offs.size])


def test_overlapping_pulses_are_refused():
    with pytest.raises(ValueError, match="not overlap"):
        walk(make_model(TABLE_1), 2, Pulses(np.array([0, WIDTH - 1]), WIDTH, 1.0))
