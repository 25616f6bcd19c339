# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Results for ankle robots on this computer: the proof of the device's watchdog, and the checklist.

``entrain driver prove`` shows that torque ends when the host falls silent, ``entrain preflight``
goes through the checklist before a session; both are read before a robot is armed. They are valid
for a driver with exactly these options, in any order: another bus or another motor is another
robot. The files are in ``gait_entrainment`` in the user's state folder, ``$XDG_STATE_HOME`` or
else ``~/.local/state``.
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
    """Proof that a device brought its torque to zero by itself."""

    within: float  # zero was measured after its host was silent for this long [s]
    at: str  # when, in ISO 8601, UTC
    version: str  # of gait_entrainment; empty if it is not installed as a package


@dataclass(frozen=True)
class Preflight:
    """The outcome of a checklist."""

    failed: str  # the points that failed, separated by commas; empty if all passed
    at: str  # when, in ISO 8601, UTC


def proof_of(driver: str) -> Proof | None:
    """Return this version's proof of the driver that a text names; None if there is none."""
    proof = _shown(Proof, _PROOFS, driver)
    return proof if proof is not None and proof.version == _version() else None


def require_proof(driver: str, *, unproved: bool) -> None:
    """Raise DeviceError if a driver has no proof, unless it is allowed ``unproved``."""
    if proof_of(driver) is None and not unproved:
        raise DeviceError(
            "driver: the device's own watchdog was not proved on this computer by this version: "
            f"run entrain driver prove '{driver}' --arm (nobody may wear it), or allow it unproved"
        )


def keep_proof(driver: str, within: float | None) -> None:
    """
    Store that zero was measured within a time [s]; None withdraws an earlier proof.

    Raises DeviceError if the file cannot be written.
    """
    _keep(_PROOFS, driver, None if within is None else Proof(within, _now(), _version()))


def preflight_of(driver: str) -> Preflight | None:
    """Return the latest checklist of the driver that a text names; None if there is none."""
    return _shown(Preflight, _PREFLIGHTS, driver)


def keep_preflight(driver: str, failed: str) -> None:
    """Store a checklist's failed points; raise DeviceError if the file cannot be written."""
    _keep(_PREFLIGHTS, driver, Preflight(failed, _now()))


def _shown(kind: type[_T], name: str, driver: str) -> _T | None:
    """Return a driver's entry in a file; None if this module cannot have written it."""
    item = _known(name).get(_key(driver))
    if not isinstance(item, dict) or {k: type(v) for k, v in item.items()} != get_type_hints(kind):
        return None
    return kind(**item)


def _keep(name: str, driver: str, shown: Proof | Preflight | None) -> None:
    try:
        file, known = _file(name), _known(name)
        known.pop(_key(driver), None)
        if shown is not None:
            known[_key(driver)] = asdict(shown)
        file.parent.mkdir(parents=True, exist_ok=True)
        # Written separately and then moved into place, so that no reader sees half of it.
        written = file.with_name(f"{file.name}.{os.getpid()}")
        written.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        written.replace(file)
    except (OSError, RuntimeError) as error:
        raise DeviceError(
            f"the result cannot be stored: {error}; set XDG_STATE_HOME to a writable folder"
        ) from None


def _file(name: str) -> Path:
    state = os.environ.get("XDG_STATE_HOME", "")
    # The XDG Base Directory Specification requires a relative path to be ignored.
    folder = Path(state) if os.path.isabs(state) else Path.home() / ".local" / "state"
    return folder / "gait_entrainment" / name


def _known(name: str) -> dict[str, Any]:
    """Return the content of a file; an unreadable one counts as absent."""
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
