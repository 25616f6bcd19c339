# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""In a workspace that lacks a Python package the command line says so."""

import subprocess
import sys

WITHOUT_NUMBA = """
import sys
sys.modules["numba"] = None
from gait_entrainment_commands.__main__ import main
sys.exit(main(["simulate"]))
"""


def test_missing_package_is_one_line():
    done = subprocess.run([sys.executable, "-c", WITHOUT_NUMBA], capture_output=True, text=True)
    assert done.returncode == 1
    assert "package numba is missing" in done.stderr
    assert len(done.stderr.splitlines()) == 1
