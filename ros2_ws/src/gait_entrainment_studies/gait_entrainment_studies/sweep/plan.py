# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The values that a sweep covers, and what identifies it when it is resumed."""

import json
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from gait_entrainment.errors import EntrainmentError, UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import Checked, setting
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats

_PACKAGES = ("gait_entrainment", "numpy", "scipy", "numba", "pyarrow")


class SweepError(EntrainmentError):
    """A sweep that cannot be completed; the message is one line and says what to do."""


@dataclass(frozen=True)
class Axis:
    """Evenly spaced values, both ends included."""

    least: float
    most: float
    count: int

    @property
    def values(self) -> Floats:
        """The values, ascending."""
        return np.linspace(self.least, self.most, self.count)


@dataclass(frozen=True)
class SweepPlan(Checked):
    """
    A sweep over pulse period, torque and initial phase: torques x offsets x phases walks.

    Raises UsageError for a field that is out of range.
    """

    walker: WalkerParameters
    period_offsets: Axis
    """Pulse period minus the unperturbed stride period [s]."""
    torque_fractions: Axis
    """Height of the pulse as a fraction of the peak ankle torque."""
    phases: int = setting(16, "number of initial phases", within=(1, 10_000))
    strides: int = setting(100, "strides of each walk", within=(10, 1_000_000))
    width: float = setting(0.1, "duration of the pulse", "s")

    def __post_init__(self) -> None:
        """Check each field."""
        super().__post_init__()
        for name in ("period_offsets", "torque_fractions"):
            axis = getattr(self, name)
            if not axis.least <= axis.most:
                raise UsageError(f"{name}: {axis.least:g} to {axis.most:g}; allowed: ascending")
        PulsedGait(self.walker, 0.0, self.width)

    def provenance(self) -> dict[str, Any]:
        """Return the plan and the versions that run it, in JSON types."""
        versions = {"python": platform.python_version()}
        for package in _PACKAGES:
            try:
                versions[package] = version(package)
            except PackageNotFoundError:
                versions[package] = "not installed as a package"
        plan: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return {"plan": plan, "versions": versions}
