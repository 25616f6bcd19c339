# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Session files, and a session whose blocks are done: each is a copy of the committed bag."""

import shutil
from pathlib import Path

import pytest

from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.session_file import read_session

BAG = Path(__file__).parents[4] / "bags/paper_example"
TEXT = """\
study: pilot
session: "1"
person: {code: P01, number: 2, mass: 72, leg_length: 0.91}
limits: {torque: 15}
rest: 30
protocol:
  side: left
  pulses:
    count: 20
    torque: 9.0
blocks:
  - name: faster
    protocol:
      pulses: {period_offset: -0.05}
  - {name: slower, rest: 20, protocol: {pulses: {period: 1.9, torque_fraction: 0.1}}}
"""


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a session file, with parts of its text replaced."""

    def written(*replaced):
        text = TEXT
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "session.yaml"
        path.write_text(text)
        return path

    return written


@pytest.fixture
def done(write, tmp_path):
    """Return a function that returns the folder of a session whose two blocks are done."""

    def conducted(*replaced, study="study"):
        session = read_session(write(*replaced))
        folder = SessionFolder.begin(tmp_path / study, session)
        for number in (1, 2):
            bag = folder.new_bag(number)
            shutil.copytree(BAG, bag)
            folder.note("done", number, bag.name)
        return folder

    return conducted
