# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Conversion between decoded ROS messages and the values of the core, without ROS.

Only attributes of a message are read, so it does not matter which library decoded it: rclpy in a
node, mcap_ros2 from a bag. The field names are those of gait_entrainment_msgs. Message stamps
count from 1970, the core's times from an origin that the caller chooses: each function subtracts
``start`` [ns].
"""

import math
from dataclasses import fields
from enum import IntEnum
from typing import Any, TypeVar

from gait_entrainment.conventions import EventKind, Side, nanoseconds_of
from gait_entrainment.errors import UsageError
from gait_entrainment.gait import GaitEvent, PulsePhase, Stride
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.robot import Pulse, PulseTrain, RobotState, Shape, TorqueProfile

_E = TypeVar("_E", bound=IntEnum)


class MessageError(UsageError):
    """A message that makes no sense, such as one about a third leg."""


def side_of(message: Any) -> Side:
    """Return the side of a message about one leg; raises MessageError for an unknown side."""
    return _member(Side, "side", message.side)


def event_of(message: Any, start: int = 0) -> GaitEvent:
    """Return the event of a GaitEvent message; raises MessageError for an unknown kind or side."""
    stamp = nanoseconds_of(message.header.stamp) - start
    kind = _member(EventKind, "kind", message.kind)
    uncertainty = getattr(message, "uncertainty", 0.0)  # missing in bags of earlier versions
    return GaitEvent(stamp, kind, side_of(message), int(message.step), uncertainty)


def stop_of(message: Any, start: int = 0) -> int | None:
    """
    Return the time [ns] of the stop that a TorqueProfile message reports, if it reports one.

    From that time on there is no torque, and the promises of all earlier profiles are void.
    """
    return nanoseconds_of(message.header.stamp) - start if message.stop else None


def profile_of(message: Any, start: int = 0) -> TorqueProfile:
    """
    Return the torque profile of a TorqueProfile message that reports no stop.

    Raises MessageError for an unknown side or an invalid profile.
    """
    profile = TorqueProfile(
        side=side_of(message),
        times=tuple(nanoseconds_of(stamp) - start for stamp in message.times),
        torques=tuple(message.torques),
        onsets=tuple(nanoseconds_of(stamp) - start for stamp in message.onsets),
        valid_until=nanoseconds_of(message.valid_until) - start,
    )
    try:
        profile.check(profile.times[0] if profile.times else 0)
    except ValueError as error:
        raise MessageError(str(error)) from None
    return profile


def pulse_of(message: Any, start: int = 0) -> tuple[int, float, float]:
    """Return a TorquePulse message's onset [ns], height [N m], width [s]; or MessageError."""
    height, width = message.torque, message.duration
    if not (math.isfinite(height) and 0 <= width < 1000):  # no protocol allows even 1 %
        raise MessageError(f"torque, duration: {height:g} N m for {width:g} s is implausible")
    return nanoseconds_of(message.header.stamp) - start, height, width


class ProfileOrder:
    """
    Checks each torque profile of an ankle against the previous one, which by contract it adjoins.

    Times are in ns since 1970. After a stop, and once the run is over, no profile is due.
    """

    def __init__(self) -> None:
        self._due_from: float | None = None  # when the next one begins; None before the first
        self._revision = -1

    def take(
        self, message: Any
    ) -> tuple[int | None, tuple[int, int] | None, TorqueProfile | None]:
        """
        Take a TorqueProfile message; raises MessageError if it is invalid.

        Returns the time from which earlier promises are void, the span whose profile is missing,
        and the profile, each None if there is none.
        """
        stop = stop_of(message)
        if stop is not None:
            self._due_from = math.inf
            return stop, None, None
        profile, due = profile_of(message), self._due_from
        begin, step = profile.times[0], message.revision - self._revision
        if due is None:
            due = 0 if message.revision else begin
        hole = (int(due), begin) if begin > due else None
        void = begin if begin < due < math.inf else None
        if (hole and step == 1) or (void is not None and step < 1):
            raise MessageError(f"revision {message.revision}: does not adjoin {self._revision}")
        self._revision = message.revision
        self._due_from = math.inf if message.last else profile.valid_until
        return void, hole, profile

    def hole_up_to(self, instant: int) -> tuple[int, int] | None:
        """Return the span that no profile covers before an instant, the record's latest time."""
        due = self._due_from or 0
        return (int(due), instant) if instant > due else None


def train_of(message: Any, start: int = 0) -> PulseTrain:
    """Return the pulses of a goal; raises MessageError for an unknown side or shape."""
    pulses = (
        Pulse(
            onset=nanoseconds_of(pulse.onset) - start,
            torque=pulse.torque,
            duration=pulse.duration,
            shape=_member(Shape, "shape", pulse.shape),
            rise=pulse.rise,
            fall=pulse.fall,
            samples=tuple(pulse.samples),
        )
        for pulse in message.pulses
    )
    return PulseTrain(side_of(message), tuple(pulses))


def state_of(message: Any, start: int = 0) -> RobotState:
    """Return the state of an AnkleRobotState message, without the faults, which it only names."""
    return RobotState(
        stamp=nanoseconds_of(message.header.stamp) - start,
        commanded=message.commanded_torque,
        measured=message.measured_torque,
        angle=message.angle,
    )


def result_values(result: Result, side: Side) -> dict[str, Any]:
    """
    Return the fields of the message that publishes a result about the perturbed leg.

    Times are integer nanoseconds, ``header`` is its stamp; the field ``run`` is left out.
    """
    if isinstance(result, Stride):
        return {
            "header": result.end,
            "side": result.side,
            "number": result.number,
            "start": result.start,
            "period": result.period,
            "step_periods": result.step_periods,
        }
    # A message has the fields of the result, under the same names, except for these.
    own = {"onset", "stamp"}
    values = {f.name: getattr(result, f.name) for f in fields(result) if f.name not in own}
    values["side"] = side
    if isinstance(result, PulsePhase):
        return values | {"header": result.onset, "toe_off": result.toe_off or 0}
    since = result.entrained_since_stride or 0
    return values | {"header": result.stamp, "entrained_since_stride": since}


def _member(enumeration: type[_E], field: str, value: int) -> _E:
    try:
        return enumeration(value)
    except ValueError:
        allowed = ", ".join(f"{member.value} ({member.name.lower()})" for member in enumeration)
        raise MessageError(f"{field}: {value}; allowed: {allowed}") from None
