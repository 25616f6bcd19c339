# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The pages of `make docs` give units and show an example."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts/make_api_pages.py"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("api")
    subprocess.run([sys.executable, SCRIPT, folder], check=True)
    return {
        file.relative_to(folder).as_posix(): file.read_text() for file in folder.rglob("*.html")
    }


def test_fields_have_their_units(pages):
    assert "mean stride period before the pulses [s]" in pages["gait_entrainment/run.html"]


@pytest.mark.parametrize(
    ("page", "program"),
    [
        ("gait_entrainment/simulation.html", "Simulate a protocol"),
        ("gait_entrainment/robot.html", "Write a driver"),
        ("gait_entrainment_bags.html", "List the strides"),
    ],
)
def test_pages_show_an_example(pages, page, program):
    assert program in pages[page]


def test_nothing_else_is_public(pages):
    assert not [page for page in pages if "options" in page or "walker" in page]
