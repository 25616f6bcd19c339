# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Sessions: blocks in order, blinded or not, for one person; what they leave and show."""
