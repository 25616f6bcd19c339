# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import sys
from pathlib import Path

# Tests are imported by path; the module that they share is next to them.
sys.path.insert(0, str(Path(__file__).parent))
