# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Which way round a gyroscope was put on, from a calibration walk."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import Side

# Share of the variance about one axis from which on somebody walks: a leg swings in one plane.
_LEAST_SHARE = 0.5
# Root mean square [rad/s] about that axis from which on somebody walks.
_LEAST_RATE = 0.5
# Cosine of the angle within which a sensor counts as put on along the shoe or shank: a foot that
# is turned out, and rolls, swings about an axis of its own, which is not that of its pitch.
_ALONG = 0.8
# Skewness that leaves no doubt about the sign.
_LEAST_SKEWNESS = 0.3


@dataclass(frozen=True)
class Mounting:
    """The axis about which the toes turn down and the shank leans forward."""

    axis: tuple[float, float, float]  # of unit length, in the frame of the sensor
    swing: tuple[float, float, float]  # the axis of the swing itself, before it was put along

    @property
    def text(self) -> str:
        """The settings that say so."""
        return ",".join(f"axis_{n}={v:.3f}" for n, v in zip("xyz", self.axis, strict=True))

    def toes_out(self, side: Side) -> float:
        """
        Return the sine of the angle by which the toes turn out, of a sensor x forward, z up.

        People walk with their toes turned out by some 10 degrees, so the axis about which the leg
        swings leans forward in the frame of the left foot, and backward in that of the right one.
        """
        return self.swing[0] if side is Side.LEFT else -self.swing[0]


def find_mounting(
    samples: Sequence[tuple[float, Sequence[float]]], *, foot: bool
) -> Mounting | None:
    """
    Return the axis of foot or shank from samples (time [s], three rates [rad/s]) of some steps.

    The leg swings in the sagittal plane: the axis is that of the largest variance. Its sign, of a
    foot: between two flat stances it turns toes down by 60 degrees and toes up by 20, so the angle
    is skewed. Of a shank: it leans forward slowly in stance and swings back fast, so the rate is.
    An axis of the sensor that is within 37 degrees is taken instead.
    None if nobody walks, or the sign is not certain.
    """
    times = np.array([time for time, _ in samples])
    rates = np.array([values for _, values in samples], float)
    rates = rates - rates.mean(axis=0)  # over some strides a leg turns by nothing
    variances, axes = np.linalg.eigh(rates.T @ rates / max(len(times), 1))
    share = float(variances[-1] / max(variances.sum(), 1e-12))
    if share < _LEAST_SHARE or variances[-1] < _LEAST_RATE**2:
        return None
    about = rates @ axes[:, -1]
    told = -about
    if foot:
        angle = np.concatenate([[0.0], np.cumsum((about[1:] + about[:-1]) / 2 * np.diff(times))])
        told = angle - np.polyval(np.polyfit(times, angle, 1), times)
    told = told - told.mean()
    skewness = float(np.mean(told**3) / np.mean(told**2) ** 1.5)
    if abs(skewness) < _LEAST_SKEWNESS:
        return None
    axis = swing = axes[:, -1] * np.sign(skewness)
    if np.max(np.abs(axis)) > _ALONG:
        axis = np.sign(axis) * (np.abs(axis) > _ALONG)
    x, y, z = axis.tolist()
    return Mounting((x, y, z), tuple(swing.tolist()))
