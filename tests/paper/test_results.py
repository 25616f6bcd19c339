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

"""docs/results.md shows what the commands that solve print; walks take too long for a test."""

from pathlib import Path

import pytest

from gait_entrainment.commands import main
from gait_entrainment.commands.results import SECTIONS

PAGE = (Path(__file__).parents[2] / "docs/results.md").read_text()
SOLVED = [one for one in SECTIONS if one.arguments[0] in ("lock", "existence", "phase-response")]


@pytest.mark.parametrize("section", SOLVED, ids=lambda section: section.title)
def test_the_page_shows_what_the_command_prints(section, capsys):
    assert main([*section.arguments]) == 0
    part = PAGE.partition(f"## {section.title}\n")[2].partition("\n## ")[0]
    assert f"    entrain {' '.join(section.arguments)}\n" in part
    assert f"```text\n{capsys.readouterr().out}```" in part
