# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The conformance kit: checks that an ankle robot, or a node with one, keeps its promises."""
