# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Phase-locked gaits, solved.

    pulsed_gait    gaits with one pulse a stride, and the exact derivative of their Poincare map
    branches       smooth branches of them, corners and folds, the locked gaits at a pulse period
    walked         walks under pulses by the walker in time, to confirm them
    attractors     which initial phases each stable lock draws
    figures        the branches as a picture
"""
