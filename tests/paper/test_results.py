# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""docs/results.md shows what the commands that solve print; walks take too long for a test."""

from pathlib import Path

import pytest

from gait_entrainment.commands import main
from gait_entrainment_studies.commands.results import SECTIONS

PAGE = (Path(__file__).parents[2] / "docs/results.md").read_text()
SOLVED = [one for one in SECTIONS if one.arguments[0] in ("lock", "existence", "phase-response")]


@pytest.mark.parametrize("section", SOLVED, ids=lambda section: section.title)
def test_the_page_shows_what_the_command_prints(section, capsys):
    assert main([*section.arguments]) == 0
    part = PAGE.partition(f"## {section.title}\n")[2].partition("\n## ")[0]
    assert f"    entrain {' '.join(section.arguments)}\n" in part
    assert f"```text\n{capsys.readouterr().out}```" in part
