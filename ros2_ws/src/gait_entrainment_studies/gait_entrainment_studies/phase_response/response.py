# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The phase response: what a single pulse, at each phase, does to the timing of the gait.

A single pulse is one in so many steps that its effect has died out before the next. So the curve
is a branch of `locking.PulsedGait` with that many steps per pulse, exact like any other, and the
lock that it predicts (shift = unperturbed minus pulse period) is a locked gait of that walker.
The prediction neglects what is left of a pulse at the next: a factor cos(2 alpha)^4 per stride.
"""

import math
from dataclasses import dataclass

import numpy as np

from gait_entrainment_studies.locking.branches import (
    LockedGait,
    branches_of,
    locked_gaits,
    pieces_of,
)
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats

# The share of a disturbance that may be left once the gait has recovered: less than rounding.
_RECOVERED = 1e-17


@dataclass(frozen=True)
class PhaseResponse:
    """Response to single pulses, by phase of the onset; arrays (n,), times in s."""

    stride_period: float
    phase: Floats
    """Onset in the perturbed leg's unperturbed gait cycle, ascending in [0, 1]."""
    onset: Floats
    """Onset after the other leg's heel strike."""
    lag: Floats
    """Onset after the perturbed leg's toe-off of the same stride."""
    shift: Floats
    """How much earlier all later heel strikes come, in the long run."""
    first_stride_shift: Floats
    """How much earlier the heel strike at the end of the pulse's stride comes."""


@dataclass(frozen=True)
class Prediction:
    """The stable lock at a pulse period: predicted by single pulses, and exact."""

    period_offset: float
    predicted: LockedGait
    exact: LockedGait

    @property
    def lag_error(self) -> float:
        """Predicted minus exact lag [s]."""
        return self.predicted.lag - self.exact.lag


def single_pulse(gait: PulsedGait) -> PulsedGait:
    """Return the gaits with pulses so rare that the walker has recovered before the next."""
    kept = gait.parameters.floquet_multiplier
    strides = math.ceil(math.log(_RECOVERED) / math.log(kept) / 2)
    return PulsedGait(gait.parameters, gait.torque, gait.width, 2 * max(strides, 1))


def phase_response(gait: PulsedGait, points: int = 201) -> PhaseResponse:
    """
    Return the response of a gait to a single pulse, with `points` points on each branch.

    It is NaN if the walker would fall or fly off under the pulse.
    """
    single = single_pulse(gait)
    step = single.unperturbed_period / single.steps_per_pulse
    branches = [
        single.gaits(place, np.linspace(first, last, points))
        for place, first, last, _ in branches_of(single)
    ]
    cycle = single.unperturbed_period
    shifts = [np.where(b.feasible, cycle - b.period, np.nan) for b in branches]
    firsts = [np.where(b.feasible, step - b.step, np.nan) for b in branches]
    # Before and after, when the leg does not trail, a pulse has no effect.
    toe_off, nothing = float(branches[-1].double_stance[-1]), np.zeros(2)
    onset = np.concatenate([[-step, -gait.width], *(b.onset for b in branches), [toe_off, step]])
    return PhaseResponse(
        stride_period=2 * step,
        phase=(onset + step) / (2 * step),
        onset=onset,
        lag=onset - toe_off,
        shift=np.concatenate([nothing, *shifts, nothing]),
        first_stride_shift=np.concatenate([nothing, *firsts, nothing]),
    )


def predictions(gait: PulsedGait, period_offsets: Floats) -> list[Prediction]:
    """
    Compare predicted and exact stable locks at pulse periods [s] off the unperturbed stride.

    If there are two attractors, each is compared with its counterpart; a lock that only one of the
    two methods finds is left out.
    """
    single = single_pulse(gait)
    single_pieces, pieces = pieces_of(single), pieces_of(gait)
    found = []
    for offset in period_offsets:
        predicted = locked_gaits(single, single.unperturbed_period + offset, single_pieces)
        exact = locked_gaits(gait, gait.unperturbed_period + offset, pieces)
        for lock in (lock for lock in exact if lock.stable):
            same = [other for other in predicted if other.stable and other.place is lock.place]
            found += [Prediction(float(offset), other, lock) for other in same]
    return found
