# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A simulated experiment, seen through emulated sensors and detectors, offline."""
