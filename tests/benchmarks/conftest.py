# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import sys
from pathlib import Path

# Benchmarks import the baselines next to them.
sys.path.insert(0, str(Path(__file__).parent))
