# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Every topic of the testbed: its name, type and quality of service, in one table.

Names are relative, so a namespace or a remapping moves a whole experiment; only names that other
tools expect at the root are absolute, and the launch files move them into the experiment's
namespace. Topics that a run depends on or is judged by are reliable and keep all messages, on both
ends, so nothing is lost without an error; topics that show the current state are transient local.
"""

from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from gait_entrainment_bags import topic_names
from gait_entrainment_msgs import msg
from gait_entrainment_nodes.messaging.raw_messages import message_class
from gait_entrainment_sensors import sources
from gait_entrainment_sensors.sources import Source


def quality(
    depth: int | None = None, *, reliable: bool = True, lasting: bool = False
) -> QoSProfile:
    """
    Return a quality of service.

    It keeps ``depth`` messages, or all; ``reliable`` ones are repeated until they arrive, and
    ``lasting`` ones also reach late joiners.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if depth is None else HistoryPolicy.KEEP_LAST,
        depth=depth or 0,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if lasting else DurabilityPolicy.VOLATILE,
    )


# Nothing may be lost: a writer waits for its slowest reader instead of overwriting.
EVERY_MESSAGE = quality()
# In real time no writer waits: a reader that is further behind than this, 2 s of samples at 1 kHz,
# loses messages, and the recorder detects the loss by the counts.
EVERY_MESSAGE_IN_REAL_TIME = quality(2048)
# The latest state matters, also to late joiners. The writer keeps more than that, so that a
# recorder that is briefly behind misses nothing.
LATEST_STATE = quality(1000, lasting=True)
# What people look at, with the quality that tools expect: rqt for /diagnostics, tf2 and RViz for
# the display. No writer waits for a viewer.
VIEWED = quality(100)
# What was sent before a reader joined counts too: a description, a button that was pressed.
SAID_ONCE = quality(1, lasting=True)
# How a stop button is heard, whatever quality it offers: everything, also what was sent before.
# With a depth of 1 a release, even of another button, would take the place of a press.
FROM_A_BUTTON = quality(lasting=True), quality(reliable=False)
# For onlookers, for which the writer never waits. It holds a stretch of a lock-step run.
LOOKING_ON = quality(1000, reliable=False)
# What a sensor's driver sends, whatever quality it offers: 2 s of a force plate.
FROM_A_DRIVER = quality(2048, reliable=False)
# Signs of life, for which nothing waits. Several senders share the topic, and the reader's depth.
HEARTBEAT = quality(100, reliable=False)


class Topic(NamedTuple):
    """One topic: relative name, message type, quality of service of both ends."""

    name: str
    type: Any
    qos: QoSProfile = EVERY_MESSAGE


def sensor_topics(source: Source) -> tuple[Topic, ...]:
    """Return the topics of a kind of sensor, [left, right]."""
    return tuple(Topic(name, message_class(source.type)) for name in source.topics)


JOINT_STATES = Topic(topic_names.JOINT_STATES, JointState)
GAIT_EVENTS = Topic(topic_names.GAIT_EVENTS, msg.GaitEvent)
ANKLE_TORQUE = Topic(topic_names.ANKLE_TORQUE, msg.AnkleTorque)
GROUND_REACTION = sensor_topics(sources.FORCE)
WALKER_PROGRESS = Topic(topic_names.WALKER_PROGRESS, msg.Progress)
WALKER_TIMING = Topic(topic_names.WALKER_TIMING, msg.WalkerTiming)
CLOCK = Topic(topic_names.CLOCK, ClockMessage)

TRUE_EVENTS = Topic(topic_names.TRUE_EVENTS, msg.GaitEvent)
TRUE_PROGRESS = Topic(topic_names.TRUE_PROGRESS, msg.Progress)

TORQUE_PROFILE = Topic(topic_names.TORQUE_PROFILE, msg.TorqueProfile)
PULSES = Topic(topic_names.PULSES, msg.TorquePulse)
ROBOT_STATE = Topic(topic_names.ROBOT_STATE, msg.AnkleRobotState)
ROBOT_SETUP = Topic(topic_names.ROBOT_SETUP, msg.AnkleRobotSetup, LATEST_STATE)
TROUBLE = Topic(topic_names.TROUBLE, msg.Trouble)
EMERGENCY_STOP = Topic(topic_names.EMERGENCY_STOP, Bool, SAID_ONCE)

OPERATOR_HEARTBEAT = Topic(topic_names.OPERATOR_HEARTBEAT, String, HEARTBEAT)
# Not lasting: a page outlives runs, and the next recorder must not get the notes of the last one.
OPERATOR_NOTES = Topic(topic_names.OPERATOR_NOTES, msg.Note, VIEWED)

HORIZON = Topic(topic_names.HORIZON, msg.Horizon)
EXPERIMENT_STATE = Topic(topic_names.EXPERIMENT_STATE, msg.ExperimentState, LATEST_STATE)

STRIDES = Topic(topic_names.STRIDES, msg.Stride)
PULSE_PHASES = Topic(topic_names.PULSE_PHASES, msg.PulsePhase)
ENTRAINMENT = Topic(topic_names.ENTRAINMENT, msg.Entrainment, LATEST_STATE)

RECORDER_PROGRESS = Topic(topic_names.RECORDER_PROGRESS, msg.Progress)
PUBLISHED_COUNTS = Topic(topic_names.PUBLISHED_COUNTS, msg.PublishedCounts)
DIAGNOSTICS = Topic(topic_names.DIAGNOSTICS, DiagnosticArray, VIEWED)

# tf2 has one topic for a whole system; instances differ in their frames.
TF = Topic(topic_names.TF, TFMessage, VIEWED)
ROBOT_DESCRIPTION = Topic(topic_names.ROBOT_DESCRIPTION, String, SAID_ONCE)
MARKERS = Topic(topic_names.MARKERS, MarkerArray, VIEWED)
