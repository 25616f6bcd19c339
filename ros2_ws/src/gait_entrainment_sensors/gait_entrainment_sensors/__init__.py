# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Gait events from the signals of sensors: detectors, numbering, emulated sensors, recordings.

    detection       what a detector owes, and how one is found by name
    vertical_force, foot_switch, foot_gyroscope, shank_gyroscope, ankle_encoder
                    the detectors
    mounting        which way round a gyroscope was put on, from a calibration walk
    numbering       step numbers for what was detected on both feet
    emulated        what sensors on the simulated walker would measure
    rehearsal       a simulated experiment, seen through emulated sensors and detectors
    sources         topics, fields of messages and columns of tables of each kind of sensor
    scoring         detected events beside a reference
"""

from gait_entrainment_sensors.detection import Detection, Detector, find_detector
from gait_entrainment_sensors.numbering import Numbering
