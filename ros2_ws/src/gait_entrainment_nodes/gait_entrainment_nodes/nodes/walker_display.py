# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
walker_display: the walker as RViz and Foxglove show it.

A separate node that only listens: it draws a simulated walk, a replayed one and a person's in the
same way, and nothing waits for it. The body is the robot description, moved by transforms. Markers
show the torque at each ankle, and the pulse while it lasts. The position of the body in the world
follows from the joint angles.

An arc at the ankle is a torque; plantarflexion is clockwise seen from the right. The inner arc is
the leg's own spring, the outer one, which starts at the tip of the inner one, the ankle robot. The
robot's arc and the ball at the ankle are red while its torque acts and grey while it does not.
"""

import math
import struct
from dataclasses import dataclass
from typing import Any

import xacro
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.settings import setting, settings_of
from gait_entrainment_msgs.msg import AnkleTorque
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.environment import PACKAGE, shared_file
from gait_entrainment_nodes.nodes.footing import Footing
from gait_entrainment_nodes.nodes.participant import Participant

WORLD = "world"  # also of the ground reactions; shared by all walkers, so without a prefix
PREFIXES = ("l_", "r_")  # of joints and frames, by side
HIP_WIDTH = 0.2  # makes both legs visible; the model has no width [m]
# Every sampled message starts with its stamp, after four bytes that name the encoding.
_STAMP = struct.Struct("<4xiI")
# Radii of the inner and outer arc, and how far outside of the leg they are drawn [m].
SPRING_RADIUS, ROBOT_RADIUS, OUTSIDE = 0.18, 0.26, 0.06
ARC_STEP = math.pi / 30  # between the points of an arc [rad]
SPRING = ColorRGBA(r=0.1, g=0.6, b=0.2, a=1.0)
ACTING = ColorRGBA(r=0.9, g=0.1, b=0.1, a=1.0)
WITHOUT_EFFECT = ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)


@dataclass(frozen=True)
class Settings:
    """Parameters of the node."""

    leg_length: float = setting(1.0, "leg length", "m", (0.1, 10.0))
    foot_length: float = setting(0.2, "foot length", "m", (0.01, 10.0))
    rate: float = setting(50.0, "pictures per second", "Hz", (10.0, 1000.0))
    torque_scale: float = setting(0.035, "angle of an arc per torque", "rad/(N m)", (0.0, 1.0))
    frame_prefix: str = setting("", "prefix of every frame except world, such as walker_1/")
    robot_state: bool = setting(
        True,
        "publish robot_description and leg transforms; false with a robot_state_publisher",
    )


class WalkerDisplay(Participant):
    """ROS side of the display."""

    settings: Settings

    def __init__(self) -> None:
        super().__init__("walker_display", settings=Settings, fixed=settings_of(Settings))
        settings = self.settings
        self._period = round(NANOSECONDS_PER_SECOND / settings.rate)
        self._footing = Footing(settings.leg_length, settings.foot_length)
        self.offer(topics.TF)
        self.offer(topics.MARKERS)
        if settings.robot_state:
            file = shared_file(PACKAGE, "urdf/sagittal_walker.urdf.xacro")
            lengths = {
                "leg_length": settings.leg_length,
                "foot_length": settings.foot_length,
                "hip_width": HIP_WIDTH,
            }
            arguments = {name: str(value) for name, value in lengths.items()}
            text = xacro.process_file(str(file), mappings=arguments).toxml()
            self.offer(topics.ROBOT_DESCRIPTION).publish(String(data=text))
        self._look_on(topics.JOINT_STATES, self._on_joint_state)
        self._look_on(topics.ANKLE_TORQUE, self._on_ankle_torque)

    def _look_on(self, topic: topics.Topic, draw: Any) -> None:
        """Draw one message of a sampled topic for each picture that is due."""
        latest = -1

        def take(data: bytes) -> None:
            # Most messages are skipped without decoding them. Pictures are counted by stamp, so
            # that body and torque are drawn for the same times.
            nonlocal latest
            seconds, nanoseconds = _STAMP.unpack_from(data)
            picture = (seconds * NANOSECONDS_PER_SECOND + nanoseconds) // self._period
            if picture != latest:
                latest = picture
                draw(deserialize_message(data, topic.type))

        self.create_subscription(topic.type, topic.name, take, topics.LOOKING_ON, raw=True)

    def _on_joint_state(self, message: JointState) -> None:
        """Move the body."""
        angles = dict(zip(message.name, message.position, strict=False))
        try:
            hips, ankles = ([angles[p + joint] for p in PREFIXES] for joint in ("hip", "ankle"))
        except KeyError:
            return  # other joints: any node may publish this topic
        if not all(map(math.isfinite, (*hips, *ankles))):
            return  # they would spoil the position in all later pictures
        x, z = self._footing.place(hips, ankles)
        places = [
            (WORLD, "base_footprint", (x, 0.0, 0.0), 0.0),
            ("base_footprint", "base_link", (0.0, 0.0, z), 0.0),
        ]
        if self.settings.robot_state:
            for side, prefix in enumerate(PREFIXES):
                hip = (0.0, (-0.5 if side else 0.5) * HIP_WIDTH, 0.0)
                ankle = (0.0, 0.0, -self.settings.leg_length)
                places += [
                    ("base_link", prefix + "leg", hip, -hips[side]),
                    (prefix + "leg", prefix + "sole", ankle, ankles[side]),
                ]
        transforms = [self._transform(message, *place) for place in places]
        self.publish(topics.TF, TFMessage(transforms=transforms))

    def _transform(
        self,
        message: JointState,
        parent: str,
        child: str,
        place: tuple[float, float, float],
        turn: float,
    ) -> TransformStamped:
        """Return the transform of a frame that is rotated about y [rad] in its parent."""
        stamped = TransformStamped(child_frame_id=self._frame(child))
        stamped.header.stamp, stamped.header.frame_id = message.header.stamp, self._frame(parent)
        x, y, z = place
        stamped.transform.translation = Vector3(x=x, y=y, z=z)
        stamped.transform.rotation = Quaternion(y=math.sin(turn / 2), w=math.cos(turn / 2))
        return stamped

    def _on_ankle_torque(self, message: AnkleTorque) -> None:
        """Draw the torque at both ankles, each in the frame of its leg."""
        markers = []
        for side in Side:
            intrinsic, delivered = message.intrinsic[side], message.delivered[side]
            color = ACTING if message.effective_perturbation[side] else WITHOUT_EFFECT
            spring = self._marker(message, side, "ankle_spring", SPRING)
            tip = self.settings.torque_scale * intrinsic
            draw_arc(spring, SPRING_RADIUS, 0.0, tip)
            robot = self._marker(message, side, "ankle_robot", color)
            draw_arc(robot, ROBOT_RADIUS, tip, tip + self.settings.torque_scale * delivered)
            pulse = self._marker(message, side, "pulse", color)
            pulse.type, pulse.scale = Marker.SPHERE, Vector3(x=0.13, y=0.13, z=0.13)
            pulse.action = Marker.ADD if delivered else Marker.DELETE
            markers += [spring, robot, pulse]
        self.publish(topics.MARKERS, MarkerArray(markers=markers))

    def _marker(self, message: AnkleTorque, side: Side, name: str, color: ColorRGBA) -> Marker:
        """Return a marker at an ankle, in the frame of its leg."""
        marker = Marker(ns=name, id=side, color=color)
        marker.header.stamp = message.header.stamp
        marker.header.frame_id = self._frame(PREFIXES[side] + "leg")
        marker.pose.position = Point(y=-OUTSIDE if side else OUTSIDE, z=-self.settings.leg_length)
        marker.pose.orientation.w = 1.0
        return marker

    def _frame(self, name: str) -> str:
        """Return the full name of a frame."""
        return name if name == WORLD else self.settings.frame_prefix + name


def draw_arc(marker: Marker, radius: float, begin: float, end: float) -> None:
    """
    Make a marker an arc with an arrowhead, or delete it if its length is zero or not finite.

    Angles [rad] are about y, from z, the direction of the leg, to x, forward.
    """
    marker.type, marker.scale.x = Marker.LINE_STRIP, 0.02
    if begin == end or not math.isfinite(end - begin):
        marker.action = Marker.DELETE
        return
    end = min(max(end, begin - math.tau), begin + math.tau)  # a full turn is more than enough

    def point(angle: float, distance: float) -> Point:
        return Point(x=distance * math.sin(angle), z=distance * math.cos(angle))

    steps = math.ceil(abs(end - begin) / ARC_STEP)
    marker.points = [point(begin + (end - begin) * i / steps, radius) for i in range(steps + 1)]
    tip, back = marker.points[-1], end - math.copysign(0.2, end - begin)
    marker.points += [point(back, 0.85 * radius), tip, point(back, 1.15 * radius)]


main = WalkerDisplay.main
