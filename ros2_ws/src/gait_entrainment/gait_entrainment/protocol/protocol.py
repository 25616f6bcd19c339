# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The protocol of one entrainment experiment: baseline strides, pulses, washout strides.

The default values are the example of Ahn and Hogan (2012): pulses of 0.1 s and a tenth of the
peak ankle torque, at a period 50 ms below the walker's own stride period.
"""

import math
from dataclasses import dataclass, field

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.parameters import WalkerParameters


class ProtocolError(ValueError):
    """A protocol that cannot be conducted; the message says place, field and what is allowed."""


@dataclass(frozen=True)
class PulsePlan:
    """
    The pulses of a protocol.

    Exactly one of ``torque`` and ``torque_fraction``, and one of ``period`` and
    ``period_offset``, is given; the other is None.
    """

    count: int = 50  # number of pulses
    width: float = 0.1  # duration of each pulse [s]
    torque: float | None = None  # height [N m], plantarflexion positive
    torque_fraction: float | None = 0.1  # height as a fraction of the walker's peak ankle torque
    period: float | None = None  # from onset to onset [s]
    period_offset: float | None = -0.05  # period minus the stride period of the baseline [s]
    initial_phase: float = 0.0  # place of the first pulse in the stride after the baseline, [0, 1)

    def period_for(self, measured_period: float) -> float:
        """
        Return the period of the pulses [s] for a measured stride period [s].

        Raises
        ------
        ProtocolError
            where successive pulses would overlap.

        """
        if self.period is not None:
            period = self.period
        else:
            assert self.period_offset is not None
            period = measured_period + self.period_offset
        # In stamps: successive onsets are at least the whole nanoseconds of a period apart.
        if not period * NANOSECONDS_PER_SECOND >= nanoseconds(self.width) + 1:
            raise ProtocolError(
                f"pulses.width: {self.width:g} s makes the pulses overlap at a pulse period of "
                f"{period:.6g} s; allowed: below the period"
            )
        return period


@dataclass(frozen=True)
class Protocol:
    """One experiment, complete: what read_protocol returns and what a bag keeps."""

    name: str = "paper_example"  # names the bag folder
    side: Side = Side.RIGHT  # the perturbed leg
    baseline: int = 15  # unperturbed strides at the start
    pulses: PulsePlan = field(default_factory=PulsePlan)
    washout: int = 15  # strides after the strides of the pulses
    walker: WalkerParameters = field(default_factory=WalkerParameters)
    driver: str = "ideal"  # ankle robot driver
    seed: int = 0  # for drivers and walkers that draw random numbers

    @property
    def strides(self) -> int:
        """Strides of the whole run, whatever the pulse period: one per pulse, and those around."""
        return self.baseline + self.pulses.count + self.washout

    @property
    def pulse_torque(self) -> float:
        """Height of the pulses [N m], plantarflexion positive."""
        if self.pulses.torque is not None:
            return self.pulses.torque
        assert self.pulses.torque_fraction is not None
        return self.pulses.torque_fraction * self.walker.peak_torque

    def __post_init__(self) -> None:
        """Check what concerns more than one field; the reader checks each field by itself."""
        plan = self.pulses
        if (plan.torque is None) == (plan.torque_fraction is None):
            raise ProtocolError("pulses: give either torque or torque_fraction")
        if (plan.period is None) == (plan.period_offset is None):
            raise ProtocolError("pulses: give either period or period_offset")
        if plan.period is not None:
            plan.period_for(math.nan)
        elif self.baseline < 2:
            raise ProtocolError(
                f"baseline: {self.baseline} leaves no complete stride to measure period_offset "
                "from; allowed: at least 2, or at least 1 with an absolute period"
            )
