# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One block of a protocol: baseline strides, pulses, washout strides, and a rest.

The defaults are the example of Ahn and Hogan (2012): pulses of 0.1 s at a tenth of the peak ankle
torque, with a period 50 ms below the walker's own stride period.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side, nanoseconds
from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.robot import LimitError, Pulse, Shape
from gait_entrainment.settings import Checked, setting

# A million strides are three weeks of walking: no run is longer.
_MOST = 1_000_000
# A pulse at a smaller phase leaves the robot too little time after its strike: it is requested at
# the strike before.
_EARLY_PHASE = 0.05
# Alternatives, of which exactly one is given.
HEIGHTS = ("torque", "torque_fraction")
TIMINGS = ("period", "period_offset", "period_ratio", "phase")


class ProtocolError(UsageError):
    """A protocol that cannot be conducted; the message gives place, field and what is allowed."""


def _either(unit: str, meaning: str, default: Any = None, **more: Any) -> Any:
    return setting(default, meaning, unit, kind=float, optional=True, **more)


@dataclass(frozen=True)
class PulsePlan(Checked):
    """
    The pulses of a block.

    Exactly one of ``torque`` and ``torque_fraction``, and one of ``period``, ``period_offset``,
    ``period_ratio`` and ``phase``, is given; the others are None.
    """

    count: int = setting(50, "number of pulses; 0 for none", within=(0, _MOST))
    # A pulse shorter than a nanosecond has no stamps.
    width: float = setting(0.1, "duration of a pulse", "s", (1e-9, 10.0))
    torque: float | None = _either("N m", "height of the pulses, plantarflexion positive")
    torque_fraction: float | None = _either(
        "1", "height as a fraction of the peak ankle torque", 0.1, within=(-1.0, 1.0)
    )
    # Until the stride period is measured, the experiment proceeds by at most a pulse period.
    period: float | None = _either(
        "s", "pulse period, from onset to onset, instead of an offset", within=(1e-3, 100.0)
    )
    period_offset: float | None = _either(
        "s", "pulse period minus the stride period of the baseline", -0.05, within=(-100.0, 100.0)
    )
    initial_phase: float = setting(
        0.0,
        "position of the first pulse in the stride after the baseline",
        "1",
        (0.0, 1.0),
        most_excluded=True,
    )
    period_ratio: float | None = _either(
        "1", "pulse period divided by the stride period of the baseline", within=(0.01, 100.0)
    )
    phase: float | None = _either(
        "1",
        "position of each pulse in its own stride, whose length is predicted",
        within=(0.0, 1.0),
        most_excluded=True,
    )
    sweep: float = setting(0.0, "linear change of the period up to the last pulse", "s", (-10, 10))
    jitter: float = setting(0.0, "most that an onset deviates from its period", "s", (0.0, 10.0))
    shape: Shape = setting(Shape.SQUARE, "square, half_sine, trapezoid or samples")
    rise: float = setting(0.0, "duration of a trapezoid's first flank", "s", (0.0, 10.0))
    fall: float = setting(0.0, "duration of a trapezoid's second flank", "s", (0.0, 10.0))
    samples: str = setting("", "fractions of the torque, onset to end, such as [0, 0.4, 1, 0]")
    rising: int = setting(0, "number of first pulses that rise in equal steps", "1", (0, _MOST))
    catch_share: float = setting(0.0, "fraction of the pulses that are left out", "1", (0.0, 1.0))
    catch_pulses: str = setting("", "numbers of the pulses that are left out, such as [5, 12]")

    @property
    def after_strike(self) -> float:
        """Predicted strides from the strike at which a pulse by phase is planned to its onset."""
        phase = self.phase or 0.0
        return phase + 1 if phase < _EARLY_PHASE else phase

    def period_for(self, measured_period: float) -> float:
        """
        Return the first period of the pulses [s] for a measured stride period [s].

        Raises ProtocolError if successive pulses would overlap.
        """
        period = self.period
        if period is None:
            period = measured_period * (self.period_ratio or 1.0) + (self.period_offset or 0.0)
        # Successive onsets are at least the whole nanoseconds of a period apart.
        least = min(period, period + self.sweep) - 2 * self.jitter
        if not least * NANOSECONDS_PER_SECOND >= nanoseconds(self.width) + 1:
            name = "jitter" if self.jitter else "sweep" if self.sweep < 0 else "width"
            raise ProtocolError(
                f"pulses.{name}: {getattr(self, name):g} s makes the pulses overlap, at intervals "
                f"down to {least:.6g} s; allowed: intervals above the width of {self.width:g} s"
            )
        return period

    def onsets(self, first: int, period: float, seed: tuple[int, int]) -> list[int]:
        """
        Return the onsets [ns], and one more, from the first onset [ns] and the first period [s].

        The period changes by the same amount from pulse to pulse, and by ``sweep`` from the first
        to the last. Jitter is uniform and does not accumulate.
        """
        n, change = np.arange(self.count + 1), self.sweep / max(self.count - 2, 1) / 2
        late = np.zeros(n.size)
        if self.jitter:
            late = np.random.default_rng((*seed, 0)).uniform(-self.jitter, self.jitter, n.size)
            late -= late[0]
        places = np.rint((n * period + n * (n - 1) * change + late) * NANOSECONDS_PER_SECOND)
        return [first + place for place in places.astype(np.int64).tolist()]

    def pulse(self, onset: int, torque: float) -> Pulse:
        """Return a pulse of this shape with an onset [ns] and a torque [N m]."""
        shares = tuple(_numbers("samples", self.samples, float))
        return Pulse(onset, torque, self.width, self.shape, self.rise, self.fall, shares)

    def heights(self, torque: float, seed: tuple[int, int]) -> list[float]:
        """Return the torque of each pulse [N m]: the first ones rise, catch pulses have none."""
        left_out = set(_numbers("catch_pulses", self.catch_pulses, int))
        if self.catch_share:
            random, chosen = np.random.default_rng((*seed, 1)), self.catch_share * self.count
            left_out |= set(random.choice(self.count, round(chosen), replace=False) + 1)
        steps = np.minimum(np.arange(1, self.count + 1) / (self.rising + 1), 1.0)
        steps[[number - 1 for number in left_out]] = 0.0
        return list((torque * steps).tolist())

    def check(self) -> None:
        """Raise ProtocolError for values that do not go together."""
        for group in (HEIGHTS, TIMINGS):
            if sum(getattr(self, name) is not None for name in group) != 1:
                raise ProtocolError(f"pulses: give either {' or '.join(group)}")
        shape = self.shape
        for other, names, reason in (
            (self.phase is not None, ("sweep", "jitter", "initial_phase"), "phase"),
            (shape is not Shape.TRAPEZOID, ("rise", "fall"), f"shape {shape.name.lower()}"),
            (shape is not Shape.SAMPLES, ("samples",), f"shape {shape.name.lower()}"),
            (self.catch_share > 0, ("catch_pulses",), "catch_share"),
        ):
            if wrong := [name for name in names if other and getattr(self, name)]:
                raise ProtocolError(f"pulses.{wrong[0]}: does not go with {reason}")
        for number in _numbers("catch_pulses", self.catch_pulses, int):
            if not 1 <= number <= self.count:
                raise ProtocolError(
                    f"pulses.catch_pulses: {number}; allowed: from 1 to {self.count}"
                )
        try:
            self.pulse(0, 0.0).check()
        except LimitError as error:
            raise ProtocolError(f"pulses.{error}") from None
        if self.period is not None:
            self.period_for(0.0)


def _numbers(name: str, text: str, kind: Any) -> list[Any]:
    """Return the numbers in a text such as "0, 0.4, 1, 0"."""
    try:
        return [kind(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise ProtocolError(
            f"pulses.{name}: {text!r}; allowed: numbers separated by commas"
        ) from None


@dataclass(frozen=True)
class Block(Checked):
    """
    Baseline, pulses and washout, conducted one after the other.

    Baseline and washout last at least the given number of strides and, if requested, until a time
    has passed and the strides are steady.
    """

    name: str = setting("block", "name of the block", plain=True)
    baseline: int = setting(15, "unperturbed strides before the pulses", within=(1, _MOST))
    pulses: PulsePlan = field(default_factory=PulsePlan)
    washout: int = setting(15, "strides after those of the pulses", within=(0, _MOST))
    baseline_time: float = setting(0.0, "shortest duration of the baseline", "s", (0.0, 86_400.0))
    washout_time: float = setting(0.0, "shortest duration of the washout", "s", (0.0, 86_400.0))
    baseline_steady: float = setting(
        0.0,
        "coefficient of variation of the last strides below which the baseline ends; 0: any",
        "1",
        (0.0, 1.0),
    )
    washout_steady: float = setting(0.0, "as baseline_steady, for the washout", "1", (0.0, 1.0))
    rest: float = setting(0.0, "pause before the next block, walked or not", "s", (0.0, 86_400.0))
    side: Side | None = setting(None, "the perturbed leg: left or right", kind=Side, optional=True)
    both_legs: bool = setting(False, "whether the other leg also gets pulses, in between")

    def __post_init__(self) -> None:
        """Check every field, and fields that depend on each other."""
        super().__post_init__()
        plan = self.pulses
        plan.check()
        measured = plan.period is None and plan.count > 0
        least = 3 if plan.phase is not None else 2
        if measured and self.baseline < least:
            raise ProtocolError(
                f"baseline: {self.baseline} leaves no complete stride to measure period_offset "
                f"from; allowed: at least {least}, or at least 1 with an absolute period"
            )

    @property
    def open_baseline(self) -> bool:
        """Whether the baseline waits for more than a number of strides."""
        return self.baseline_time > 0 or self.baseline_steady > 0

    @property
    def open_ended(self) -> bool:
        """Whether its number of strides is unknown beforehand."""
        return self.open_baseline or self.washout_time > 0 or self.washout_steady > 0

    def torque(self, walker: WalkerParameters) -> float:
        """Return the height of the pulses [N m], plantarflexion positive."""
        torque, fraction = self.pulses.torque, self.pulses.torque_fraction
        return (fraction or 0.0) * walker.peak_torque if torque is None else torque
