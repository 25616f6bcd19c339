# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The published numbers and figures beside ours."""

from gait_entrainment_studies.paper.comparison import Comparison, compare, explain, unrounded

__all__ = ["Comparison", "compare", "explain", "unrounded"]
