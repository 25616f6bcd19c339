# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ROS 2 nodes of the entrainment testbed: they convert, call the core, publish."""
