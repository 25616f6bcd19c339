# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Page tests use the helpers for runs and browsers, each in its own domain."""

import importlib
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
OTHERS = (HERE.parent, HERE.parent / "system", HERE.parent / "safety")
sys.path[:0] = [str(folder) for folder in (HERE, *OTHERS)]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.pop("ROS_DOMAIN_ID", None)

browser = importlib.import_module("browser").browser  # the fixture
