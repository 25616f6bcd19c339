# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The ament linters, as `colcon test` expects them; any that is not installed is skipped.

`ruff` decides on style (`make lint`): rules that its formatter breaks are switched off here.
ament_copyright is not run: it does not know the SPDX lines with which each file begins.
"""

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]
# Only pycodestyle and pyflakes: a full install adds plugins that demand single quotes.
FLAKE8 = (
    "[flake8]\nselect = E,F,W\nignore = E203,E501,E704,W503\nper-file-ignores = __init__.py:F401\n"
)
# Imperative mood; and sections that pydocstyle sees in a parameter named `parameters`.
PEP257 = ["D401", "D402", "D403", "D405", "D407", "D410", "D411", "D414", "D417"]


@pytest.mark.linter
@pytest.mark.parametrize("linter", ["flake8", "pep257", "xmllint"])
def test_ament_linter_finds_nothing(linter, tmp_path):
    (tmp_path / "flake8.ini").write_text(FLAKE8)
    arguments = {
        "flake8": ["--config", str(tmp_path / "flake8.ini")],
        "pep257": ["--exclude", "test", "--add-ignore", *PEP257, "--"],
    }.get(linter, [])
    ament = pytest.importorskip(f"ament_{linter}.main")
    assert ament.main([*arguments, str(PACKAGE)]) == 0
