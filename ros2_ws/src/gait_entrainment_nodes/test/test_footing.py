# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The position derived from the joint angles fits the footholds, one step length apart."""

import numpy as np
import pytest

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_nodes.nodes.footing import Footing

SECOND = 1_000_000_000
WALKERS = {
    "paper": WalkerParameters(),
    # Long feet and much plantarflexion: toe-off comes after the apex.
    "late toe-off": WalkerParameters(
        foot_length=0.35, max_plantarflexion=2.8, ankle_stiffness=90.0, mass=75.0
    ),
}


@pytest.mark.parametrize("parameters", WALKERS.values(), ids=WALKERS)
@pytest.mark.parametrize("period", [5_000_000, 70_000_003], ids=["200 Hz", "14 Hz"])
def test_mass_stands_over_the_footholds(parameters, period):
    walker = Walker(parameters, Side.LEFT)
    for side in Side:
        # Pulses of either sign, among them one that unloads the trailing foot.
        times = np.arange(1, 40) * SECOND // 4
        torques = np.resize([25.0, 0.0, -15.0, 0.0, 10.0], times.size)
        walker.extend_torque(side, [0, *times], [0.0, *torques], 10 * SECOND)
    strikes = [e for e in walker.advance(10 * SECOND) if e.kind == EventKind.HEEL_STRIKE]
    assert len(strikes) > 8
    stamps = np.unique([*range(0, 10 * SECOND, period), *(e.stamp for e in strikes)])
    samples = walker.sample(stamps)
    assert samples.unloaded.any()
    steps = np.searchsorted([e.stamp for e in strikes], stamps, side="right") - 1
    heel = steps * 2 * parameters.leg_length * np.sin(parameters.leg_angle)
    lean = samples.position[np.arange(stamps.size), samples.leading]
    footing = Footing(parameters.leg_length, parameters.foot_length)
    places = np.array([footing.place(p[:2], p[2:]) for p in samples.position])
    assert places[:, 0] == pytest.approx(heel - parameters.leg_length * np.sin(lean), abs=1e-9)
    assert places[:, 1] == pytest.approx(parameters.leg_length * np.cos(lean), abs=1e-9)
