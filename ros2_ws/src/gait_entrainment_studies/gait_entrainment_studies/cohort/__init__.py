# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A cohort of simulated subjects, each taken through the experiment of the human study."""
