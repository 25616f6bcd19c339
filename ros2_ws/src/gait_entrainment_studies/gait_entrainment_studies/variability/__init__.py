# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Extensions of the paper: stride-to-stride variability, asymmetry of the legs, slope of the ground.

    population   many walkers stepping at once
    noise        white or long-range correlated, seeded, truncated
    walk         walks with pulses planned on the way; intermittent locking
"""
