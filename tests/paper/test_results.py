# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""docs/results.md shows the output of commands that solve; walks take too long for a test."""

from pathlib import Path

import pytest

from gait_entrainment_commands import main
from gait_entrainment_studies.commands.results import COMMAND, TEMPLATE

PAGE = (Path(__file__).parents[2] / "docs/results.md").read_text()
COMMANDS = COMMAND.findall(TEMPLATE.read_text())
SOLVED = [c for c in COMMANDS if c.split()[0] in ("lock", "existence", "phase-response")]


@pytest.mark.parametrize("command", SOLVED)
def test_the_page_shows_what_the_command_prints(command, capsys):
    assert main(command.split()) == 0
    part = PAGE.partition(f"    entrain {command}\n")[2].partition("\n## ")[0]
    assert f"```text\n{capsys.readouterr().out}```" in part


def test_the_page_is_the_template_with_output_inserted():
    texts = COMMAND.split(TEMPLATE.read_text())[::2]
    assert all(text.strip() in PAGE for text in texts)
    assert COMMAND.findall(PAGE) == COMMANDS
