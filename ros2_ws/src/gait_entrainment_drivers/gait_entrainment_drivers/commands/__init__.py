# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name and purpose."""

COMMANDS = {
    "driver": "list ankle robot drivers, or check one",
    "stop": "bring every ankle robot driven by this machine to zero torque, latched",
}
