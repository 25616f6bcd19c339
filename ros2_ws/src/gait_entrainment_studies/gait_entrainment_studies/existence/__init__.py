# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""For which stiffness and leg angle a period-one gait exists."""

from gait_entrainment_studies.existence.stiffness_range import (
    Limit,
    StiffnessRange,
    existence_map,
    stiffness_range,
)

__all__ = ["Limit", "StiffnessRange", "existence_map", "stiffness_range"]
