# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Limits that every pulse train is checked against before a robot sees it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds
from gait_entrainment.robot.faults import LimitError
from gait_entrainment.robot.pulse_train import Pulse, PulseTrain, Shape
from gait_entrainment.settings import Checked, setting

_NO_LIMIT = 1_000_000


@dataclass
class Dose:
    """What a person has received so far."""

    pulses: int = 0
    impulse: float = 0.0  # magnitude of the delivered angular impulse [N m s]


@dataclass(frozen=True)
class PlannedPulses(Checked):
    """Bounds on the pulses of the protocol under way; requests for more are refused."""

    torque: float = setting(200.0, "magnitude of the protocol's pulses", "N m", (0.0, 200.0))
    duration: float = setting(10.0, "duration of the protocol's pulses", "s", (0.0, 10.0))
    count: int = setting(_NO_LIMIT, "number of the protocol's pulses", "1", (0, _NO_LIMIT))

    def check(self, train: PulseTrain, before: int) -> None:
        """Raise LimitError if a train, after ``before`` pulses, goes beyond the protocol."""
        requested = {
            "torque": max((abs(pulse.torque) for pulse in train.pulses), default=0.0),
            "duration": max((pulse.duration for pulse in train.pulses), default=0.0),
            "count": before + len(train.pulses),
        }
        for name, value in requested.items():
            if not value <= (most := getattr(self, name)):
                raise LimitError(
                    f"{name}: {value:g} exceeds the protocol's pulses; allowed: at most {most:g}"
                )


@dataclass(frozen=True)
class DeviceLimits(Checked):
    """
    What may be requested of an ankle robot, and when silence counts as a fault.

    The default torque lies above the 13.3 N m of the paper's pulse and near the 23 N m of the
    MIT Anklebot; it is a limit for the wearer, whatever the motor could do. The default impulse
    is that of one pulse at the default torque and duration.
    """

    torque: float = setting(30.0, "largest magnitude of a pulse", "N m", (0.0, 200.0))
    duration: float = setting(0.5, "longest duration of a pulse", "s", (0.001, 10.0))
    rate: float = setting(
        0.0, "steepest flank; square pulses get this slope; 0: no limit", "N m/s", (0.0, 1e6)
    )
    impulse: float = setting(15.0, "largest angular impulse within a stride", "N m s", (0.0, 1e3))
    rising: int = setting(
        0, "number of pulses after a pause that rise in equal steps to full height", "1", (0, 1000)
    )
    pulses_per_minute: float = setting(
        600.0, "most pulses per minute, by the interval between two", "1/min", (1.0, 6000.0)
    )
    session_pulses: int = setting(
        _NO_LIMIT, "most pulses since the node was started", "1", (0, _NO_LIMIT)
    )
    session_impulse: float = setting(
        1e6, "largest total angular impulse since the node was started", "N m s", (0.0, 1e6)
    )
    arming: float = setting(
        1800.0, "time after arming during which a train is accepted", "s", (1.0, 86_400.0)
    )
    stride: float = setting(
        1.0, "time that counts as a stride: at most the wearer's shortest", "s", (0.1, 10.0)
    )
    duty: float = setting(0.9, "largest fraction of the time with torque", "1", (0.0, 1.0))
    overshoot: float = setting(
        0.2, "fraction by which delivered torque and impulse may exceed limits", "1", (0.0, 1.0)
    )
    silence: float = setting(
        1.0, "longest silence of the experiment under torque, in real time", "s", (0.05, 60.0)
    )

    def check_pulse(self, pulse: Pulse) -> None:
        """
        Raise LimitError if a pulse must not be delivered, whatever its onset.

        A protocol can be checked with this before anything is measured or moves.
        """
        torque, duration = pulse.torque, pulse.duration
        if not math.isfinite(torque) or abs(torque) > self.torque:
            raise LimitError(
                f"torque: {torque:g} N m is outside the limit of the device; "
                f"allowed: -{self.torque:g} to {self.torque:g} N m"
            )
        if not 0 < duration <= self.duration:
            raise LimitError(
                f"width: {duration:g} s is outside the limit of the device; "
                f"allowed: above 0 and at most {self.duration:g} s"
            )
        pulse.check()
        self._check_impulse(pulse.impulse)
        if not self.rate:
            return
        if pulse.shape is Shape.SQUARE and 2 * abs(torque) / self.rate > duration:
            raise LimitError(
                f"rate: a pulse of {duration:g} s does not reach {torque:g} N m at "
                f"{self.rate:g} N m/s; allowed: a wider or lower pulse, or a higher limits.rate"
            )
        if pulse.shape is not Shape.SQUARE and pulse.steepest > self.rate * (1 + 1e-9):
            raise LimitError(
                f"rate: {pulse.steepest:.4g} N m/s on a flank; allowed: at most {self.rate:g}"
            )

    def check(self, train: PulseTrain, before: Sequence[Pulse] = ()) -> None:
        """Raise LimitError if a train must not be delivered after the pulses ``before`` it."""
        if not 0 < (count := len(train.pulses)) <= 10_000:  # checking more takes too long
            raise LimitError(f"count: {count}; allowed: 1 to 10000 at a time")
        for shape in {replace(pulse, onset=0) for pulse in train.pulses}:
            self.check_pulse(shape)
        for pulse, later in pairwise([*before[-1:], *train.pulses]):
            self._check_interval(pulse, later)
        window = nanoseconds(self.stride)
        first = train.onsets[0] - window
        spans = [
            (pulse.onset, pulse.end, abs(pulse.torque), pulse.impulse)
            for pulse in [*before, *train.pulses]
            if pulse.end > first
        ]
        # The largest impulse is in a window that begins or ends with a pulse.
        mirrored = [(-end, -begin, *height) for begin, end, *height in reversed(spans)]
        self._check_impulse(max(_largest(spans, window), _largest(mirrored, window)))

    def _check_interval(self, pulse: Pulse, later: Pulse) -> None:
        """Raise LimitError if a pulse comes too soon after the one before it."""
        interval = (later.onset - pulse.onset) / NANOSECONDS_PER_SECOND
        if later.onset <= pulse.end:
            raise LimitError(
                f"period: {interval:g} s makes pulses of {pulse.duration:g} s overlap; "
                "allowed: longer than a pulse"
            )
        if pulse.duration > self.duty * interval:
            raise LimitError(
                f"duty: {pulse.duration / interval:.3g} of the time with torque; "
                f"allowed: at most {self.duty:g}"
            )
        # Onsets are rounded to a nanosecond.
        if (interval + 1e-9) * self.pulses_per_minute < 60 * (1 - 1e-9):
            raise LimitError(
                f"period: {interval:g} s; allowed: at least "
                f"{60 / self.pulses_per_minute:g} s ({self.pulses_per_minute:g} pulses a minute)"
            )

    def check_dose(self, dose: Dose, coming: Sequence[Pulse]) -> None:
        """Raise LimitError if pulses to come would take the dose beyond the session's limits."""
        totals = {
            "session_pulses": dose.pulses + len(coming),
            "session_impulse": dose.impulse + sum(pulse.impulse for pulse in coming),
        }
        for name, value in totals.items():
            if value > (most := getattr(self, name)):
                raise LimitError(f"{name}: {value:.6g} in all; allowed: at most {most:g}")

    def softened(self, train: PulseTrain, begun: int = 0) -> PulseTrain:
        """
        Return a checked train with flanks no steeper than the limit and rising first pulses.

        ``begun`` is the number of pulses before it without a pause.
        """
        pulses = []
        for number, pulse in enumerate(train.pulses, begun + 1):
            torque = pulse.torque * min(number / (self.rising + 1), 1.0)
            soft = replace(pulse, torque=torque)
            if pulse.shape is Shape.SQUARE and self.rate and pulse.torque:
                flank = abs(pulse.torque) / self.rate
                soft = replace(soft, shape=Shape.TRAPEZOID, rise=flank, fall=flank)
            pulses.append(soft)
        return PulseTrain(train.side, tuple(pulses))

    def _check_impulse(self, impulse: float) -> None:
        if impulse > self.impulse:
            raise LimitError(
                f"impulse: {impulse:.4g} N m s within {self.stride:g} s is outside the limit of "
                f"the device; allowed: at most {self.impulse:g} N m s"
            )


def _largest(spans: Sequence[Any], window: int) -> float:
    """Return the largest impulse [N m s] in a window [ns] that begins with one of the spans."""
    largest = 0.0
    for number, (begin, *_) in enumerate(spans):
        inside = 0.0
        for onset, _, torque, impulse in spans[number:]:
            left = (begin + window - onset) / NANOSECONDS_PER_SECOND
            if left <= 0:
                break
            inside += min(impulse, torque * left)
        largest = max(largest, inside)
    return largest
