# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import pytest

from gait_entrainment.commands import main, make_parser
from gait_entrainment_studies.commands import results


@pytest.mark.parametrize("section", results.SECTIONS, ids=lambda section: section.title)
def test_every_command_of_the_page_is_understood(section):
    make_parser(section.arguments[0]).parse_args([*section.arguments, "--out", "folder"])


def test_the_page_shows_command_output_and_figure(tmp_path, monkeypatch):
    existence = [s for s in results.SECTIONS if s.arguments[0] == "existence"]
    monkeypatch.setattr(results, "SECTIONS", tuple(existence))
    assert main(["results", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "results.md").read_text()
    assert "    entrain existence\n" in page
    assert "just vaults over 67.479207 N m/rad" in page
    assert "figure  " not in page
    assert (tmp_path / "results" / "01_existence.png").exists()
    assert "(results/01_existence.png)" in page
