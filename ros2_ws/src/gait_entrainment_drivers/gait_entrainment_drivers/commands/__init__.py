# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name, and what it is for."""

COMMANDS = {
    "driver": "ankle robot drivers: list them, check one",
    "stop": "torque to zero, latched, for every ankle robot that this machine drives",
}
