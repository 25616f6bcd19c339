# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The commands that this package adds to `entrain`, one module each: name and purpose."""

COMMANDS = {
    "node": "one node of an experiment; the others run on other hosts or in containers",
    "page": "a run in a browser, with a stop that works",
    "preflight": "the checklist before a session with a real ankle robot",
    "replay": "a bag played to the gait analyzer over ROS 2",
    "run": "the experiment over real ROS 2 nodes, recorded",
    "session": "the blocks of a session with a person: ordered, blinded, recorded, resumed",
}
