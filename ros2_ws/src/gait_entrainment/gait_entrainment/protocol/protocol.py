# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The protocol of one entrainment experiment: baseline strides, pulses, washout strides.

The default values are the example of Ahn and Hogan (2012): pulses of 0.1 s and a tenth of the
peak ankle torque, at a period 50 ms below the walker's own stride period.
"""

import math
from dataclasses import dataclass, field
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.robot import DeviceLimits
from gait_entrainment.settings import Setting, check_settings, setting, settings_of

# A million strides are three weeks of walking: no run is longer.
_MOST = 1_000_000


class ProtocolError(UsageError):
    """A protocol that cannot be conducted; the message says place, field and what is allowed."""


@dataclass(frozen=True)
class PulsePlan:
    """
    The pulses of a protocol.

    Exactly one of ``torque`` and ``torque_fraction``, and one of ``period`` and
    ``period_offset``, is given; the other is None.
    """

    count: int = setting(50, "number of pulses", within=(1, _MOST))
    # A pulse shorter than a nanosecond has no stamps.
    width: float = setting(0.1, "duration of a pulse", "s", (1e-9, 10.0))
    torque: float | None = setting(
        None, "height of the pulses, plantarflexion positive", "N m", kind=float, optional=True
    )
    torque_fraction: float | None = setting(
        0.1, "the same as a fraction of the peak ankle torque", "1", (-1.0, 1.0), optional=True
    )
    # Until the stride period is measured, the experiment proceeds by at most a pulse period.
    period: float | None = setting(
        None,
        "pulse period, from onset to onset, instead of an offset",
        "s",
        (1e-3, 100.0),
        kind=float,
        optional=True,
    )
    period_offset: float | None = setting(
        -0.05,
        "pulse period minus the stride period of the baseline",
        "s",
        (-100.0, 100.0),
        optional=True,
    )
    initial_phase: float = setting(
        0.0,
        "place of the first pulse in the stride after the baseline",
        "1",
        (0.0, 1.0),
        most_excluded=True,
    )

    def __post_init__(self) -> None:
        """Check every field by itself; Protocol checks what concerns several."""
        check_settings(self)

    def period_for(self, measured_period: float) -> float:
        """
        Return the period of the pulses [s] for a measured stride period [s].

        Raises
        ------
        ProtocolError
            if successive pulses would overlap.

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

    name: str = setting("paper_example", "name of the experiment, and of its bag", plain=True)
    side: Side = setting(Side.RIGHT, "the perturbed leg: left or right")
    baseline: int = setting(15, "unperturbed strides before the pulses", within=(1, _MOST))
    pulses: PulsePlan = field(default_factory=PulsePlan)
    washout: int = setting(15, "strides after the strides of the pulses", within=(0, _MOST))
    walker: WalkerParameters = field(default_factory=WalkerParameters)
    variation: Variation = field(default_factory=Variation)  # of the simulated walker's strides
    limits: DeviceLimits = field(default_factory=DeviceLimits)  # of what the person may get
    driver: str = setting("ideal", "ankle robot driver, as entrain driver list has them")
    seed: int = setting(0, "seed of whatever is random", within=(0, 2**63 - 1))

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
        """Check every field, and what concerns more than one."""
        check_settings(self)
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


SECTIONS: dict[str, type[Any]] = {
    "pulses": PulsePlan,
    "walker": WalkerParameters,
    "variation": Variation,
    "limits": DeviceLimits,
}
# All fields of a protocol, by the names that files and messages use: "pulses.width".
FIELDS: dict[str, Setting] = settings_of(Protocol) | {
    f"{section}.{name}": rule
    for section, content in SECTIONS.items()
    for name, rule in settings_of(content).items()
}
