# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Lets these tests import the independent references next to them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
