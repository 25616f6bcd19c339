# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain stop: it reaches every robot of this machine, so nothing else may run beside it."""

import os
import re
import shutil
import subprocess
import sys

from harness import entrain_run
from test_drivers import entrain

from gait_entrainment_drivers.stop_channel import StopListener


def test_stop_from_the_command_line_ends_a_run(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", "--baseline=2") as run:
        run.wait_for_stride(2)
        code, out, err = entrain(run.domain(), "stop")
        assert code == 0, out + err
        assert re.search(r"perturbator/\d+: the stop is latched", out)
        assert run.wait() == 1
        assert "stopped: The stop was called." in run.text


def test_stop_that_finds_nobody_says_so():
    code, out, err = entrain(None, "stop")
    assert (code, out) == (1, "")
    assert "no robot is driven by this machine" in err


def test_stop_is_sent_before_anything_of_the_project_is_loaded():
    listener = StopListener("somebody")
    broken = {"PATH": os.environ["PATH"]}  # without PYTHONPATH there is no project
    done = subprocess.run(["entrain", "stop"], capture_output=True, text=True, env=broken)
    assert done.returncode == 1
    assert "gait_entrainment_commands" in done.stderr
    assert len(listener.requests()) == 1
    subprocess.run(["entrain", "stop", "--help"], capture_output=True, check=True)
    assert not listener.requests()
    listener.close()


def test_stop_is_sent_where_there_is_no_perl(tmp_path):
    (tmp_path / "python3").symlink_to(sys.executable)
    bare = {"PATH": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    listener = StopListener("somebody")
    subprocess.run([shutil.which("entrain"), "stop"], capture_output=True, env=bare, check=False)
    assert len(listener.requests()) == 1
    listener.close()


def test_stop_needs_no_home_and_no_ros():
    bare = {"PATH": os.environ["PATH"], "PYTHONPATH": os.environ["PYTHONPATH"]}
    done = subprocess.run(["entrain", "stop"], capture_output=True, text=True, env=bare)
    assert done.returncode == 1
    assert "no robot is driven by this machine" in done.stderr
    assert "Traceback" not in done.stderr
