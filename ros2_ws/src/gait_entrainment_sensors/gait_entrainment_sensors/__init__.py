# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Gait events from sensor signals: detectors, numbering, emulated sensors, recordings.

    detection       the interface of a detector, and how one is found by name
    vertical_force, foot_switch, foot_gyroscope, shank_gyroscope, ankle_encoder
                    the detectors
    mounting        the orientation of a gyroscope, from a calibration walk
    numbering       step numbers for the events detected on both feet
    emulated        what sensors on the simulated walker would measure
    rehearsal       a simulated experiment, seen through emulated sensors and detectors
    sources         topics, message fields and table columns of each kind of sensor
    scoring         detected events compared with a reference
"""

from gait_entrainment_sensors.detection import Detection, Detector, find_detector
from gait_entrainment_sensors.numbering import Numbering
