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

import argparse

import pytest

from gait_entrainment.commands import COMMANDS, main, results


@pytest.mark.parametrize("section", results.SECTIONS, ids=lambda section: section.title)
def test_every_command_of_the_page_is_understood(section):
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(required=True)
    for add_command in COMMANDS.values():
        add_command(commands)
    parser.parse_args([*section.arguments, "--out", "folder"])


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
