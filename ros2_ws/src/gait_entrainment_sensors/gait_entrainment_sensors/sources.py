# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Where sensor signals are: topics and message fields, live or in a bag; table columns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from gait_entrainment.errors import UsageError


@dataclass(frozen=True)
class Source:
    """One kind of sensor, on both feet."""

    type: str  # of its messages
    topics: tuple[str, str]  # [left, right], relative
    fields: Mapping[str, str]  # of the message, by signal
    column: str = ""  # part of a column name between side and signal
    joint: bool = False  # each field is a list with one joint

    def reader(self, signals: Sequence[str]) -> Callable[[Any], tuple[float, ...]]:
        """
        Return a function that reads the signals from a message.

        It raises IndexError if a message lacks a value, AttributeError if it lacks a field.
        """
        fields = [self.fields[signal] for signal in signals]
        if self.joint:
            # Without a robot there is no effort.
            return lambda message: tuple(
                getattr(message, field)[0] if field != "effort" or len(message.effort) else 0.0
                for field in fields
            )
        read: Any = attrgetter(*fields)
        return read if len(fields) > 1 else lambda message: (read(message),)


_IMU = "sensor_msgs/msg/Imu"
_MOTION = {f"gyro_{axis}": f"angular_velocity.{axis}" for axis in "xyz"} | {
    f"acceleration_{axis}": f"linear_acceleration.{axis}" for axis in "xyz"
}
FORCE = Source(
    "geometry_msgs/msg/WrenchStamped",
    ("ground_reaction/left", "ground_reaction/right"),
    {f"force_{axis}": f"wrench.force.{axis}" for axis in "xyz"},
)
SWITCH = Source(
    "gait_entrainment_msgs/msg/FootSwitch",
    ("foot_switch/left", "foot_switch/right"),
    {"heel": "heel", "toe": "toe"},
)
FOOT = Source(_IMU, ("imu/left_foot", "imu/right_foot"), _MOTION, "foot_")
SHANK = Source(_IMU, ("imu/left_shank", "imu/right_shank"), _MOTION, "shank_")
ENCODER = Source(
    "sensor_msgs/msg/JointState",
    ("ankle_encoder/left", "ankle_encoder/right"),
    {"angle": "position", "velocity": "velocity", "torque": "effort"},
    "ankle_",
    joint=True,
)


def source_of(name: str, signals: Sequence[str]) -> Source:
    """
    Return where the signals of a detector or an emulated sensor come from.

    An inertial sensor is on the foot unless ``name`` contains "shank". Raises UsageError for
    signals that no sensor's message carries together.
    """
    for source in (FORCE, SWITCH, SHANK if "shank" in name else FOOT, ENCODER):
        if set(signals) <= source.fields.keys():
            return source
    raise UsageError(f"{name}: no sensor's message carries {', '.join(signals)} together")
