# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What was proved of ankle robots on this computer: that torque ends when their host falls silent.

``entrain driver prove`` writes it, whoever is about to arm a robot reads it. A proof holds for a
driver with exactly these options, in whatever order they are given: another bus or another motor
is another robot. The file is ``gait_entrainment/proofs.json`` in the user's state folder, which is
``$XDG_STATE_HOME``, else ``~/.local/state``.
"""

import json
import os
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gait_entrainment.robot.drivers import join_options, split_options
from gait_entrainment.robot.faults import DeviceError


@dataclass(frozen=True)
class Proof:
    """That a device brought its torque to zero by itself."""

    within: float  # zero was measured after its host had been silent for so long [s]
    at: str  # when that was, by ISO 8601 in UTC
    version: str  # of gait_entrainment; empty if it is not installed as a package


def proof_of(driver: str) -> Proof | None:
    """Return what was proved of the driver that a text names; None if nothing can be read."""
    try:
        return Proof(**json.loads(_file().read_text(encoding="utf-8"))[_key(driver)])
    except (OSError, RuntimeError, ValueError, LookupError, TypeError):
        return None


def keep_proof(driver: str, within: float | None) -> None:
    """
    Remember that zero was measured within a time [s]; None takes back what was proved before.

    Raises
    ------
    DeviceError
        if it cannot be written.

    """
    try:
        file = _file()
        known = _known(file)
        known.pop(_key(driver), None)
        if within is not None:
            now = datetime.now(timezone.utc).isoformat(timespec="seconds")
            known[_key(driver)] = asdict(Proof(within, now, _version()))
        file.parent.mkdir(parents=True, exist_ok=True)
        # Written apart and then put in place, so that nobody reads half of it.
        written = file.with_name(f"{file.name}.{os.getpid()}")
        written.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        written.replace(file)
    except (OSError, RuntimeError) as error:
        raise DeviceError(
            f"the proof cannot be kept: {error}; set XDG_STATE_HOME to a folder of yours"
        ) from None


def _file() -> Path:
    state = os.environ.get("XDG_STATE_HOME", "")
    # A relative one is to be ignored, says the XDG Base Directory Specification.
    folder = Path(state) if os.path.isabs(state) else Path.home() / ".local" / "state"
    return folder / "gait_entrainment" / "proofs.json"


def _known(file: Path) -> dict[str, Any]:
    """Return what the file holds; what is unreadable is as good as absent."""
    try:
        known = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _key(driver: str) -> str:
    name, _, options = driver.partition(":")
    return f"{name}:{join_options(sorted(split_options(options)))}"


def _version() -> str:
    try:
        return version("gait_entrainment")
    except PackageNotFoundError:
        return ""
