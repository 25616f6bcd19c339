# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name and purpose."""

COMMANDS = {
    "existence": "for which ankle stiffness and leg angle a gait exists",
    "lock": "solve for all phase-locked gaits, stable or not, and the borders of the basin",
    "paper": "every published number and figure, compared with ours",
    "phase-response": "response to single pulses, and the lock that it predicts",
    "results": "write the page of results",
    "sweep": "Arnold tongue: pulse period x torque x initial phase",
}
