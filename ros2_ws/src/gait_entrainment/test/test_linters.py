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

"""
The ament linters, as `colcon test` expects them; those that are not installed are skipped.

`ruff` decides on style (`make lint`): what its formatter writes otherwise is left out here.
"""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]
# Of pycodestyle and pyflakes alone: a full install adds plugins that ask for single quotes.
FLAKE8 = "[flake8]\nselect = E,F,W\nignore = E203,E501,E704,W503\n"
# Imperative mood; and sections that pydocstyle sees in a parameter named `parameters`.
PEP257 = ["D401", "D402", "D403", "D405", "D407", "D410", "D411", "D414", "D417"]


@pytest.mark.linter
@pytest.mark.parametrize("linter", ["copyright", "flake8", "pep257", "xmllint"])
def test_ament_linter_finds_nothing(linter, tmp_path):
    (tmp_path / "flake8.ini").write_text(FLAKE8)
    arguments = {
        "flake8": ["--config", str(tmp_path / "flake8.ini")],
        "pep257": ["--exclude", "test", "--add-ignore", *PEP257, "--"],
    }.get(linter, [])
    ament = pytest.importorskip(f"ament_{linter}.main")
    assert ament.main([*arguments, str(PACKAGE)]) == 0
