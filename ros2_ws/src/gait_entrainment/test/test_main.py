# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""In a workspace that lacks a Python package the command line says so."""

import subprocess
import sys

WITHOUT_MCAP = """
import sys
sys.modules["mcap"] = None
from gait_entrainment.__main__ import main
sys.exit(main())
"""


def test_missing_package_is_one_line():
    done = subprocess.run([sys.executable, "-c", WITHOUT_MCAP], capture_output=True, text=True)
    assert done.returncode == 1
    assert "package mcap is missing" in done.stderr
    assert len(done.stderr.splitlines()) == 1
