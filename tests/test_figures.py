# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The pictures in docs are what the code draws now.

The run's picture is compared in test_lock_step.py and the paper's in test_paper.py, which draw
them anyway. Those of sweeps are drawn from the tables next to them, and one row of each is walked.

Only pictures drawn by the installed version of matplotlib are compared; each names its version.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
from make_figures import (
    DOCS,
    TABLES,
    draw_results,
    draw_sweeps,
    drawn_by_this_matplotlib,
    same,
    swept,
)

from gait_entrainment_studies.sweep.row import sweep_row


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    out = tmp_path_factory.mktemp("docs")
    return draw_results(out, ("lock", "existence", "phase-response", "cohort")) | draw_sweeps(out)


def test_pictures_are_what_the_code_draws(drawn):
    assert len(drawn) == 7
    if not all(drawn_by_this_matplotlib(DOCS / place) for place in drawn):
        pytest.skip("the pictures were drawn by another version of matplotlib")
    old = [str(place) for place, picture in drawn.items() if not same(DOCS / place, picture)]
    assert old == [], "make figures"


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.stem)
def test_table_of_a_sweep_agrees_with_a_walk_now(table):
    plan, rows = swept(table)
    index = plan.torque_fractions.count // 3
    row = sweep_row(plan, index)
    cells = slice(index * len(row["torque"]), (index + 1) * len(row["torque"]))
    for name, values in row.items():
        kept = rows[name].to_numpy()[cells]
        if values.dtype.kind == "f":
            np.testing.assert_allclose(values, kept, rtol=1e-6, err_msg=name)
        else:
            assert values.tolist() == kept.tolist(), name


def test_a_picture_with_an_extra_short_line_is_different(drawn, tmp_path):
    picture = next(iter(drawn.values()))
    pixels = (255 * imread(picture)[:, :, :3]).round().astype(np.uint8)
    plain, other = tmp_path / "plain.png", tmp_path / "other.png"
    Image.fromarray(pixels).save(plain)
    width = pixels.shape[1]
    pixels[100:102, width // 4 : 3 * width // 4] = 200, 30, 30
    Image.fromarray(pixels).save(other)
    assert same(plain, plain)
    assert not same(plain, other)
