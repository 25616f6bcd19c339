# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name and purpose."""

COMMANDS = {
    "cohort": "the human study's experiment, or a session file, on simulated subjects (extension)",
    "plan": "chance of a correct verdict by number of pulses",
    "report": "one HTML page about a run, a session or a study",
}
