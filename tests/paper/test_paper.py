# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The published numbers: which of ours agree, and what explains the differences."""

import json
import sys
from pathlib import Path

import pytest

from gait_entrainment_commands import main
from gait_entrainment_studies.paper.comparison import compare, explain

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import make_figures


@pytest.fixture(scope="module")
def published():
    return {row.name: row for row in compare()}


@pytest.fixture(scope="module")
def explanations():
    return {row.name: row for row in explain()}


DIFFERENT = {
    "peak ankle torque": 133.4645,
    "smallest force F_B on the leading leg": 149.3087,
    "basin of entrainment, solved": 4.1045,
    "Fig. 7: stride period converges to 2 tau_0 - 50 ms": 1.88323,
}


def test_all_published_numbers_agree_except_four_known_ones(published):
    assert {row.name for row in published.values() if row.agrees is False} == set(DIFFERENT)
    for name, value in DIFFERENT.items():
        assert published[name].ours == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize(
    "what",
    ["2 tau_0 - 50 ms", "smallest F_B", "peak ankle torque", "just-vault-over stiffness"],
)
def test_k_and_mu_unrounded_together_give_the_papers_digits(explanations, what):
    assert explanations[f"both unrounded: {what}"].agrees


def test_k_or_mu_unrounded_alone_does_not(explanations):
    for name in ("k unrounded", "mu unrounded"):
        assert not explanations[f"{name}: 2 tau_0 - 50 ms"].agrees


def test_a_grid_of_4_ms_explains_the_basin_and_rounding_does_not(published, explanations):
    assert published["basin of entrainment, walked on a grid of 4 ms"].agrees
    assert not explanations["both unrounded: basin of entrainment, solved"].agrees


def test_less_than_9_percent_is_tight_only_for_pulses_in_every_step(published):
    every_stride = published["Fig. 8, pulse in every stride: range of average speeds"]
    every_step = published["Fig. 8, pulse in every step: range of average speeds"]
    assert every_stride.ours == pytest.approx(4.280, abs=1e-3)
    assert every_step.ours == pytest.approx(8.622, abs=1e-3)


def test_command_draws_every_figure_and_prints_json(tmp_path, capsys, monkeypatch, published):
    # The numbers are computed above; this tests only what the command does with them.
    rows = list(published.values())
    monkeypatch.setattr("gait_entrainment_studies.commands.paper.compare", lambda: rows)
    assert main(["paper", "--json", "--out", str(tmp_path / "figures")]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert set(printed[0]) == {"name", "paper", "ours", "unit", "agrees", "note"}
    drawn = {path.name for path in (tmp_path / "figures").iterdir()}
    names = ("figure_4", "figure_5", "figure_6b", "figure_7", "figure_8")
    assert drawn == {name + ending for name in names for ending in (".png", ".svg")}
    known = {name: make_figures.DOCS / f"results/01_{name}.png" for name in names}
    if not all(map(make_figures.drawn_by_this_matplotlib, known.values())):
        pytest.skip("the pictures in docs were drawn by another version of matplotlib")
    old = [n for n in names if not make_figures.same(known[n], tmp_path / f"figures/{n}.png")]
    assert old == [], "make figures"
