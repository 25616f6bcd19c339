# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The science beyond one run: locking, existence, phase response, sweeps, cohorts, the paper."""
