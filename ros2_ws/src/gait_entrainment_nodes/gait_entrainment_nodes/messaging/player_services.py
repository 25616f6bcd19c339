# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The types of the player's services: those of rosbag2, so that its tools control this player too.

If rosbag2_interfaces is not installed, types of this project with the same fields replace them.
"""

try:
    from rosbag2_interfaces import srv
except ImportError:
    from gait_entrainment_msgs import srv

__all__ = ["srv"]
