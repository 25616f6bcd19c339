# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The stubs of messages allow what the classes allow, and nothing else."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "scripts/make_message_stubs.py"
IMPORTS = """\
from array import array
import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovariance
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_msgs.msg import GaitEvent, TorqueProfile
from gait_entrainment_msgs.srv import StartRun
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
INTEGERS = np.zeros(36, np.int32)
"""
ALLOWED = """\
Header(stamp=Time(sec=1), frame_id="world").stamp.nanosec = 2
GaitEvent(kind=GaitEvent.TOE_OFF).header = Header()
JointState(name=["l_hip"], position=[0.1], velocity=(0.1,)).effort = array("d", [1.0])
JointState().position.append(0.5)
JointState().name = ("l_hip", "r_hip")
TorqueProfile(times=[Time()]).onsets = [Time(sec=1)]
PoseWithCovariance().covariance = np.zeros(36)
PoseWithCovariance().covariance = [0.0] * 36
PoseWithCovariance().covariance.sum()
RunProtocol.Goal().protocol = "name: x"
RunProtocol.Feedback().state.header.stamp.sec
StartRun.Request()
Header.get_fields_and_field_types().keys()
"""
# Only the classes refuse a string in place of a list of strings: to mypy it is a sequence.
REFUSED = """\
Header(time=Time())
Header(stamp=1.5)
GaitEvent(kind="toe-off")
JointState().position = 0.1
JointState().name = [1]
TorqueProfile().onsets = [1]
TorqueProfile().stop = 1
PoseWithCovariance().covariance = INTEGERS
PoseWithCovariance().covariance = ["0"] * 36
RunProtocol.Goal().protocol = 1
GaitEvent.HEEL_OFF
Header().time
RunProtocol.Request
"""


LINES = (ALLOWED + REFUSED).splitlines()


def test_stubs_refuse_what_is_wrong(tmp_path):
    subprocess.run([sys.executable, SCRIPT, tmp_path / "stubs"], check=True)
    (tmp_path / "use.py").write_text(IMPORTS + "\n".join(LINES))
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--config-file", os.devnull, "use.py"],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": "stubs"},
        capture_output=True,
        text=True,
    )
    errors = [text for text in checked.stdout.splitlines() if ": error: " in text]
    wrong = {int(error.split(":")[1]) - IMPORTS.count("\n") - 1 for error in errors}
    assert [LINES[number] for number in sorted(wrong)] == REFUSED.splitlines()


def test_classes_refuse_the_same():
    program = f"""{IMPORTS}
for line in {LINES!r}:
    try:
        exec(line)
    except (AssertionError, AttributeError):
        print(line)
"""
    refused = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "ROS_PYTHON_CHECK_FIELDS": "1"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert refused == REFUSED
