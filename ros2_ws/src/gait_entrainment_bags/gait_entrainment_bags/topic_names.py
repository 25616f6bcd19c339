# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Topic names, without ROS: for the nodes that publish them and for readers of bags.

Names are relative, so a namespace or a remapping moves a whole experiment, except for names that
other software expects at the root. Types and quality of service are in
``gait_entrainment_nodes/messaging/topics.py``; the names of sensor topics are in
``gait_entrainment_sensors/sources.py``.
"""

# Walker.
JOINT_STATES = "joint_states"
GAIT_EVENTS = "gait_events"
ANKLE_TORQUE = "ankle_torque"
WALKER_PROGRESS = "walker/progress"
WALKER_PROGRESS_BEFORE = "walker_sim/progress"  # its name in bags of earlier versions
WALKER_TIMING = "walker_sim/timing"
CLOCK = "/clock"

# Exact events of a walker that is observed through sensors.
TRUE_EVENTS = "truth/gait_events"
TRUE_PROGRESS = "truth/progress"

# Robot.
TORQUE_PROFILE = "perturbation/torque_profile"
PULSES = "perturbation/pulses"
ROBOT_STATE = "perturbator/state"
ROBOT_SETUP = "perturbator/setup"
TROUBLE = "perturbator/trouble"
EMERGENCY_STOP = "perturbator/emergency_stop"

# Experiment.
HORIZON = "experiment/horizon"
EXPERIMENT_STATE = "experiment/state"

# Operator: the person or program that started the run.
OPERATOR_HEARTBEAT = "operator/heartbeat"
OPERATOR_NOTES = "operator/notes"

# Analyzer.
STRIDES = "gait/strides"
PULSE_PHASES = "gait/pulse_phases"
ENTRAINMENT = "gait/entrainment"

# Recorder, and every node.
RECORDER_PROGRESS = "bag_recorder/progress"
PUBLISHED_COUNTS = "published_counts"
DIAGNOSTICS = "/diagnostics"

# Display.
TF = "/tf"
ROBOT_DESCRIPTION = "robot_description"
MARKERS = "walker_display/markers"
