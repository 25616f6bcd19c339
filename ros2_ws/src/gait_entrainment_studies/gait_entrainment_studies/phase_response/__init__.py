# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Response of the gait's timing to single pulses, and the lock that it predicts."""
