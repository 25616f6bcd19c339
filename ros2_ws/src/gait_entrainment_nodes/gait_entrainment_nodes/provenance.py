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

"""What a bag keeps of how it came about: protocol, mode, versions, commit."""

import json
import subprocess
from importlib.metadata import version
from pathlib import Path

from gait_entrainment.protocol import Protocol, write_protocol


def provenance(protocol: Protocol, *, real_time: bool, onset: str = "commanded") -> dict[str, str]:
    """Return what the bag keeps of how it came about."""
    packages = ("gait_entrainment", "numpy", "mcap")
    return {
        "protocol": write_protocol(protocol),
        "driver": protocol.driver,
        "seed": str(protocol.seed),
        "mode": "real time" if real_time else "lock-step",
        "onset": onset,
        "versions": json.dumps({package: version(package) for package in packages}),
        "commit": commit(),
    }


def commit() -> str:
    """Return the git commit of the sources that run, "+" where they were changed since."""
    git = ["git", "-C", str(Path(__file__).resolve().parent)]
    try:
        head, changes = (
            subprocess.run([*git, *words], capture_output=True, text=True, check=True).stdout
            for words in (
                ["rev-parse", "HEAD"],
                ["status", "--porcelain", "-uno", "--", ":/ros2_ws/src"],
            )
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown: the sources are not under git"
    return head.strip() + ("+" if changes.strip() else "")
