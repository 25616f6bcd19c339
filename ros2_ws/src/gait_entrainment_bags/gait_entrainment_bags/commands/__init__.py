# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Commands that this package adds to `entrain`, one module each: name and purpose."""

COMMANDS = {
    "detect": "gait events from the signals of a recording",
    "analyze": "the outcome of a recorded run, without ROS",
    "bag": "info, check, recover, export",
}
