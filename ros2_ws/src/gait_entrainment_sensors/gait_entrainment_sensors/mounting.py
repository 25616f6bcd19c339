# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The orientation in which a gyroscope is mounted, from a calibration walk."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import Side

Floats = NDArray[np.float64]
Samples = Sequence[tuple[float, Sequence[float]]]  # times [s], three rates each [rad/s]

# Least share of the variance about one axis in walking: a leg swings in one plane.
_LEAST_SHARE = 0.5
# Least root mean square [rad/s] about that axis in walking.
_LEAST_RATE = 0.5
# Cosine of the angle within which a sensor counts as aligned with the shoe or shank: a foot that
# is turned out, and rolls, swings about an axis that is not its pitch axis.
_ALONG = 0.8
# A standing foot lies flat for at least the first time [s], and no gap in the samples is longer;
# it lies flat for the second time only if nobody walks.
_FLAT, _LONG = 0.1, 0.5
# A flat foot turns at less than this share of its rate when moving.
_STILL = 0.15
# Skewness that leaves no doubt about the sign.
_LEAST_SKEWNESS = 0.3


@dataclass(frozen=True)
class Mounting:
    """The axis about which the toes turn down and the shank leans forward."""

    axis: tuple[float, float, float]  # of unit length, in the sensor's frame
    swing: tuple[float, float, float]  # the axis of the swing itself, before alignment

    @property
    def text(self) -> str:
        """The axis as settings of a detector."""
        return ",".join(f"axis_{n}={v:.3f}" for n, v in zip("xyz", self.axis, strict=True))

    def toes_out(self, side: Side) -> float:
        """
        Return the sine of the angle by which the toes turn out, for a sensor x forward, z up.

        People walk with their toes turned out by some 10 degrees, so the axis about which the leg
        swings leans forward in the frame of the left foot, and backward in that of the right one.
        """
        return self.swing[0] if side is Side.LEFT else -self.swing[0]


def find_mounting(samples: Samples, *, foot: bool) -> Mounting | None:
    """
    Return the axis of foot or shank from samples (time [s], three rates [rad/s]) of some steps.

    The leg swings in the sagittal plane, so the axis is that of the largest variance. Its sign
    for a foot: between two flat stances it turns toes down by 60 degrees and toes up by 20
    (Sabatini, IEEE Trans. Biomed. Eng. 52, 217, 2005). For a shank: it leans forward slowly in
    stance and swings back fast, so the rate is skewed. Either must show in at least two strides.
    A sensor axis within 37 degrees is used instead. None if nobody walks, or in doubt.
    """
    walk = np.array([(time, *values) for time, values in samples]).reshape(-1, 4)
    walk = walk[np.isfinite(walk).all(axis=1)]
    walk = walk[np.diff(np.maximum.accumulate(walk[:, 0]), prepend=-np.inf) > 0.0]
    times, rates = walk[:, 0], walk[:, 1:]
    if len(times) < 2:
        return None
    # Minus the offset: a leg stands more than it swings. np.median takes 10 ms when first called.
    rates = rates - np.sort(rates, axis=0)[len(rates) // 2]
    variances, axes = np.linalg.eigh(rates.T @ rates / len(times))
    share = float(variances[-1] / max(variances.sum(), 1e-12))
    if share < _LEAST_SHARE or variances[-1] < _LEAST_RATE**2:
        return None
    about = rates @ axes[:, -1]
    sign = _sign_of_foot(times, rates, about) if foot else _sign_of_shank(about)
    if not sign:
        return None
    axis = swing = axes[:, -1] * sign
    if np.max(np.abs(axis)) > _ALONG:
        axis = np.sign(axis) * (np.abs(axis) > _ALONG)
    x, y, z = axis.tolist()
    return Mounting((x, y, z), tuple(swing.tolist()))


def usual_mounting(samples: Samples, length: float, *, foot: bool) -> Mounting | None:
    """Return the mounting in most parts of a length [s]: it differs where people turn round."""
    parts: dict[float, list[tuple[float, Sequence[float]]]] = {}
    for sample in samples:
        number = 2 * sample[0] // length
        for part in (number - 1, number):
            parts.setdefault(part, []).append(sample)
    found = [m for part in parts.values() if (m := find_mounting(part, foot=foot))]
    if not found:
        return find_mounting(samples, foot=foot)
    axes = np.array([mounting.axis for mounting in found])
    return found[int(np.argmax(axes @ axes.sum(axis=0)))]


def _sign_of_foot(times: Floats, rates: Floats, about: Floats) -> float:
    """Return the sign of toes down, from the mean angle between two flat stances."""
    steps, speed = np.diff(times, append=times[-1]), np.linalg.norm(rates, axis=1)
    moving = speed[speed > _LEAST_RATE]
    width = min(max(round(_FLAT / float(np.sort(steps)[steps.size // 2])), 1), steps.size)
    level = _STILL * math.sqrt(float(np.mean(moving**2)))
    still = np.convolve(speed, np.full(width, 1 / width), "same") < level
    starts, ends = np.flatnonzero(np.diff(still, prepend=False, append=False)).reshape(-1, 2).T
    # It may also be still in swing, but not for as long as it lies flat before or after.
    lasts = np.pad(times[ends - 1] - times[starts], 1)
    neighbors = np.minimum(np.maximum(lasts[:-2], lasts[2:]), _LONG)
    flat = 2 * lasts[1:-1] >= neighbors
    areas = []
    for start, end in zip(ends[flat][:-1], starts[flat][1:], strict=True):
        if steps[start:end].max() < _FLAT:
            angle = np.cumsum((about * steps)[start:end])
            angle -= np.linspace(0.0, angle[-1], angle.size)
            areas.append(float(angle @ steps[start:end]))
    if not areas:
        return 0.0
    # A stride is one vote; half a step from standing turns the other way, and counts much less.
    sizes = np.sort(np.abs(areas))
    votes = np.clip(areas / max(sizes[sizes.size // 2], 0.25 * sizes[-1], 1e-9), -1.0, 1.0)
    votes *= np.abs(votes)
    total = float(votes.sum())
    certain = abs(total) > max(1.5, 0.5 * float(np.abs(votes).sum()))
    return math.copysign(1.0, total) if certain else 0.0


def _sign_of_shank(about: Floats) -> float:
    """Return the sign of leaning forward, by the skewness of the rate."""
    centred = about.mean() - about
    skewness = float(np.mean(centred**3) / np.mean(centred**2) ** 1.5)
    if abs(skewness) < _LEAST_SKEWNESS:
        return 0.0
    swings = np.diff(centred * skewness > 0.5 * np.max(centred * skewness), prepend=False)
    return math.copysign(1.0, skewness) if swings.sum() > 2 else 0.0
