# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Event times to 1e-13 s, compared with 32-digit integration."""

from types import SimpleNamespace

import numpy as np
import pytest
from driving import SECOND, TABLE_1, heel_strikes, toe_offs, walked
from thirty_digits import Reference, mpf

TOLERANCE = 1e-13


def walk(steps, onsets=(), width=0, torque=0.0):
    pulses = [(int(onset), int(onset) + width, torque) for onset in onsets]
    _, events = walked(((), pulses), seconds=2.0 * steps)
    return SimpleNamespace(
        heel_strikes=heel_strikes(events)[: steps + 1], toe_offs=toe_offs(events)[:steps]
    )


def edges_of(events, onsets, width, torque):
    """Exact times at which the torque changes in each double stance of the right leg."""
    edges = {}
    for step in range(1, events.toe_offs.size, 2):
        start, end = events.heel_strikes[step], events.toe_offs[step]
        for onset in onsets:
            for stamp, level in ((onset, torque), (onset + width, 0.0)):
                # Changes in single stance are left out.
                if start < stamp / SECOND < end:
                    edges.setdefault(step, []).append((mpf(int(stamp)) / SECOND, level))
            if onset / SECOND <= start < (onset + width) / SECOND:
                edges.setdefault(step, []).insert(0, (None, torque))
    return edges


def worst(events, reference):
    strikes, offs = reference
    errors = [float(t - mpf(float(s))) for s, t in zip(events.heel_strikes, strikes, strict=True)]
    errors += [float(t - mpf(float(s))) for s, t in zip(events.toe_offs, offs, strict=True)]
    print(f"\nworst of {len(errors)} events: {np.abs(errors).max():.1e} s")
    return np.abs(errors).max()


def test_unperturbed_run_as_long_as_the_default_protocol():
    events = walk(160)
    assert worst(events, Reference().walk(160, {})) < TOLERANCE


@pytest.mark.parametrize(
    ("period", "torque"), [(1.8832, 0.1 * TABLE_1.peak_torque), (1.70, 13.0), (2.05, -9.0)]
)
def test_pulses_that_lock_and_pulses_that_drift_through_double_stance(period, torque):
    """Drifting pulses also begin before heel strike and end after toe-off."""
    onsets = np.array([int(1.15e9) + round(n * period * SECOND) for n in range(20)])
    width = SECOND // 10
    events = walk(24, onsets, width, torque)
    edges = edges_of(events, onsets, width, torque)
    assert edges
    assert worst(events, Reference().walk(24, edges)) < TOLERANCE
