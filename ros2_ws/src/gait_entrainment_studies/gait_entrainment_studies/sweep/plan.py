# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a sweep goes through, and what it must be told apart by when it is resumed."""

import json
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.roots import Floats

_PACKAGES = ("gait_entrainment", "numpy", "scipy", "numba", "pyarrow")


class SweepError(ValueError):
    """A sweep that cannot be made or resumed; one line: field, what is allowed, what to do."""


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
class SweepPlan:
    """
    A sweep over pulse period, torque and initial phase: torques x offsets x phases walks.

    Raises
    ------
    SweepError
        names the field that is out of range and the range.

    """

    walker: WalkerParameters
    period_offsets: Axis
    """Pulse period minus the unperturbed stride period [s]."""
    torque_fractions: Axis
    """Height of the pulse as a fraction of the peak ankle torque."""
    phases: int
    """Initial phases, spread evenly over the stride."""
    strides: int
    """Length of each walk."""
    width: float
    """Duration of the pulse [s]."""

    def __post_init__(self) -> None:
        """Hold each field against its range."""
        for name in ("period_offsets", "torque_fractions"):
            axis = getattr(self, name)
            if not (np.isfinite([axis.least, axis.most]).all() and axis.least <= axis.most):
                raise SweepError(f"{name}: {axis.least:g} to {axis.most:g}; allowed: ascending")
            if axis.count < 1:
                raise SweepError(f"{name}: {axis.count} values; allowed: at least 1")
        for name, least in (("phases", 1), ("strides", 10)):
            if getattr(self, name) < least:
                raise SweepError(f"{name}: {getattr(self, name)}; allowed: at least {least}")
        try:
            PulsedGait(self.walker, 0.0, self.width)
        except ValueError as error:
            raise SweepError(str(error)) from None

    @property
    def walks(self) -> int:
        """Number of walks."""
        return self.period_offsets.count * self.torque_fractions.count * self.phases

    def provenance(self) -> dict[str, Any]:
        """Return the plan and the versions that it is made with, as JSON holds them."""
        versions = {"python": platform.python_version()}
        for package in _PACKAGES:
            try:
                versions[package] = version(package)
            except PackageNotFoundError:
                versions[package] = "not installed as a package"
        plan: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return {"plan": plan, "versions": versions}
