# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Drivers of real ankle robots, emulators of their motors, and the conformance kit."""
