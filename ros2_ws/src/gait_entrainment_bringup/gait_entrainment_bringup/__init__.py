# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What runs together: the nodes of a run or a replay as processes, and as launch files."""
