# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The conformance kit: whether an ankle robot, or a node that holds one, keeps every promise."""
