# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name, and what it is for."""

COMMANDS = {
    "cohort": "the human study's experiment, or a session file, on simulated subjects (extension)",
    "plan": "how many pulses give which chance of a right verdict",
    "report": "one HTML page about a run, a session or a study",
}
