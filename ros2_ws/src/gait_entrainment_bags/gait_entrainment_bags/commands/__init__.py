# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name, and what it is for."""

COMMANDS = {
    "detect": "gait events from the signals of a recording",
    "analyze": "the outcome of a recorded run, without ROS",
    "bag": "info, check, recover, export",
}
