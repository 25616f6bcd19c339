# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Every topic of the testbed: its name, type and quality of service, in one table.

Names are relative, so that a namespace or a remapping moves a whole experiment; but for those that
others expect at the root, which the launch files move into the namespace of an experiment. Quality
of service: what a run depends on or is judged by is reliable and keeps all, on both ends, so that
nothing is lost without an error; what tells a late-comer how things stand is transient local.
"""

from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Empty, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from gait_entrainment import topic_names
from gait_entrainment_msgs import msg

# Nothing may be lost: a writer waits for its slowest reader instead of overwriting.
EVERY_MESSAGE = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE, depth=0
)
# In real time nobody is waited for: what a reader has not taken for so many messages, 2 s of
# samples at 1 kHz, is lost to it, and the recorder tells a loss by the counts.
EVERY_MESSAGE_IN_REAL_TIME = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE, depth=2_048
)
# The latest state matters, also to who joins late. The writer keeps more than that, so that a
# recorder which is briefly behind misses nothing.
LATEST_STATE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# What rqt and the aggregator expect of /diagnostics.
DIAGNOSTICS_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.RELIABLE
)
# What tf2, robot_state_publisher and RViz expect of what is drawn. Nobody waits for a viewer.
DRAWING = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.RELIABLE
)
LATEST_DESCRIPTION = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# For who only looks on: the writer never waits for it. It holds a stretch of a lock-step run.
LOOKING_ON = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT
)


# A button that was pressed before somebody joined counts too.
LATCHED_STATE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Only the latest sign of life counts, and nobody waits for anybody.
HEARTBEAT = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)


class Topic(NamedTuple):
    """One topic: relative name, message type, quality of service of both ends."""

    name: str
    type: Any
    qos: QoSProfile = EVERY_MESSAGE


JOINT_STATES = Topic(topic_names.JOINT_STATES, JointState)
GAIT_EVENTS = Topic(topic_names.GAIT_EVENTS, msg.GaitEvent)
ANKLE_TORQUE = Topic(topic_names.ANKLE_TORQUE, msg.AnkleTorque)
GROUND_REACTION = tuple(Topic(name, WrenchStamped) for name in topic_names.GROUND_REACTION)
WALKER_PROGRESS = Topic(topic_names.WALKER_PROGRESS, msg.Progress)
WALKER_TIMING = Topic(topic_names.WALKER_TIMING, msg.WalkerTiming)
CLOCK = Topic(topic_names.CLOCK, ClockMessage)

TORQUE_PROFILE = Topic(topic_names.TORQUE_PROFILE, msg.TorqueProfile)
PULSES = Topic(topic_names.PULSES, msg.TorquePulse)
ROBOT_STATE = Topic(topic_names.ROBOT_STATE, msg.AnkleRobotState)
ROBOT_SETUP = Topic(topic_names.ROBOT_SETUP, msg.AnkleRobotSetup, LATEST_STATE)
TROUBLE = Topic(topic_names.TROUBLE, msg.Trouble)
EMERGENCY_STOP = Topic(topic_names.EMERGENCY_STOP, Bool, LATCHED_STATE)

OPERATOR_HEARTBEAT = Topic(topic_names.OPERATOR_HEARTBEAT, Empty, HEARTBEAT)

HORIZON = Topic(topic_names.HORIZON, msg.Horizon)
EXPERIMENT_STATE = Topic(topic_names.EXPERIMENT_STATE, msg.ExperimentState, LATEST_STATE)

STRIDES = Topic(topic_names.STRIDES, msg.Stride)
PULSE_PHASES = Topic(topic_names.PULSE_PHASES, msg.PulsePhase)
ENTRAINMENT = Topic(topic_names.ENTRAINMENT, msg.Entrainment, LATEST_STATE)

RECORDER_PROGRESS = Topic(topic_names.RECORDER_PROGRESS, msg.Progress)
PUBLISHED_COUNTS = Topic(topic_names.PUBLISHED_COUNTS, msg.PublishedCounts)
DIAGNOSTICS = Topic(topic_names.DIAGNOSTICS, DiagnosticArray, DIAGNOSTICS_QOS)

# tf2 has one topic for a whole system; instances differ in their frames.
TF = Topic(topic_names.TF, TFMessage, DRAWING)
ROBOT_DESCRIPTION = Topic(topic_names.ROBOT_DESCRIPTION, String, LATEST_DESCRIPTION)
MARKERS = Topic(topic_names.MARKERS, MarkerArray, DRAWING)
