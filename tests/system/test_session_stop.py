# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Stopping a session also stops every robot on this machine, so nothing runs alongside."""

import os
import pty
import termios
import time

from harness import TIMEOUT
from test_session import FOLDER, ended, entrain, shortened

from gait_entrainment_sessions.folder import SessionFolder


def test_the_space_bar_stops_a_block(tmp_path):
    ours, theirs = pty.openpty()
    short, study = shortened(tmp_path), tmp_path / "stopped"
    process = entrain("session", short, "--out", study, "--real-time", stdin=theirs)
    os.write(ours, b"\n")  # the answer to the prompt for what is next
    while not process.stdout.readline().endswith("block 1\n"):
        pass
    deadline = time.monotonic() + TIMEOUT
    while termios.tcgetattr(theirs)[3] & termios.ICANON:  # until keys are read without Enter
        assert time.monotonic() < deadline
        time.sleep(0.02)
    os.write(ours, b" ")
    code, _, err = ended(process)
    os.close(ours)
    os.close(theirs)
    assert code == 1
    assert "entrain session: block 1: stopped by the space bar" in err
    assert SessionFolder(study / FOLDER).ledger[-1].what == "failed"
