# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Between the messages of sensors and the values that detectors take: which topic, which field."""

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from gait_entrainment.conventions import Side
from gait_entrainment.errors import UsageError
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate
from gait_entrainment_nodes.messaging.topics import Topic


class Source(NamedTuple):
    """Topics [left, right] of one kind of sensor, and the field of the message for each signal."""

    topics: tuple[Topic, ...]
    fields: Mapping[str, str]


_RATES = {f"gyro_{axis}": f"angular_velocity.{axis}" for axis in "xyz"}
_ACCELERATIONS = {f"acceleration_{axis}": f"linear_acceleration.{axis}" for axis in "xyz"}
FORCE = Source(topics.GROUND_REACTION, {f"force_{axis}": f"wrench.force.{axis}" for axis in "xyz"})
SWITCH = Source(topics.FOOT_SWITCH, {"heel": "heel", "toe": "toe"})
FOOT = Source(topics.FOOT_IMU, _RATES | _ACCELERATIONS)
SHANK = Source(topics.SHANK_IMU, _RATES | _ACCELERATIONS)
ENCODER = Source(
    topics.ANKLE_ENCODER, {"angle": "position", "velocity": "velocity", "torque": "effort"}
)


def source_of(name: str, signals: Sequence[str]) -> Source:
    """
    Return where the signals of a detector or an emulated sensor come from.

    An inertial sensor is on the foot unless ``name`` says that it is on the shank. Raises
    UsageError for signals that no message of a sensor carries together.
    """
    for source in (FORCE, SWITCH, SHANK if "shank" in name else FOOT, ENCODER):
        if set(signals) <= source.fields.keys():
            return source
    raise UsageError(f"{name}: no sensor's message carries {', '.join(signals)} together")


def reader_of(source: Source, signals: Sequence[str]) -> Callable[[Any], tuple[float, ...]]:
    """Return what reads the signals from a message; IndexError if one has no such value."""
    if source is ENCODER:  # one joint
        return lambda message: tuple(
            getattr(message, source.fields[signal])[0] for signal in signals
        )
    fields = [source.fields[signal] for signal in signals]
    read: Any = attrgetter(*fields)
    return read if len(fields) > 1 else lambda message: (read(message),)


class SensorWriter:
    """Makes the messages of an emulated sensor, as bytes: many at once."""

    def __init__(self, source: Source, side: Side, signals: Sequence[str]) -> None:
        frame = {"left": "l", "right": "r"}[side.name.lower()] + (
            "_leg" if source is SHANK else "_sole"
        )
        self._switch = source is SWITCH

        def message(**values: Any) -> Any:
            made = source.topics[side].type(**values)
            made.header.frame_id = frame
            return made

        if source is SWITCH:
            self._templates = {
                (heel, toe): MessageTemplate(message(heel=heel, toe=toe), {})
                for heel in (False, True)
                for toe in (False, True)
            }
        else:
            joint = {"name": [frame[0] + "_ankle"]} if source is ENCODER else {}
            made = message(**joint)
            if source in (FOOT, SHANK):  # REP 145: not measured
                made.orientation_covariance[0] = made.linear_acceleration_covariance[0] = -1.0
            fields = {source.fields[signal]: 1 for signal in signals}
            self._template = MessageTemplate(made, fields)

    def write(self, samples: Sequence[tuple[int, tuple[float, ...]]]) -> list[bytes]:
        """Return one serialized message for each (stamp [ns], values)."""
        if not samples:
            return []
        if self._switch:
            return [
                self._templates[bool(values[0]), bool(values[1])].fill(np.array([stamp]))[0]
                for stamp, values in samples
            ]
        stamps = np.array([stamp for stamp, _ in samples], np.int64)
        columns = np.array([values for _, values in samples], float).T[..., None]
        return self._template.fill(stamps, *columns)
