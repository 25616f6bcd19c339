# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Drivers for real ankle robots, motor emulators, and the conformance kit."""
