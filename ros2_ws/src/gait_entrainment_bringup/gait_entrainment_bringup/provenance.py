# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a bag keeps about its origin: protocol, mode, versions, commit."""

import json
import subprocess
from importlib.metadata import version
from pathlib import Path

from gait_entrainment.protocol import Protocol, write_protocol


def provenance(protocol: Protocol, *, real_time: bool, onset: str) -> dict[str, str]:
    """Return what the bag keeps about its origin."""
    packages = ("gait_entrainment", "numpy", "mcap")
    return {
        "protocol": write_protocol(protocol),
        "driver": protocol.driver,
        "seed": str(protocol.seed),
        "mode": "real time" if real_time else "lock-step",
        "onset": onset,
        "versions": json.dumps({package: version(package) for package in packages}),
        "commit": _commit(),
    }


def _commit() -> str:
    """Return the git commit of the running sources, with "+" if they have changed since."""
    here = Path(__file__).resolve().parent
    status = ["status", "--porcelain", "-uno", "--", ":/ros2_ws/src"]
    try:
        head, changes = (
            subprocess.check_output(["git", "-C", here, *words], stderr=subprocess.DEVNULL).strip()
            for words in (["rev-parse", "HEAD"], status)
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown: the sources are not under git"
    return head.decode() + ("+" if changes else "")
