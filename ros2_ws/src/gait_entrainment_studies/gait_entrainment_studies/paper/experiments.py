# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's numerical experiments on the walker of Table 1, repeated with simulated walks."""

import math
from itertools import pairwise

import numpy as np

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Samples, Walker
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats
from gait_entrainment_studies.locking.walked import Outcome, PulsedWalk, walk_under_pulses

TABLE_1 = WalkerParameters()
PULSE_WIDTH = 0.1

# This long before a collision [ns] the walker is certainly in single stance.
_BEFORE_STRIKE = 10**6
# No step that starts near the speed of the gait takes longer [ns].
_LONGEST_STEP = 4 * 10**9


def paper_pulses(walker: WalkerParameters = TABLE_1, steps_per_pulse: int = 2) -> PulsedGait:
    """Return the gaits under the paper's pulses: 0.1 s, a tenth of the peak ankle torque."""
    return PulsedGait(walker, 0.1 * walker.peak_torque, PULSE_WIDTH, steps_per_pulse)


def paper_walk(period_offset: float, initial_phase: float, strides: int) -> PulsedWalk:
    """Walk under the paper's pulses, their period [s] off the unperturbed stride period."""
    gait = paper_pulses()
    return walk_under_pulses(gait, gait.unperturbed_period + period_offset, initial_phase, strides)


def speeds_after_collisions(initial_speed: float, steps: int) -> Floats:
    """
    Walk from an initial speed [m/s] and return the speed after each of `steps` collisions.

    They are sampled in the single stance before each collision and carried to it by energy, so
    that the rounding of its time to nanoseconds does not matter.
    """
    p = TABLE_1
    walker = Walker(p, Side.RIGHT, initial_speed)
    events = walker.advance(steps * _LONGEST_STEP)
    strikes = [e.stamp for e in events if e.kind is EventKind.HEEL_STRIKE and e.step > 0]
    samples = walker.sample(np.array(strikes[:steps], np.int64) - _BEFORE_STRIKE)
    index = np.arange(samples.leading.size)
    rate = samples.velocity[index, samples.leading]
    lean = samples.position[index, samples.leading]
    fallen = 2 * p.gravity * p.leg_length * (np.cos(lean) - math.cos(p.leg_angle))
    speeds: Floats = p.restitution * np.sqrt((p.leg_length * rate) ** 2 + fallen)
    return speeds


def floquet_by_differences() -> float:
    """Slope of the step-to-step function by fourth-order differences."""
    fixed, h = TABLE_1.speed_after_collision, 0.01

    def step(speed: float) -> float:
        return float(speeds_after_collisions(speed, 1)[0])

    near = step(fixed + h) - step(fixed - h)
    far = step(fixed + 2 * h) - step(fixed - 2 * h)
    return (8 * near - far) / (12 * h)


def floquet_by_convergence() -> float:
    """Ratio at which a disturbance of the speed shrinks from step to step, late in a walk."""
    fixed, steps = TABLE_1.speed_after_collision, 6
    fast, slow = (speeds_after_collisions(fixed * factor, steps) for factor in (1.05, 0.95))
    difference = fast - slow
    return float(difference[-1] / difference[-2])


def least_force() -> tuple[float, float]:
    """Smallest force on the leading leg [N] over a step, sampled, and how far into it [s]."""
    walker = Walker(TABLE_1, Side.RIGHT)
    stamps = np.arange(0, int(0.9e9), 10**5)
    walker.advance(int(stamps[-1]))
    samples = walker.sample(stamps)
    force = samples.force[np.arange(stamps.size), samples.leading]
    index = int(np.argmin(force))
    return float(force[index]), float(stamps[index]) * 1e-9


def outcomes_along(offsets: Floats, initial_phases: Floats) -> list[Outcome]:
    """
    Walk at each pulse period offset [s] from every initial phase; return the worst outcomes.

    Each walk is long enough to slip through a whole cycle.
    """
    period = paper_pulses().unperturbed_period
    found = []
    for offset in offsets:
        strides = 600 + int(1.5 * period / abs(offset)) if offset else 2000
        outcomes = [
            paper_walk(float(offset), float(phase), strides).outcome() for phase in initial_phases
        ]
        found.append(max(outcomes, key=list(Outcome).index))
    return found


def torque_profiles(walk: PulsedWalk, points: int) -> list[tuple[Floats, Samples]]:
    """Repeat a walk under the paper's pulses and sample it: times and samples of each stride."""
    walker = Walker(TABLE_1, Side.RIGHT)
    onsets = np.rint(walk.onsets * 1e9).astype(np.int64)
    changes = np.column_stack([onsets, onsets + round(PULSE_WIDTH * 1e9)]).ravel()
    end = int(walk.heel_strikes[-1] * 1e9)
    torques = np.tile([paper_pulses().torque, 0.0], onsets.size)
    walker.extend_torque(Side.RIGHT, changes, torques, 2 * end)
    walker.extend_torque(Side.LEFT, [], [], 2 * end)
    walker.advance(end)
    strides = []
    for begin, stop in pairwise(walk.heel_strikes):
        stamps = np.linspace(begin * 1e9, stop * 1e9, points).astype(np.int64)
        strides.append(((stamps - stamps[0]) * 1e-9, walker.sample(np.minimum(stamps, end))))
    return strides
