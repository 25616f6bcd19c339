# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import pytest

from gait_entrainment_commands import main, make_parser
from gait_entrainment_studies.commands import results

COMMANDS = results.COMMAND.findall(results.TEMPLATE.read_text())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_on_the_page_is_understood(command):
    arguments = command.split()
    make_parser(arguments[0]).parse_args([*arguments, "--out", "folder"])


def test_the_page_shows_command_output_and_figure(tmp_path, monkeypatch):
    template = tmp_path / "template.md"
    template.write_text("Text.\n\n    entrain existence\n\n![A map](results/01_existence.png)\n")
    monkeypatch.setattr(results, "TEMPLATE", template)
    assert main(["results", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "results.md").read_text()
    assert page.startswith("Text.\n\n    entrain existence\n\n```text\n")
    assert "just vaults over 67.479207 N m/rad" in page
    assert "figure  " not in page
    assert (tmp_path / "results" / "01_existence.png").exists()
    assert page.endswith("```\n\n![A map](results/01_existence.png)\n")
