# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The keyboard of a run, which may be a background job of a shell."""

import os
import pty
import subprocess
import sys

# A shell, which leads a session with a terminal, and its job.
SHELL = """
import fcntl, os, subprocess, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
job = subprocess.Popen([sys.executable, "-c", sys.argv[1]], preexec_fn=os.setpgrp)
sys.exit(os.WIFSTOPPED(os.waitpid(job.pid, os.WUNTRACED)[1]))
"""
JOB = """
from gait_entrainment_bringup.operator_console import keys_at_once, pressed_key
with keys_at_once():
    print(repr(pressed_key()))
"""


def test_a_background_job_is_not_suspended_by_its_own_terminal():
    ours, theirs = pty.openpty()
    os.write(ours, b"typed for the shell\n")
    words = [sys.executable, "-c", SHELL, JOB]
    shell = subprocess.run(
        words, stdin=theirs, capture_output=True, text=True, start_new_session=True, check=False
    )
    os.close(ours)
    os.close(theirs)
    assert (shell.returncode, shell.stdout) == (0, "''\n"), shell.stderr
