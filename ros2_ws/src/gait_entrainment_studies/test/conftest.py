# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Lets these tests import the step-to-step function from the tests of the core."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "gait_entrainment" / "test" / "walker"))
