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
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from gait_entrainment_msgs import msg

# Nothing may be lost: a writer waits for its slowest reader instead of overwriting.
EVERY_MESSAGE = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE, depth=0
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


class Topic(NamedTuple):
    """One topic: relative name, message type, quality of service of both ends."""

    name: str
    type: Any
    qos: QoSProfile = EVERY_MESSAGE


JOINT_STATES = Topic("joint_states", JointState)
GAIT_EVENTS = Topic("gait_events", msg.GaitEvent)
ANKLE_TORQUE = Topic("ankle_torque", msg.AnkleTorque)
GROUND_REACTION = (
    Topic("ground_reaction/left", WrenchStamped),
    Topic("ground_reaction/right", WrenchStamped),
)
WALKER_PROGRESS = Topic("walker_sim/progress", msg.Progress)
WALKER_TIMING = Topic("walker_sim/timing", msg.WalkerTiming)
CLOCK = Topic("/clock", ClockMessage)

TORQUE_PROFILE = Topic("perturbation/torque_profile", msg.TorqueProfile)
PULSES = Topic("perturbation/pulses", msg.TorquePulse)
ROBOT_STATE = Topic("perturbator/state", msg.AnkleRobotState)
TROUBLE = Topic("perturbator/trouble", msg.Trouble)

HORIZON = Topic("experiment/horizon", msg.Horizon)
EXPERIMENT_STATE = Topic("experiment/state", msg.ExperimentState, LATEST_STATE)

STRIDES = Topic("gait/strides", msg.Stride)
PULSE_PHASES = Topic("gait/pulse_phases", msg.PulsePhase)
ENTRAINMENT = Topic("gait/entrainment", msg.Entrainment, LATEST_STATE)

RECORDER_PROGRESS = Topic("bag_recorder/progress", msg.Progress)
PUBLISHED_COUNTS = Topic("published_counts", msg.PublishedCounts)
DIAGNOSTICS = Topic("/diagnostics", DiagnosticArray, DIAGNOSTICS_QOS)

# tf2 has one topic for a whole system; instances differ in their frames.
TF = Topic("/tf", TFMessage, DRAWING)
ROBOT_DESCRIPTION = Topic("robot_description", String, LATEST_DESCRIPTION)
MARKERS = Topic("walker_display/markers", MarkerArray, DRAWING)
