# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Example of a driver for an ankle robot on a serial line."""
