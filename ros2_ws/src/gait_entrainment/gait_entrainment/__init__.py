# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Entrainment of walking to an ankle robot: the ROS-free core."""
