# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

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
