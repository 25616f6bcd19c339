# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Sessions: ordered, optionally blinded blocks for one person, their records and reports."""
