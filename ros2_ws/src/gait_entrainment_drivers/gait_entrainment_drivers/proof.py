# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What was shown of ankle robots on this computer: the device's own watchdog, and the checklist.

``entrain driver prove`` shows that torque ends when the host falls silent, ``entrain preflight``
goes through the checklist before a session; whoever is about to arm a robot reads both. They hold
for a driver with exactly these options, in whatever order they are given: another bus or another
motor is another robot. The files are in ``gait_entrainment`` in the user's state folder, which is
``$XDG_STATE_HOME``, else ``~/.local/state``.
"""

import json
import os
import socket
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from gait_entrainment.robot.drivers import join_options, split_options
from gait_entrainment.robot.faults import DeviceError

_T = TypeVar("_T")

_PROOFS, _PREFLIGHTS = "proofs.json", "preflights.json"


@dataclass(frozen=True)
class Proof:
    """That a device brought its torque to zero by itself."""

    within: float  # zero was measured after its host had been silent for so long [s]
    at: str  # when that was, by ISO 8601 in UTC
    version: str  # of gait_entrainment; empty if it is not installed as a package


@dataclass(frozen=True)
class Preflight:
    """That the checklist was gone through."""

    failed: str  # the points that failed, separated by commas; empty if all passed
    at: str  # when that was, by ISO 8601 in UTC


def proof_of(driver: str) -> Proof | None:
    """Return what this version proved of the driver that a text names; None if nothing."""
    proof = _shown(Proof, _PROOFS, driver)
    return proof if proof is not None and proof.version == _version() else None


def require_proof(driver: str, *, unproved: bool) -> None:
    """Raise DeviceError if nothing was proved of a driver, and none is ready to do without."""
    if proof_of(driver) is None and not unproved:
        raise DeviceError(
            "driver: the device's own watchdog was not proved on this computer by this version: "
            f"entrain driver prove '{driver}' --arm (nobody may wear it), or allow it unproved"
        )


def keep_proof(driver: str, within: float | None) -> None:
    """
    Remember that zero was measured within a time [s]; None takes back what was proved before.

    Raises DeviceError if it cannot be written.
    """
    _keep(_PROOFS, driver, None if within is None else Proof(within, _now(), _version()))


def preflight_of(driver: str) -> Preflight | None:
    """Return the latest checklist of the driver that a text names; None if there is none."""
    return _shown(Preflight, _PREFLIGHTS, driver)


def keep_preflight(driver: str, failed: str) -> None:
    """Remember a checklist, and the points that failed; DeviceError if it cannot be written."""
    _keep(_PREFLIGHTS, driver, Preflight(failed, _now()))


def _shown(kind: type[_T], name: str, driver: str) -> _T | None:
    """Return what a file holds of a driver; None if that is not what is written by this module."""
    told = _known(name).get(_key(driver))
    if not isinstance(told, dict) or {k: type(v) for k, v in told.items()} != get_type_hints(kind):
        return None
    return kind(**told)


def _keep(name: str, driver: str, shown: Proof | Preflight | None) -> None:
    try:
        file, known = _file(name), _known(name)
        known.pop(_key(driver), None)
        if shown is not None:
            known[_key(driver)] = asdict(shown)
        file.parent.mkdir(parents=True, exist_ok=True)
        # Written apart and then put in place, so that nobody reads half of it.
        written = file.with_name(f"{file.name}.{os.getpid()}")
        written.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        written.replace(file)
    except (OSError, RuntimeError) as error:
        raise DeviceError(
            f"what was shown cannot be kept: {error}; set XDG_STATE_HOME to a folder of yours"
        ) from None


def _file(name: str) -> Path:
    state = os.environ.get("XDG_STATE_HOME", "")
    # A relative one is to be ignored, says the XDG Base Directory Specification.
    folder = Path(state) if os.path.isabs(state) else Path.home() / ".local" / "state"
    return folder / "gait_entrainment" / name


def _known(name: str) -> dict[str, Any]:
    """Return what a file holds; what is unreadable is as good as absent."""
    try:
        known = json.loads(_file(name).read_text(encoding="utf-8"))
    except (OSError, RuntimeError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _key(driver: str) -> str:
    name, _, options = driver.partition(":")
    # Several computers may share a home folder.
    return f"{socket.gethostname()}/{name}:{join_options(sorted(split_options(options)))}"


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _version() -> str:
    try:
        return version("gait_entrainment")
    except PackageNotFoundError:
        return ""
